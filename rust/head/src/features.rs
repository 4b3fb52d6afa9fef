//! Lips, lids, brows and nose where the frames show them.
//!
//! Distances of points from the skin say nothing about what slid along it: a head may lie within a third of a millimetre of
//! the person and have its lips 3 mm too high, and then the picture's lips are painted on its chin. Here the features
//! of the finished shape are compared with their landmarks in the frames that show the face from in front, and slid along
//! the skin until they agree.
//!
//! # Entry point
//! [`align_features`]

use crate::deform::{Carried, DeformOptions, Feature, carry};
use crate::fit::FrameObservation;
use crate::soft::firm_share;
use crate::{GenericHead, HeadError};
use geometry::face_mesh::{
    BROWS_LOWER, BROWS_UPPER, EYE_CONTOURS, LIPS_INNER_LOWER, LIPS_INNER_UPPER, LIPS_OUTER_LOWER, LIPS_OUTER_UPPER,
    NOSE_BASE, NOSE_RIDGE,
};
use geometry::least_squares::Loss;
use geometry::rbf::Kernel;
use geometry::{Camera, Transform, Vec2, Vec3, mesh};
use nalgebra::{Matrix2, Matrix2x3, Matrix3x2};
use std::collections::BTreeSet;

/// A frame and what was found in it.
#[derive(Clone, Copy, Debug)]
pub struct FeatureFrame<'a> {
    /// The landmarks.
    pub seen: &'a FrameObservation,
    /// `cam_from_head`.
    pub pose: Transform,
    /// What the frame's expression adds to the rest shape: a weight for each of the head's keys.
    pub expression: &'a [f64],
}

/// How features are aligned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeatureOptions {
    /// Frames with more yaw than this are not used, radians: from the side the net guesses.
    pub largest_turn: f64,
    /// How far features are off before they are aligned, metres, one standard deviation.
    pub expected: f64,
    /// How far the skin around a feature follows, metres.
    pub reach: f64,
}

impl Default for FeatureOptions {
    fn default() -> Self {
        Self { largest_turn: 25.0_f64.to_radians(), expected: 0.003, reach: 0.02 }
    }
}

/// Least frames that must show a feature.
const LEAST_FRAMES: usize = 2;
/// Steps of the robust mean over the frames.
const STEPS: usize = 6;
/// Skin steeper than this against the line of sight is not believed, cosine.
const STEEPEST: f64 = 0.35;
/// A frame whose landmark is off by more than this many standard deviations counts linearly only.
const ROBUST_LIMIT: f64 = 1.5;

/// Slides the features of a head (`positions`: all vertices at rest, metres) along the skin to where the frames show them;
/// unchanged where no frame shows the face from in front.
///
/// # Errors
/// As for [`carry`].
pub fn align_features(
    head: &GenericHead,
    positions: &[Vec3],
    camera: &Camera,
    frames: &[FeatureFrame<'_>],
    options: &FeatureOptions,
) -> Result<Vec<Vec3>, HeadError> {
    let front: Vec<&FeatureFrame> = frames.iter().filter(|f| turn(&f.pose) < options.largest_turn).collect();
    let normals = mesh::vertex_normals(positions, &head.triangles(head.skin()));
    let expressions: Vec<Vec<Vec3>> = front.iter().map(|f| head.landmark_offsets(f.expression)).collect();
    let views: Vec<View> = front.iter().zip(&expressions).map(|(f, e)| View { frame: f, expression: e }).collect();
    let rims = rims(head, &normals);
    let rim = |index: usize| rims.iter().find(|(rim, _)| rim.contains(&index)).map(|(_, normal)| *normal);
    let features: Vec<Feature> = feature_landmarks()
        .into_iter()
        .filter_map(|index| {
            let normal = rim(index).or_else(|| normal(head, &normals, index))?;
            observed(head, positions, &normal, camera, &views, index)
        })
        .collect();
    if features.len() < LEAST_FEATURES {
        return Ok(positions.to_vec());
    }
    let deform = DeformOptions {
        kernel: Kernel::Exponential { length: options.reach },
        expected: options.expected,
        rest_distance: options.reach,
        rest_sigma: 0.5 * options.expected,
        ..DeformOptions::default()
    };
    let Carried { positions: moved, .. } = carry(head, positions, &features, &deform)?;
    Ok(along_skin(head, positions, &normals, moved))
}

/// Skin that slides stays on the skin: what was measured across it is not lost. Only the edges of lids and lips, which end it, move as
/// they are moved.
fn along_skin(head: &GenericHead, before: &[Vec3], normals: &[Vec3], mut moved: Vec<Vec3>) -> Vec<Vec3> {
    let share = firm_share(head, EDGES);
    for v in head.skin().vertices.clone().filter(|&v| !head.cavity[v]) {
        let step = moved[v] - before[v];
        moved[v] -= normals[v] * (normals[v].dot(&step) * share[v]);
    }
    moved
}

/// Skin within the first of the edges of lids and lips is free to leave the surface, beyond the second it is not, metres.
const EDGES: (f64, f64) = (0.001, 0.004);

/// Fewer features than this say nothing.
const LEAST_FEATURES: usize = 12;

/// Angle between the face's axis and the line of sight.
fn turn(cam_from_head: &Transform) -> f64 {
    (-(cam_from_head.rotation * Vec3::z()).z).clamp(-1.0, 1.0).acos()
}

/// The landmarks that are drawn on the face and not guessed from it, ascending.
fn feature_landmarks() -> Vec<usize> {
    let lips = [LIPS_OUTER_UPPER, LIPS_OUTER_LOWER, LIPS_INNER_UPPER, LIPS_INNER_LOWER];
    let set: BTreeSet<usize> = EYE_CONTOURS
        .iter()
        .flatten()
        .chain(lips.iter().flatten())
        .chain(BROWS_UPPER.iter().flatten())
        .chain(BROWS_LOWER.iter().flatten())
        .chain(&NOSE_RIDGE)
        .chain(&NOSE_BASE)
        .copied()
        .collect();
    set.into_iter().collect()
}

/// The rims of both eyes' and of the mouth's openings, and the direction that each opens to. Skin that ends there turns inwards: its own
/// normal points across the opening, where nothing slides.
fn rims(head: &GenericHead, normals: &[Vec3]) -> Vec<(Vec<usize>, Vec3)> {
    let mouth = [LIPS_INNER_UPPER, LIPS_INNER_LOWER].concat();
    let rims = EYE_CONTOURS.iter().map(|contour| contour.to_vec()).chain([mouth]);
    let opens = |rim: Vec<usize>| {
        let sum: Vec3 = rim.iter().filter_map(|&index| normal(head, normals, index)).sum();
        Some((rim, sum.try_normalize(1e-6)?))
    };
    rims.filter_map(opens).collect()
}

/// The skin's normal at a landmark.
fn normal(head: &GenericHead, normals: &[Vec3], index: usize) -> Option<Vec3> {
    let anchor = head.anchors.get(index)?;
    mesh::at_barycentric(normals, &anchor.triangle, &anchor.weights).try_normalize(1e-12)
}

/// A frame from in front.
struct View<'a> {
    frame: &'a FeatureFrame<'a>,
    /// What its expression adds to each landmark, head frame.
    expression: &'a [Vec3],
}

/// Where the frames show a landmark, in the plane of a normal through its anchor.
fn observed(
    head: &GenericHead,
    positions: &[Vec3],
    normal: &Vec3,
    camera: &Camera,
    views: &[View<'_>],
    index: usize,
) -> Option<Feature> {
    let anchor = head.anchors.get(index).filter(|a| a.sigma.is_finite())?;
    let place = mesh::at_barycentric(positions, &anchor.triangle, &anchor.weights);
    let tangents = Matrix3x2::from_columns(&crate::fit::tangents(normal));
    let sights: Vec<Sight> = views.iter().filter_map(|v| sight(v, index, &place, normal)).collect();
    if sights.len() < LEAST_FRAMES {
        return None;
    }
    let slide = tangents * slide(camera, &sights, &place, &tangents)?;
    Some(Feature { triangle: anchor.triangle, weights: anchor.weights, target: place + slide, sigma: anchor.sigma })
}

/// One frame's view of one landmark.
struct Sight {
    cam_from_head: Transform,
    /// What the frame's expression adds, head frame.
    expression: Vec3,
    pixel: Vec2,
    sigma_px: f64,
    weight: f64,
}

fn sight(view: &View<'_>, index: usize, place: &Vec3, normal: &Vec3) -> Option<Sight> {
    let frame = view.frame;
    let (pixel, sigma_px) = (*frame.seen.landmarks.get(index)?, *frame.seen.sigma_px.get(index)?);
    let eye = frame.pose.inverse().translation;
    let facing = normal.dot(&(eye - place).normalize());
    let seen = sigma_px > 0.0 && facing > STEEPEST;
    seen.then(|| Sight {
        cam_from_head: frame.pose,
        expression: view.expression[index],
        pixel,
        sigma_px,
        weight: facing * facing,
    })
}

/// The slide along the tangents that agrees best with all frames: Gauss–Newton on robust reprojection errors.
fn slide(camera: &Camera, sights: &[Sight], place: &Vec3, tangents: &Matrix3x2<f64>) -> Option<Vec2> {
    let mut slide = Vec2::zeros();
    for _ in 0..STEPS {
        let (mut hessian, mut gradient) = (Matrix2::zeros(), Vec2::zeros());
        for sight in sights {
            let point = sight.cam_from_head.apply(&(place + sight.expression + tangents * slide));
            let (pixel, by) = camera.project_with_jacobian(&point)?;
            let residual = (pixel - sight.pixel) / sight.sigma_px;
            let (_, robust) = Loss::Huber(ROBUST_LIMIT).evaluate(residual.norm_squared());
            let by_point: Matrix2x3<f64> = by.point * sight.cam_from_head.rotation.matrix();
            let by_slide = by_point * tangents / sight.sigma_px;
            hessian += by_slide.transpose() * by_slide * (robust * sight.weight);
            gradient += by_slide.transpose() * residual * (robust * sight.weight);
        }
        slide -= hessian.try_inverse()? * gradient;
    }
    slide.iter().all(|x| x.is_finite()).then_some(slide)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::testing::{camera, observe, toy_head, turn as turning};

    /// A head whose features slid along the skin, and the expressionless frames that show it.
    fn slid(head: &GenericHead) -> (Vec<Vec3>, Vec<FrameObservation>) {
        let slide = |p: &Vec3| Vec3::new(0.002 * (40.0 * p.y).cos(), -0.003 * (30.0 * p.x).cos(), 0.0);
        let normals = mesh::vertex_normals(&head.positions, &head.triangles(head.skin()));
        let along = |(p, n): (&Vec3, &Vec3)| p + slide(p) - n * n.dot(&slide(p));
        let truth: Vec<Vec3> = head.positions.iter().zip(&normals).map(along).collect();
        let frames = turning(9).iter().enumerate().map(|(f, p)| observe(head, &truth, p, 0.3, 0.0, f as u64)).collect();
        (truth, frames)
    }

    fn frames<'a>(seen: &'a [FrameObservation], expression: &'a [f64]) -> Vec<FeatureFrame<'a>> {
        seen.iter().zip(turning(seen.len())).map(|(seen, pose)| FeatureFrame { seen, pose, expression }).collect()
    }

    /// Median distance of the features between two heads.
    fn apart(head: &GenericHead, a: &[Vec3], b: &[Vec3]) -> f64 {
        let (a, b) = (head.landmarks(a), head.landmarks(b));
        let mut distances: Vec<f64> = feature_landmarks().into_iter().map(|i| (a[i] - b[i]).norm()).collect();
        distances.sort_by(f64::total_cmp);
        distances[distances.len() / 2]
    }

    fn align(head: &GenericHead, seen: &[FeatureFrame]) -> Vec<Vec3> {
        // The toy's landmarks lie all over its face, far from one another.
        let options = FeatureOptions { reach: 0.05, ..FeatureOptions::default() };
        align_features(head, &head.positions, &camera(), seen, &options).unwrap()
    }

    #[test]
    fn features_slide_to_where_the_frames_show_them() {
        let mut head = toy_head();
        head.anchors.iter_mut().for_each(|a| a.sigma = 0.0005);
        let (truth, seen) = slid(&head);
        let aligned = align(&head, &frames(&seen, &[0.0; 3]));
        let (before, after) = (apart(&head, &head.positions, &truth), apart(&head, &aligned, &truth));
        assert!(after < 0.2 * before, "{before} {after}");
    }

    #[test]
    fn one_wrong_frame_and_an_expression_do_not_move_the_rest_shape() {
        let head = toy_head();
        let (truth, mut seen) = slid(&head);
        let usual = apart(&head, &align(&head, &frames(&seen, &[0.0; 3])), &truth);
        seen[4].landmarks.iter_mut().for_each(|p| *p += Vec2::new(12.0, 7.0));
        let wrong = apart(&head, &align(&head, &frames(&seen, &[0.0; 3])), &truth);
        assert!(wrong < 1.6 * usual, "{usual} {wrong}");
        let mut speaking = truth.clone();
        head.keys[0].offsets.iter().for_each(|(v, d)| speaking[*v as usize] += d * 0.7);
        let poses = turning(9);
        let seen: Vec<_> = poses.iter().map(|p| observe(&head, &speaking, p, 0.3, 0.0, 5)).collect();
        let known = apart(&head, &align(&head, &frames(&seen, &[0.7, 0.0, 0.0])), &truth);
        assert!(known < 1.6 * usual, "{usual} {known}");
    }

    #[test]
    fn lids_end_where_the_frames_show_their_rims() {
        let Some(head) = crate::testing::asset() else { return };
        let mut truth = head.positions.clone();
        for (name, part) in [("eyeBlinkLeft", 0.35), ("eyeBlinkRight", 0.2)] {
            let key = head.keys.iter().find(|key| key.name == name).unwrap();
            key.offsets.iter().for_each(|(v, d)| truth[*v as usize] += d * part);
        }
        let open = |of: &[Vec3], side: usize| {
            let pairs = head.lid_contacts[side].iter();
            1000.0 * pairs.map(|[a, b]| (of[*a as usize] - of[*b as usize]).norm()).fold(0.0, f64::max)
        };
        let seen: Vec<_> = turning(9).iter().map(|p| observe(&head, &truth, p, 0.3, 0.0, 7)).collect();
        let rest = vec![0.0; head.keys.len()];
        let options = FeatureOptions::default();
        let aligned = align_features(&head, &head.positions, &camera(), &frames(&seen, &rest), &options).unwrap();
        for side in [0, 1] {
            let [before, after, wanted] = [&head.positions, &aligned, &truth].map(|of| open(of, side));
            let left = (after - wanted).abs() / (before - wanted);
            // What remains is what landmarks that may be off by a millimetre leave open.
            assert!(before - wanted > 1.5 && left < 0.3, "{before} to {after} for {wanted} mm");
        }
    }

    #[test]
    fn a_head_seen_from_the_side_only_is_left_as_it_is() {
        let head = toy_head();
        let (_, seen) = slid(&head);
        let mut turned = frames(&seen, &[]);
        let side = nalgebra::Rotation3::new(Vec3::new(0.0, 1.2, 0.0));
        turned.iter_mut().for_each(|f| f.pose.rotation = side * f.pose.rotation);
        assert_eq!(align(&head, &turned), head.positions);
        assert_eq!(align(&head, &[]), head.positions);
    }
}
