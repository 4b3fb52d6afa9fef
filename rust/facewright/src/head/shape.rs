//! Our way to the shape: tracks, bundle, class, free deformation, eyes.

use crate::faces::clip::{ChosenFrame, Clip};
use crate::faces::select::median;
use crate::head::unseen::replace_unseen;
use crate::solve::{Structure, solve};
use crate::track::{FaceTrack, FollowOptions, TrackedFrame, Tracks, follow, given};
use crate::{CameraSource, FacewrightError, FitReport, SizeOptions, SourcedCamera};
use geometry::face_mesh::IBUG68;
use geometry::{Camera, Progress, Similarity, Transform, Vec3};
use head::GenericHead;
use head::deform::{DeformOptions, refine};
use head::eyes::{EyeFit, EyeOptions, IrisObservation, carry_parts, fit_eyes, place_eyes};
use head::features::{FeatureFrame, FeatureOptions, align_features};
use head::fit::{CloudFrame, FitOptions, HeadFit, fit_cloud};
use head::lips::close_lips;
use motion::triangulate::triangulate;

/// Fewer skin points than this do not improve on the landmarks.
const LEAST_POINTS: usize = 40;
/// Tracking and fitting, each time from the better head.
const ROUNDS: usize = 2;

/// The person's shape and where the camera stood.
pub struct Shape {
    /// The camera, refined where it was not calibrated.
    pub camera: Camera,
    /// All vertices at rest, head frame, metres.
    pub positions: Vec<Vec3>,
    /// Pose of every chosen frame.
    pub poses: Vec<Transform>,
    /// Reprojection error of every chosen frame, pixels.
    pub rms_px: Vec<Option<f64>>,
    /// Takes poses of the landmark fit to this head.
    pub head_from_landmark_head: Similarity,
    /// iBUG landmarks, head frame, metres.
    pub landmarks68: Vec<Vec3>,
    /// Measured points.
    pub points: usize,
    /// How well it fits.
    pub fit: FitReport,
    /// What the artist should know.
    pub warnings: Vec<String>,
}

/// The head as it is known at some stage, with the poses of the chosen frames.
pub struct Known {
    /// All vertices.
    pub positions: Vec<Vec3>,
    /// Poses of the chosen frames.
    pub poses: Vec<Transform>,
    /// Their camera.
    pub camera: Camera,
}

/// One round's result.
struct Measured {
    structure: Structure,
    fit: HeadFit,
}

/// Measures the shape of the head in a clip, by the `tracks` given or by its own.
pub fn measure_shape(
    clip: &Clip,
    head: &GenericHead,
    camera: &SourcedCamera,
    size: &SizeOptions,
    tracks: Option<&Tracks>,
    progress: &Progress,
) -> Result<Shape, FacewrightError> {
    let mut known = Known {
        positions: clip.landmark_fit.positions.clone(),
        poses: clip.chosen.iter().map(|c| clip.pose(c)).collect(),
        camera: match camera.source {
            CameraSource::Board => camera.camera,
            CameraSource::Exif | CameraSource::Estimated => clip.landmark_fit.camera,
        },
    };
    let options = FitOptions { size: size.head_size(), ..FitOptions::default() };
    // The landmark fit has narrowed it down already.
    let focal_sigma = 0.5 * camera.source.focal_sigma();
    let mut last: Option<Measured> = None;
    let mut head_from_landmark_head = Similarity::identity();
    for _ in 0..ROUNDS {
        let tracks = track_clip(clip, head, &known, tracks, progress)?;
        if tracks.len() < LEAST_POINTS {
            break;
        }
        let structure = solve(&tracks, &known.poses, &known.camera, focal_sigma, progress)?;
        if structure.cloud.len() < LEAST_POINTS {
            break;
        }
        let frames = cloud_frames(clip, &structure);
        let fit =
            fit_cloud(head, &structure.camera, &frames, &structure.cloud, &clip.landmark_fit, &options, progress)?;
        let carried = refine(head, &fit, &structure.cloud, &DeformOptions::default())?;
        let poses = structure.poses.iter().map(|p| fit.head_from_cloud.move_pose(p)).collect();
        head_from_landmark_head = chain(&fit.head_from_cloud, &head_from_landmark_head);
        known = Known { positions: carried.positions, poses, camera: structure.camera };
        last = Some(Measured { structure, fit });
    }
    if let Some(measured) = &last {
        let to_head = &measured.fit.head_from_cloud;
        let points: Vec<Vec3> = measured.structure.cloud.iter().map(|p| to_head.apply(&p.position)).collect();
        known.positions = replace_unseen(head, &known.positions, &points);
    }
    let mut warnings = Vec::new();
    if last.is_none() {
        let own = "the skin shows too little texture to be tracked: the shape rests on the landmarks alone";
        let others = "too few of the tracks are on skin that the frames show: the shape rests on the landmarks alone";
        warnings.push(if tracks.is_some() { others } else { own }.to_owned());
    }
    known.positions = align(head, clip, &known)?;
    let eyes = finish_eyes(head, clip, &mut known)?;
    Ok(Shape {
        fit: fit_report(clip, last.as_ref(), &eyes),
        landmarks68: landmarks68(head, &known.positions),
        points: last.as_ref().map_or(0, |m| m.structure.cloud.len()),
        rms_px: rms(clip, last.as_ref()),
        camera: known.camera,
        positions: known.positions,
        poses: known.poses,
        head_from_landmark_head,
        warnings,
    })
}

/// The iBUG landmarks, head frame, metres.
pub fn landmarks68(head: &GenericHead, positions: &[Vec3]) -> Vec<Vec3> {
    let all = head.landmarks(positions);
    IBUG68.iter().map(|&i| all[i]).collect()
}

/// The head with its features where the frames show them.
fn align(head: &GenericHead, clip: &Clip, known: &Known) -> Result<Vec<Vec3>, FacewrightError> {
    let frame = |(chosen, pose): (&ChosenFrame, &Transform)| {
        let fitted = clip.landmark_fit.frames[chosen.index].as_ref()?;
        Some(FeatureFrame { seen: &clip.seen[chosen.index], pose: *pose, expression: &fitted.expression })
    };
    let frames: Vec<FeatureFrame> = clip.chosen.iter().zip(&known.poses).filter_map(frame).collect();
    Ok(align_features(head, &known.positions, &known.camera, &frames, &FeatureOptions::default())?)
}

/// `c_from_a` of `c_from_b` and `b_from_a`.
fn chain(c_from_b: &Similarity, b_from_a: &Similarity) -> Similarity {
    let rotation = c_from_b.rigid.rotation * b_from_a.rigid.rotation;
    let translation = c_from_b.apply(&b_from_a.rigid.translation);
    Similarity { scale: c_from_b.scale * b_from_a.scale, rigid: Transform::new(rotation, translation) }
}

fn track_clip(
    clip: &Clip,
    head: &GenericHead,
    known: &Known,
    tracks: Option<&Tracks>,
    progress: &Progress,
) -> Result<Vec<FaceTrack>, FacewrightError> {
    let frames: Vec<TrackedFrame> = clip
        .chosen
        .iter()
        .zip(&known.poses)
        .map(|(c, pose)| TrackedFrame { skin: &c.skin, cam_from_head: *pose })
        .collect();
    let skin = head.outer_skin();
    let options = FollowOptions::default();
    let Some(tracks) = tracks else {
        return follow(&frames, &known.camera, &known.positions, &skin, &options, progress);
    };
    let chosen: Vec<usize> = clip.chosen.iter().map(|c| c.index).collect();
    Ok(given(tracks, &chosen, &frames, &known.camera, &known.positions, &skin, options.min_frames))
}

fn cloud_frames<'a>(clip: &'a Clip, structure: &Structure) -> Vec<CloudFrame<'a>> {
    let chosen = clip.chosen.iter().zip(&structure.poses);
    chosen.map(|(c, pose)| CloudFrame { seen: &clip.seen[c.index], pose: *pose, index: c.index }).collect()
}

/// Closes the lips, fits the eyeballs to sockets and irises and takes lashes, teeth and tongue along.
pub fn finish_eyes(head: &GenericHead, clip: &Clip, known: &mut Known) -> Result<[EyeFit; 2], FacewrightError> {
    let irises = [0, 1].map(|side| iris_in_head(clip, &known.poses, &known.camera, side));
    let positions = &mut known.positions;
    close_lips(head, positions)?;
    carry_parts(head, positions)?;
    let eyes = fit_eyes(head, positions, &irises, &EyeOptions::default())?;
    place_eyes(head, positions, &eyes)?;
    Ok(eyes)
}

/// Where an iris is in the head, from the frames in which the person looks at about the same place of the head's own
/// frame as usual: while the head turns, the gaze may stay on the camera, and then only near-frontal frames agree.
fn iris_in_head(clip: &Clip, poses: &[Transform], camera: &Camera, side: usize) -> Option<IrisObservation> {
    let frontal = |pose: &Transform| crate::faces::select::yaw_pitch(pose).0.abs().to_degrees() < 12.0;
    let mut rays = Vec::new();
    let mut diameters = Vec::new();
    for (chosen, pose) in clip.chosen.iter().zip(poses) {
        let Some(iris) = clip.face(chosen).map(|f| &f.irises[side]).filter(|i| i.visible && frontal(pose)) else {
            continue;
        };
        rays.push((*pose, camera.normalise(&iris.centre)));
        diameters.push(iris.radius / camera.fx);
    }
    let found = triangulate(&rays)?;
    let depths = rays.iter().zip(&diameters).map(|((pose, _), d)| d * pose.apply(&found.point).z);
    Some(IrisObservation { centre: found.point, radius: median(depths) })
}

fn rms(clip: &Clip, measured: Option<&Measured>) -> Vec<Option<f64>> {
    match measured {
        Some(m) => m.structure.rms_px.clone(),
        None => clip.chosen.iter().map(|c| clip.landmark_fit.frames[c.index].as_ref().map(|f| f.rms_px)).collect(),
    }
}

fn fit_report(clip: &Clip, measured: Option<&Measured>, eyes: &[EyeFit; 2]) -> FitReport {
    let coefficients = measured.map_or(&clip.landmark_fit.coefficients, |m| &m.fit.coefficients);
    let squares: f64 = coefficients.iter().map(|c| c * c).sum();
    let errors = clip.landmark_fit.landmark_errors_px.iter().copied().filter(|e| e.is_finite());
    FitReport {
        components: coefficients.len(),
        coefficient_rms: (squares / coefficients.len().max(1) as f64).sqrt(),
        rigid_agreement: measured.map_or(0.0, |m| m.structure.agreement),
        points_median_mm: measured.map_or(0.0, |m| 1000.0 * m.fit.median_distance),
        landmarks_median_px: median(errors),
        interocular_mm: 1000.0 * (eyes[0].centre - eyes[1].centre).norm(),
    }
}
