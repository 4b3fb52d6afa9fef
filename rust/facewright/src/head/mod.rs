//! The person's head: its shape, step by step in the order of [`crate::reconstruct()`].
//!
//! - [`shape`]: from a motion's points and the landmarks, by the class of heads and a free deformation; [`paper`] is the paper's way
//!   to the same.
//! - [`rest`]: the shape as filmed at rest and whole: [`unseen`] is what no frame measured, [`features`] are lips, lids and brows where the
//!   frames show them.
//! - [`dense`]: the skin measured densely, where the frames allow it.
//! - [`eyes`]: lips closed, eyeballs fitted; [`paper_eyes`]: the paper's eyes instead.

pub mod dense;
pub mod eyes;
pub mod features;
pub mod paper;
pub mod regions;
pub mod rest;
pub mod shape;
pub mod unseen;

use crate::faces::{Chosen, Clip, KnownFrame, KnownHead};
use ::head::GenericHead;
use geometry::face_mesh::IBUG68;
use geometry::{Camera, Transform, Vec3};

/// A head with its shape measured, and where it is in every frame.
pub struct Measured {
    /// The camera, refined where it was not calibrated.
    pub camera: Camera,
    /// All vertices at rest, head frame, metres.
    pub positions: Vec<Vec3>,
    /// Each frame of the clip.
    pub frames: Vec<MeasuredFrame>,
    /// The frames from which shape and texture are taken.
    pub chosen: Chosen,
    /// Points that it was measured by, head frame, metres.
    pub points: Vec<Vec3>,
    /// Coefficients of the face class.
    pub coefficients: Vec<f64>,
    /// Part of the points' observations that one motion of the head explains, 0…1; 0 where none were tracked.
    pub agreement: f64,
    /// Median distance of the points from the surface, metres.
    pub points_median: f64,
    /// Standard deviation of the focal length, pixels; `None` for a calibrated camera.
    pub focal_sigma_px: Option<f64>,
    /// What the artist should know.
    pub warnings: Vec<String>,
}

/// How well the skin was measured, for each vertex of the head.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceTruth {
    /// Standard deviation along the normal, metres; NaN where nothing was measured.
    pub sigma: Vec<f64>,
    /// Frames that took part; 0 where nothing was measured.
    pub views: Vec<u16>,
    /// Root mean square difference of the frames from their mean, parts of the grey level; NaN where nothing was measured.
    pub residual: Vec<f64>,
}

/// Where a measured head is in one frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct MeasuredFrame {
    /// `cam_from_head`.
    pub pose: Option<Transform>,
    /// Root mean square distance of its observations from the model, pixels.
    pub rms_px: Option<f64>,
    /// Whether the pose rests on landmarks alone.
    pub by_landmarks: bool,
}

impl Measured {
    /// The head as a tracker may know it, with the expressions that the landmarks gave.
    pub fn known(&self, clip: &Clip) -> KnownHead {
        let frame = |(measured, known): (&MeasuredFrame, &Option<KnownFrame>)| {
            let (cam_from_head, known) = measured.pose.zip(known.as_ref())?;
            Some(KnownFrame { cam_from_head, expression: known.expression.clone() })
        };
        let frames = self.frames.iter().zip(&clip.known.frames).map(frame).collect();
        KnownHead { camera: self.camera, positions: self.positions.clone(), frames }
    }

    /// The frames that shape and texture are taken from, with their poses.
    pub fn chosen_poses(&self) -> Vec<(usize, Transform)> {
        self.chosen.frames.iter().filter_map(|&frame| Some((frame, self.frames[frame].pose?))).collect()
    }
}

/// The iBUG landmarks, head frame, metres.
pub fn landmarks68(head: &GenericHead, positions: &[Vec3]) -> Vec<Vec3> {
    let all = head.landmarks(positions);
    IBUG68.iter().map(|&i| all[i]).collect()
}
