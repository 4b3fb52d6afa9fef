//! The paper's way to the shape (sections 2.3 to 2.6 and 2.8).
//!
//! Two near-frontal frames 10–15° apart, corners by pyramidal Lucas–Kanade, local adjustment, eight-point motion refined
//! by epipolar distances, triangulation; the general head, scaled and turned to the feature points, is interpolated by
//! affine + exp(−r/64); then more images, one after the other, are resected and refine the feature points.
//!
//! The paper marks the features of the general head by hand; here they are its landmark anchors, found in the frames by the
//! landmark net; they and the matched corners determine the motion.

use super::{Measured, MeasuredFrame};
use crate::faces::{Chosen, Clip, median, yaw_pitch};
use crate::frames::Octave;
use crate::patches::TrackedSkin;
use crate::reason::FrameReason;
use crate::track::pair::{MatchOptions, paper_matches};
use crate::{FacewrightError, SizeOptions, SourcedCamera};
use geometry::face_mesh::FACE_OVAL;
use geometry::rbf::{RbfOptions, RbfWarp};
use geometry::{Camera, Progress, Similarity, Transform, Vec2, Vec3, mesh};
use head::GenericHead;
use head::fit::eye_centres;
use motion::resect::{ResectOptions, resect};
use motion::triangulate::triangulate;
use motion::two_view;

/// Turn between the two frames, degrees.
const PAIR_DEG: (f64, f64) = (10.0, 15.0);
/// A feature point farther from the general head than this was mismatched, metres.
const FARTHEST_FEATURE: f64 = 0.025;
/// Average interpupillary distance, metres.
const PUPILS: f64 = 0.063;

/// Skin steeper than this against the line of sight hides its features, cosine.
const STEEPEST: f64 = 0.2;

/// One feature point: which landmark, and where.
type Feature = (usize, Vec3);

/// An image and its features.
struct FeatureView {
    /// `cam_from_x`, in the frame of the structure.
    pose: Transform,
    /// Normalised coordinates of all landmarks.
    rays: Vec<Vec2>,
    /// Which of them can be seen there: of the others the net only guesses the place.
    visible: Vec<bool>,
}

/// A frame that the paper's steps use.
#[derive(Clone, Copy)]
struct Image {
    /// Its place in the clip.
    index: usize,
    /// Pose by the landmarks: which frames suit each other, and which features each can show.
    pose: Transform,
}

/// Measures the shape as the paper does.
///
/// # Errors
/// Those of [`Chosen::of`], [`FacewrightError::TooFewMatches`], [`motion::MotionError`], [`FacewrightError::Cancelled`].
pub fn measure(
    clip: &Clip,
    camera: &SourcedCamera,
    size: &SizeOptions,
    progress: &Progress,
) -> Result<Measured, FacewrightError> {
    progress.stage("shape")?;
    let (head, camera) = (clip.head, camera.camera);
    let chosen = trusted(clip)?;
    let images: Vec<Image> = chosen.frames.iter().map(|&index| Image { index, pose: clip.pose(index) }).collect();
    let (a, b) = choose_pair(&images);
    let features = features(head);
    let view = |image: &Image, pose| FeatureView {
        pose,
        rays: rays(clip, image, &camera),
        visible: visible(head, &image.pose),
    };
    let both = [rays(clip, &images[a], &camera), rays(clip, &images[b], &camera)];
    let motion = two_frame_motion(clip, [&images[a], &images[b]], &features, &both, &camera)?;
    let pair = [view(&images[a], Transform::identity()), view(&images[b], motion)];
    let cloud = triangulate_features(&features, &pair);
    let head_from_a = align(head, &cloud)?;
    let pose_a = head_from_a.move_pose(&Transform::identity());
    let structure: Vec<Feature> = cloud.iter().map(|(i, p)| (*i, head_from_a.apply(p))).collect();
    let (poses, structure) = add_images(clip, &images, &camera, (a, pose_a), structure, progress)?;
    let warped = interpolate(head, &structure)?;
    let (positions, poses, structure) = to_size(head, warped, poses, structure, size.interocular().unwrap_or(PUPILS));
    let from_landmarks = between(&poses[a], &images[a].pose);
    let mut frames: Vec<MeasuredFrame> =
        (0..clip.frames.len()).map(|i| by_landmarks(clip, i, &from_landmarks)).collect();
    for (image, pose) in images.iter().zip(&poses) {
        let rms_px = rms(&structure, &rays(clip, image, &camera), pose, &camera);
        frames[image.index] = MeasuredFrame { pose: Some(*pose), rms_px, by_landmarks: false };
    }
    Ok(Measured {
        camera,
        positions,
        frames,
        chosen,
        points: structure.iter().map(|(_, place)| *place).collect(),
        coefficients: Vec::new(),
        agreement: 0.0,
        points_median: 0.0,
        focal_sigma_px: None,
        warnings: Vec::new(),
    })
}

/// The frames without those whose features the net only guesses: the paper's images are near-frontal.
fn trusted(clip: &Clip) -> Result<Chosen, FacewrightError> {
    let poses: Vec<Option<Transform>> = (0..clip.frames.len()).map(|frame| clip.known.pose(frame)).collect();
    let is_trusted = |frame: usize| clip.landmark_fit.frames[frame].as_ref().is_some_and(|f| f.trusted);
    let reason = FrameReason::FromTheSide;
    let chosen = Chosen::of(clip, &poses)?.without(&reason, |frame| !is_trusted(frame));
    if chosen.frames.len() < 2 {
        let (usable, frames) = (chosen.frames.len(), clip.frames.len());
        return Err(FacewrightError::TooFewUsable { usable, frames, reasons: reason.to_string() });
    }
    Ok(chosen)
}

/// A frame that was not used, by its landmarks.
fn by_landmarks(clip: &Clip, index: usize, from_landmarks: &Similarity) -> MeasuredFrame {
    let pose = clip.known.pose(index).map(|pose| from_landmarks.move_pose(&pose));
    let rms_px = clip.landmark_fit.frames[index].as_ref().map(|fitted| fitted.rms_px);
    MeasuredFrame { pose, rms_px, by_landmarks: pose.is_some() }
}

/// The pair nearest to frontal among those turned by the paper's angle, or nearest to that angle.
fn choose_pair(images: &[Image]) -> (usize, usize) {
    let yaw: Vec<f64> = images.iter().map(|image| yaw_pitch(&image.pose).0.to_degrees()).collect();
    let pairs = (0..yaw.len()).flat_map(|a| (a + 1..yaw.len()).map(move |b| (a, b)));
    let cost = |&(a, b): &(usize, usize)| {
        let turn = images[a].pose.angle_to(&images[b].pose).to_degrees();
        let off = (PAIR_DEG.0 - turn).max(turn - PAIR_DEG.1).max(0.0);
        10.0 * off + (yaw[a] + yaw[b]).abs() / 2.0
    };
    pairs.min_by(|x, y| cost(x).total_cmp(&cost(y))).unwrap_or((0, 0))
}

/// The motion between two frames: eight points from matched corners and feature points together, refined on the corners, which
/// are matched more finely than the net marks features.
fn two_frame_motion(
    clip: &Clip,
    images: [&Image; 2],
    features: &[usize],
    rays: &[Vec<Vec2>; 2],
    camera: &Camera,
) -> Result<Transform, FacewrightError> {
    let skin = |image: &Image| -> Result<TrackedSkin, FacewrightError> {
        let face = clip.faces.face(image.index).ok_or(FacewrightError::NoFace { frames: 1 })?;
        Ok(TrackedSkin::of(clip.frames.pyramid(image.index, Octave::default())?, face))
    };
    let [a, b] = [skin(images[0])?, skin(images[1])?];
    let pair = paper_matches([&a.pyramid, &b.pyramid], &a.mask, &MatchOptions::default())?;
    let kept: Vec<_> = pair.kept().collect();
    let in_a: Vec<Vec2> = kept.iter().map(|m| camera.normalise(&Vec2::new(m.0, m.1))).collect();
    let in_b: Vec<Vec2> = kept.iter().map(|m| camera.normalise(&Vec2::new(m.2, m.3))).collect();
    let and_features = |corners: &[Vec2], rays: &[Vec2]| -> Vec<Vec2> {
        corners.iter().copied().chain(features.iter().map(|&i| rays[i])).collect()
    };
    let start = two_view::paper(&and_features(&in_a, &rays[0]), &and_features(&in_b, &rays[1]))?.b_from_a;
    Ok(two_view::refine_epipolar_trimmed(&in_a, &in_b, &start))
}

/// Landmarks that are points of the skin, not of its outline.
fn features(head: &GenericHead) -> Vec<usize> {
    (0..head.anchors.len()).filter(|i| !FACE_OVAL.contains(i)).collect()
}

/// Normalised coordinates of all landmarks of a frame.
fn rays(clip: &Clip, image: &Image, camera: &Camera) -> Vec<Vec2> {
    clip.seen[image.index].landmarks.iter().map(|p| camera.normalise(p)).collect()
}

/// Which landmarks face the camera on the general head.
fn visible(head: &GenericHead, cam_from_head: &Transform) -> Vec<bool> {
    let normals = mesh::vertex_normals(&head.positions, &head.triangles(head.skin()));
    let eye = cam_from_head.inverse().translation;
    let faces = |anchor: &head::Anchor| {
        let place = mesh::at_barycentric(&head.positions, &anchor.triangle, &anchor.weights);
        let normal = mesh::at_barycentric(&normals, &anchor.triangle, &anchor.weights);
        normal.dot(&(eye - place)) > STEEPEST * normal.norm() * (eye - place).norm()
    };
    head.anchors.iter().map(faces).collect()
}

/// The features that at least two of the views see.
fn triangulate_features(features: &[usize], views: &[FeatureView]) -> Vec<Feature> {
    let place = |&i: &usize| {
        let seen: Vec<(Transform, Vec2)> = views.iter().filter(|v| v.visible[i]).map(|v| (v.pose, v.rays[i])).collect();
        Some((i, triangulate(&seen)?.point))
    };
    features.iter().filter_map(place).collect()
}

/// The similarity that lays the feature points onto the general head, mismatched ones left out.
fn align(head: &GenericHead, cloud: &[Feature]) -> Result<Similarity, FacewrightError> {
    let anchors = head.landmarks(&head.positions);
    let mut kept: Vec<&Feature> = cloud.iter().collect();
    let mut fitted = None;
    for _ in 0..6 {
        let from: Vec<Vec3> = kept.iter().map(|f| f.1).collect();
        let to: Vec<Vec3> = kept.iter().map(|f| anchors[f.0]).collect();
        let Some(similarity) = Similarity::fit(&from, &to, None, true) else { break };
        let distance = |f: &Feature| (similarity.apply(&f.1) - anchors[f.0]).norm();
        let limit = (2.5 * median(cloud.iter().map(distance))).max(0.004);
        kept = cloud.iter().filter(|f| distance(f) < limit).collect();
        fitted = Some(similarity);
    }
    fitted.ok_or(FacewrightError::TooFewMatches { found: cloud.len() })
}

/// Resects the other images, those nearest in direction first, each from the nearest one before, and triangulates the features
/// anew after each.
fn add_images(
    clip: &Clip,
    images: &[Image],
    camera: &Camera,
    (first, pose): (usize, Transform),
    mut structure: Vec<Feature>,
    progress: &Progress,
) -> Result<(Vec<Transform>, Vec<Feature>), FacewrightError> {
    let turn = |i: usize, j: usize| images[i].pose.angle_to(&images[j].pose);
    let mut order: Vec<usize> = (0..images.len()).collect();
    order.sort_by(|&i, &j| turn(i, first).total_cmp(&turn(j, first)));
    let options = ResectOptions { threshold: 6.0 / camera.fx, ..ResectOptions::default() };
    let wanted: Vec<usize> = structure.iter().map(|f| f.0).collect();
    let mut views: Vec<FeatureView> = Vec::new();
    for (done, &i) in order.iter().enumerate() {
        progress.step(done, order.len())?;
        let image = &images[i];
        let mut view = FeatureView { pose, rays: rays(clip, image, camera), visible: visible(clip.head, &image.pose) };
        if let Some(near) = (0..done).min_by(|&a, &b| turn(order[a], i).total_cmp(&turn(order[b], i))) {
            let seen: Vec<&Feature> = structure.iter().filter(|f| view.visible[f.0]).collect();
            let normalised: Vec<Vec2> = seen.iter().map(|f| view.rays[f.0]).collect();
            let points: Vec<Vec3> = seen.iter().map(|f| f.1).collect();
            view.pose = resect(&points, &normalised, Some(views[near].pose), &options)?.cam_from_x;
        }
        views.push(view);
        if views.len() >= 3 {
            structure = triangulate_features(&wanted, &views);
        }
    }
    let mut poses = vec![Transform::identity(); views.len()];
    order.iter().zip(&views).for_each(|(&i, view)| poses[i] = view.pose);
    Ok((poses, structure))
}

/// Eq. 8–10: the general head's features take their measured places, the rest follows.
fn interpolate(head: &GenericHead, structure: &[Feature]) -> Result<Vec<Vec3>, FacewrightError> {
    let anchors = head.landmarks(&head.positions);
    let near = |(i, p): &&Feature| (p - anchors[*i]).norm() < FARTHEST_FEATURE;
    let used: Vec<&Feature> = structure.iter().filter(near).collect();
    let centres: Vec<Vec3> = used.iter().map(|f| anchors[f.0]).collect();
    let moves: Vec<Vec3> = used.iter().map(|f| f.1 - anchors[f.0]).collect();
    let warp = RbfWarp::fit(&centres, &moves, None, &RbfOptions::default())?;
    Ok(warp.apply(&head.positions))
}

/// Gives head, poses and features the size at which the eyeballs' centres are `pupils` apart.
fn to_size(
    head: &GenericHead,
    positions: Vec<Vec3>,
    poses: Vec<Transform>,
    structure: Vec<Feature>,
    pupils: f64,
) -> (Vec<Vec3>, Vec<Transform>, Vec<Feature>) {
    let apart = eye_centres(head, &positions).map(|[left, right]| (left - right).norm());
    let scale = apart.map_or(1.0, |apart| pupils / apart.max(1e-6));
    let sized = Similarity { scale, rigid: Transform::identity() };
    (
        positions.iter().map(|p| sized.apply(p)).collect(),
        poses.iter().map(|p| sized.move_pose(p)).collect(),
        structure.iter().map(|(i, p)| (*i, sized.apply(p))).collect(),
    )
}

fn rms(structure: &[Feature], rays: &[Vec2], pose: &Transform, camera: &Camera) -> Option<f64> {
    let error = |(i, p): &Feature| {
        let pixel = camera.project(&pose.apply(p))?;
        Some((pixel - camera.distort(&rays[*i])).norm_squared())
    };
    let errors: Vec<f64> = structure.iter().filter_map(error).collect();
    (!errors.is_empty()).then(|| (errors.iter().sum::<f64>() / errors.len() as f64).sqrt())
}

/// The similarity that takes one pose of a frame to another, sizes told apart by the distance from the camera.
fn between(own: &Transform, other: &Transform) -> Similarity {
    let scale = own.translation.norm() / other.translation.norm().max(1e-9);
    let rotation = own.rotation.inverse() * other.rotation;
    let translation = own.rotation.inverse() * (other.translation * scale - own.translation);
    Similarity { scale, rigid: Transform::new(rotation, translation) }
}
