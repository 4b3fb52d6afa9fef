//! The head that landmarks give, and where it is in every frame.

use super::Faces;
use geometry::face_mesh::LANDMARKS;
use geometry::{Camera, Transform, Vec2, Vec3};
use head::fit::{FrameObservation, LandmarkFit};
use vision::landmarks::Face;

/// Standard deviation of the landmarks' rotations about each axis, radians: their errors last for many frames.
pub(crate) const LANDMARK_SIGMA_RAD: f64 = 0.05;
/// Jitter of the landmark net in terms of the distance between the eyes.
const NET_JITTER: f64 = 0.012;

/// The head as it is known so far, and where it is in each frame.
#[derive(Clone, Debug)]
pub struct KnownHead {
    /// The camera.
    pub camera: Camera,
    /// All vertices at rest, head frame, metres.
    pub positions: Vec<Vec3>,
    /// Each frame; `None` where the head is not, or cannot be placed.
    pub frames: Vec<Option<KnownFrame>>,
}

/// The head in one frame.
#[derive(Clone, Debug)]
pub struct KnownFrame {
    /// Where it is.
    pub cam_from_head: Transform,
    /// Its expression: a weight for each of the generic head's keys.
    pub expression: Vec<f64>,
}

impl KnownHead {
    /// By the landmarks of the frames that were looked at.
    pub(super) fn by_landmarks(fit: &LandmarkFit) -> Self {
        let frame = |frame: &Option<head::fit::FittedFrame>| {
            frame.as_ref().map(|f| KnownFrame { cam_from_head: f.pose, expression: f.expression.clone() })
        };
        Self { camera: fit.camera, positions: fit.positions.clone(), frames: fit.frames.iter().map(frame).collect() }
    }

    /// Where the head is in a frame.
    pub fn pose(&self, frame: usize) -> Option<Transform> {
        self.frames[frame].as_ref().map(|known| known.cam_from_head)
    }
}

impl KnownFrame {
    /// A frame between two others, at a `share` of the way from one to the other.
    pub(super) fn between(a: &Self, b: &Self, share: f64) -> Self {
        let [from, to] = [a, b].map(|known| &known.cam_from_head);
        let rotation = from.rotation.try_slerp(&to.rotation, share, 1e-9).unwrap_or(from.rotation);
        let translation = from.translation.lerp(&to.translation, share);
        let mix = |(a, b): (&f64, &f64)| a * (1.0 - share) + b * share;
        Self {
            cam_from_head: Transform::new(rotation, translation),
            expression: a.expression.iter().zip(&b.expression).map(mix).collect(),
        }
    }
}

/// What the landmark fit is told of each frame.
pub(crate) fn landmarks_of(faces: &Faces) -> Vec<FrameObservation> {
    (0..faces.frames.len()).map(|frame| observation(faces.face(frame))).collect()
}

/// What the landmark fit is told of a frame.
pub(crate) fn observation(face: Option<&Face>) -> FrameObservation {
    let Some(face) = face else {
        let (landmarks, sigma_px) = (vec![Vec2::zeros(); LANDMARKS], vec![0.0; LANDMARKS]);
        return FrameObservation { landmarks, sigma_px, ..FrameObservation::default() };
    };
    let jitter = (NET_JITTER * face.eye_distance()).hypot(0.2);
    let visible = face.irises.iter().filter(|i| i.visible);
    // The eye that looks at the camera: the other one is foreshortened.
    let widest = visible.map(|i| 2.0 * i.radius).max_by(f64::total_cmp);
    FrameObservation {
        landmarks: face.points.iter().map(|p| p.xy()).collect::<Vec<Vec2>>(),
        sigma_px: vec![jitter; face.points.len()],
        initial_pose: None,
        iris_diameter_px: widest,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    #[test]
    fn halfway_between_two_frames_is_half_of_turn_shift_and_expression() {
        let frame = |turn: f64, x: f64, key: f64| KnownFrame {
            cam_from_head: Transform::new(Rotation3::new(Vec3::y() * turn), Vec3::new(x, 0.0, 0.6)),
            expression: vec![key],
        };
        let middle = KnownFrame::between(&frame(0.1, 0.0, 0.0), &frame(0.5, 0.02, 1.0), 0.5);
        let expected = frame(0.3, 0.01, 0.5);
        assert!(middle.cam_from_head.angle_to(&expected.cam_from_head) < 1e-9);
        assert!((middle.cam_from_head.translation - expected.cam_from_head.translation).norm() < 1e-12);
        assert_eq!(middle.expression, [0.5]);
    }
}
