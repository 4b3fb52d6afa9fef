//! From landmarks of many frames, and points measured on the skin, to the person's head.
//!
//! # Entry points
//! - [`fit_landmarks`]: shape, poses and expressions from the landmarks of all frames.
//! - [`fit_cloud`]: the shape again, now that points on the skin and better poses are known.
//!
//! # Model
//! `landmark = mean + class · identity + keys · (shared + frame's expression) + slip`. The class is a wide prior, not a
//! statement about people. The net's errors are no independent noise: the part that is the same in all frames is a slip
//! shared by all frames (`slip`), the part that changes with the view makes frames of like view repeat each other.
//! A still camera and a turning head leave the size open: it comes from [`HeadSize`] alone, after the fit.

mod bundle;
mod cloud;
mod contour;
mod equations;
mod frame;
mod landmarks;
mod model;
mod pose;
mod size;
mod slip;
#[cfg(test)]
pub(crate) mod testing;

pub use cloud::{CloudFrame, CloudPoint, HeadFit, fit_cloud};
pub use landmarks::fit_landmarks;
pub(crate) use model::tangents;
pub use size::{HeadSize, eye_centres};

use geometry::{Camera, Transform, Vec2, Vec3};

/// What was seen of the face in one frame.
#[derive(Clone, Debug, Default)]
pub struct FrameObservation {
    /// The net's landmarks, pixels of the distorted picture, in the order of the head's anchors.
    pub landmarks: Vec<Vec2>,
    /// Standard deviation of the net's jitter for each landmark, pixels; 0 or infinite where it was not seen.
    pub sigma_px: Vec<f64>,
    /// `cam_from_head` from elsewhere; estimated when absent.
    pub initial_pose: Option<Transform>,
    /// Mean diameter of the irises, pixels, where it was measured.
    pub iris_diameter_px: Option<f64>,
}

/// How to fit.
#[derive(Clone, Debug)]
pub struct FitOptions {
    /// Standard deviation of the identity coefficients. Above 1: people vary more than the artists' class.
    pub identity_sigma: f64,
    /// Standard deviation of the expression keys' shared part, which serves as shape.
    pub shared_expression_sigma: f64,
    /// How far points may move those from what the landmarks say ([`fit_cloud`]): wider, and brows, lids and lips are bent to what the
    /// class of heads lacks elsewhere.
    pub cloud_expression_sigma: f64,
    /// Size of a single frame's expression that is still ordinary.
    pub expression_sigma: f64,
    /// Factor on the anchors' standard deviations.
    pub slip_scale: f64,
    /// Part of the slips' variance that neighbouring landmarks have in common, 0…1.
    pub slip_common: f64,
    /// Correlation length of the slips, metres.
    pub slip_length: f64,
    /// The net's error that changes with the view, metres on the face.
    pub view_error: f64,
    /// Angle between face and camera, radians, where that error has doubled; frames turned farther do not shape the head.
    pub largest_turn: f64,
    /// Views closer than about this share that error, radians.
    pub view_correlation: f64,
    /// The net's error across the jaw's contour, metres; infinite leaves the contour out.
    pub contour_error: f64,
    /// Residuals beyond this many standard deviations count linearly only.
    pub robust_limit: f64,
    /// Relative standard deviation of the focal length: 0 for a calibrated camera, .05–.1 for one from EXIF.
    pub focal_sigma: f64,
    /// What fixes the scale.
    pub size: HeadSize,
    /// At most this many frames, of views as different as possible, determine the shape; all get a pose.
    pub key_frames: usize,
    /// Times that visibility, contours and feet are found anew.
    pub rounds: usize,
    /// What the linear model cannot reach on the face, metres ([`fit_cloud`]).
    pub misfit: f64,
    /// How fast that grows with the distance from the nearest landmark: hair, collars, ears.
    pub misfit_growth: f64,
    /// Cloud points farther off than this are not skin, metres.
    pub reach: f64,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self {
            identity_sigma: 1.8,
            shared_expression_sigma: 0.3,
            cloud_expression_sigma: 0.1,
            expression_sigma: 0.1,
            slip_scale: 1.0,
            slip_common: 0.7,
            slip_length: 0.02,
            view_error: 0.0012,
            largest_turn: 33.0_f64.to_radians(),
            view_correlation: 8.0_f64.to_radians(),
            contour_error: 0.003,
            robust_limit: 2.5,
            focal_sigma: 0.0,
            size: HeadSize::default(),
            key_frames: 24,
            rounds: 3,
            misfit: 0.0005,
            misfit_growth: 0.05,
            reach: 0.015,
        }
    }
}

/// One frame of a [`LandmarkFit`].
#[derive(Clone, Debug)]
pub struct FittedFrame {
    /// `cam_from_head`.
    pub pose: Transform,
    /// What the frame's expression adds to [`LandmarkFit::shared_expression`]: a weight for each of the head's keys.
    pub expression: Vec<f64>,
    /// Root mean square error of its landmarks, pixels.
    pub rms_px: f64,
    /// Whether the net can be believed in it: turned less than [`FitOptions::largest_turn`], no unusual error.
    pub trusted: bool,
}

/// The head that landmarks alone give.
#[derive(Clone, Debug)]
pub struct LandmarkFit {
    /// The camera, its focal length refined when that was asked for.
    pub camera: Camera,
    /// Coefficients of the identity class.
    pub coefficients: Vec<f64>,
    /// What all frames share of the expression keys, part of the shape as filmed.
    pub shared_expression: Vec<f64>,
    /// Each frame; `None` where too few landmarks were seen.
    pub frames: Vec<Option<FittedFrame>>,
    /// Metres of the result per metre of the class.
    pub scale: f64,
    /// All vertices, head frame, metres.
    pub positions: Vec<Vec3>,
    /// How far each landmark lies from its anchor on [`Self::positions`], along the skin, metres; zero for the outline.
    pub slips: Vec<Vec3>,
    /// Median error of each landmark over the frames, pixels; not a number for the outline and what was never seen.
    pub landmark_errors_px: Vec<f64>,
}

impl LandmarkFit {
    /// Root mean square of [`FittedFrame::rms_px`] over the frames.
    pub fn rms_px(&self) -> f64 {
        let squares: Vec<f64> = self.frames.iter().flatten().map(|f| f.rms_px * f.rms_px).collect();
        (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
    }
}
