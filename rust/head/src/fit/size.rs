//! How large the head is: pictures of a turning head do not tell.

use super::FrameObservation;
use crate::{GenericHead, HeadError, part};
use geometry::{Camera, Transform, Vec3};

/// Mean interpupillary distance of adults and its relative standard deviation (Dodgson 2004), metres.
const PUPIL_DISTANCE: (f64, f64) = (0.063, 0.057);
/// Mean visible diameter of adults' irises and its relative standard deviation (Rüfer et al. 2005), with that of measuring it.
const IRIS_DIAMETER: (f64, f64) = (0.0117, 0.05);

/// What fixes the scale of the head.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum HeadSize {
    /// The average interpupillary distance and, where it was measured, iris diameter, each within its spread over people.
    #[default]
    Usual,
    /// The person's own interpupillary distance, metres.
    Pupils(f64),
    /// A length measured between two of the 468 landmarks, metres.
    Landmarks {
        /// Their indices.
        indices: [usize; 2],
        /// The distance.
        metres: f64,
    },
    /// The cloud's unit is the metre ([`super::fit_cloud`]); as usual where there is no cloud.
    Cloud,
}

/// Midpoints of the eyeballs, left and right.
pub fn eye_centres(head: &GenericHead, positions: &[Vec3]) -> Option<[Vec3; 2]> {
    let centre = |name| {
        let vertices = &positions[head.part(name)?.vertices.clone()];
        (!vertices.is_empty()).then(|| vertices.iter().sum::<Vec3>() / vertices.len() as f64)
    };
    Some([centre(part::EYE_LEFT)?, centre(part::EYE_RIGHT)?])
}

/// The factor that gives a head (in any unit) and its poses the right size.
pub(crate) fn scale(
    head: &GenericHead,
    positions: &[Vec3],
    camera: &Camera,
    frames: &[(&FrameObservation, Transform)],
    size: &HeadSize,
) -> Result<f64, HeadError> {
    let eyes = eye_centres(head, positions).ok_or(HeadError::NoSize)?;
    let distance = (eyes[0] - eyes[1]).norm();
    let (wanted, present) = match size {
        HeadSize::Pupils(metres) => (*metres, distance),
        HeadSize::Landmarks { indices, metres } => {
            let landmarks = head.landmarks(positions);
            let place = |i: usize| landmarks.get(i).copied().ok_or(HeadError::NoSize);
            (*metres, (place(indices[0])? - place(indices[1])?).norm())
        }
        HeadSize::Usual | HeadSize::Cloud => (usual(distance, iris_diameter(&eyes, camera, frames)), 1.0),
    };
    let factor = wanted / present;
    if factor.is_finite() && factor > 0.0 { Ok(factor) } else { Err(HeadError::NoSize) }
}

/// Weighted mean of the logarithms of what pupils and irises say.
fn usual(pupil_distance: f64, iris: Option<f64>) -> f64 {
    let mut evidence = vec![((PUPIL_DISTANCE.0 / pupil_distance).ln(), PUPIL_DISTANCE.1)];
    evidence.extend(iris.map(|d| ((IRIS_DIAMETER.0 / d).ln(), IRIS_DIAMETER.1)));
    let total: f64 = evidence.iter().map(|(_, sigma)| sigma.powi(-2)).sum();
    (evidence.iter().map(|(log, sigma)| log * sigma.powi(-2)).sum::<f64>() / total).exp()
}

/// Frames turned by more than this show the iris foreshortened, cosine.
const IN_FRONT: f64 = 0.94;

/// Median diameter of the irises in the head's own unit, over frames from in front where there are any.
fn iris_diameter(eyes: &[Vec3; 2], camera: &Camera, frames: &[(&FrameObservation, Transform)]) -> Option<f64> {
    let middle = (eyes[0] + eyes[1]) / 2.0;
    let diameter = |(seen, pose): &(&FrameObservation, Transform)| {
        Some(seen.iris_diameter_px.filter(|d| *d > 0.0)? * pose.apply(&middle).z / camera.fx)
    };
    let in_front = |(_, pose): &&(&FrameObservation, Transform)| -(pose.rotation * Vec3::z()).z > IN_FRONT;
    let mut found: Vec<f64> = frames.iter().filter(in_front).filter_map(diameter).collect();
    if found.is_empty() {
        found = frames.iter().filter_map(diameter).collect();
    }
    found.sort_by(f64::total_cmp);
    (!found.is_empty()).then(|| found[found.len() / 2])
}
