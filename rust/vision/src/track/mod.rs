//! Points found again in another frame: pyramidal Lucas–Kanade (paper, section 2.3, eq. 2–4).
//!
//! # Entry points
//! [`track()`] with [`TrackOptions`], or [`Templates`] to follow the patches of one frame through many.
//! [`TrackOptions::paper`] is the paper's tracker (shifts, plain differences),
//! [`TrackOptions::default`] compensates gain and bias, refines a local affine warp at the finest level and tracks
//! back to check.
//!
//! # Conventions
//! The template is always the patch of frame `a` around the point. A [`Guess`] says where the patch is expected in `b`
//! and how it is warped there, so that over a long turn the caller keeps `a` and predicts from the head's pose instead
//! of chaining frame to frame, which drifts. Levels are tracked from the coarsest to the finest,
//! `g^{l−1} = 2 (g^l + d^l)`.
//!
//! When position and warp are predicted within a pixel or two (a head's pose), small windows win, because the skin is
//! curved: 9 pixels with `window_sigma` 0.5 and `warp_sigma` 0.05.
//!
//! Patches that are only shifted, all pixels alike and without gain and bias, as the paper's are, are taken and looked for
//! in whole numbers; all others in floating point. Every operation is rounded by itself and sums are made in a fixed
//! order: results depend neither on the number of threads nor on the instruction set.
//!
//! # Source
//! Lucas and Kanade 1981; Shi and Tomasi 1994; Bouguet, "Pyramidal implementation of the Lucas Kanade feature tracker",
//! 2000; Baker and Matthews, "Lucas–Kanade 20 years on", 2004.

mod arithmetic;
mod iterate;
mod lanes;
mod measure;
mod patch;
mod region;
mod solve;
mod templates;
mod tracker;
mod whole;
mod window;
mod words;

use crate::pyramid::{Interpolation, Pyramid};
use geometry::Vec2;
use nalgebra::Matrix2;
pub use templates::Templates;

/// Why nothing could be tracked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TrackError {
    /// The window is even, or outside 3 … 31.
    #[error("the tracking window is {0} pixels: choose an odd number from 3 to 31")]
    Window(usize),
    /// The Gaussian of the window has no width.
    #[error("the standard deviation of the window's weights is {0}: choose a positive number, or none at all")]
    WindowSigma(f64),
    /// Not one guess per point.
    #[error("there are {guesses} guesses for {points} points: give one for each, or none at all")]
    Guesses {
        /// Number of guesses.
        guesses: usize,
        /// Number of points.
        points: usize,
    },
}

/// How a patch may change from frame to frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Model {
    /// It is shifted (beyond the warp of its guess).
    Translation,
    /// It is also stretched, sheared and turned; refined at the finest level only.
    #[default]
    Affine,
}

/// How a step changes the pose of a patch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Update {
    /// Steps are added up, as Lucas and Kanade do and the paper after Bouguet; slopes are the template's.
    ForwardAdditive,
    /// Steps are undone in the template's frame before the pose is applied (Baker and Matthews).
    #[default]
    InverseCompositional,
}

/// How to track.
#[derive(Clone, Debug)]
pub struct TrackOptions {
    /// Side of the window, pixels at every level; odd, 3 … 31. About a tenth of a face's width: 11 suits 352×288.
    pub window: usize,
    /// Standard deviation of the Gaussian that weighs the window's pixels, in halves of the window; all alike without.
    pub window_sigma: Option<f64>,
    /// Pyramid levels used; 1 with a good guess, 3 or 4 without.
    pub levels: usize,
    /// Steps at most, per level and model.
    pub max_iterations: usize,
    /// A shorter step ends the last iteration, pixels; those before it end a little earlier.
    pub epsilon: f64,
    /// How a patch may change.
    pub model: Model,
    /// How steps change the pose.
    pub update: Update,
    /// Where the guess stretches the patch, give the window its size in `b`, not in `a`.
    pub match_scale: bool,
    /// How far the entries of the affine warp may be from the guess, one standard deviation.
    pub warp_sigma: f64,
    /// Compensate a change of contrast and brightness of each patch.
    pub gain_bias: bool,
    /// How the template and the last steps at the finest level read between pixels.
    pub interpolation: Interpolation,
    /// Least texture beyond noise: smaller eigenvalue of the gradient matrix, squared grey levels per pixel.
    pub min_texture: f64,
    /// Standard deviation of the sensor's noise, grey levels: the slopes it makes are not texture.
    pub noise: f64,
    /// Refuse a point that does not come to rest, moves further than the window's side at a level, or whose window is
    /// not wholly within the frame; else it is enough that the point itself is.
    pub settle: bool,
    /// Track the found point back, and refuse it if it comes back further than this from where it began, pixels.
    pub forward_backward_px: Option<f64>,
    /// Refuse a point whose patches differ by more than this, root mean square grey levels.
    pub max_residual: Option<f64>,
    /// Refuse a point whose patches correlate less than this, −1 … 1; what cannot reach it any more is given up early.
    pub min_ncc: Option<f64>,
}

impl Default for TrackOptions {
    fn default() -> Self {
        Self {
            window: 11,
            window_sigma: None,
            levels: 4,
            max_iterations: 20,
            epsilon: 0.01,
            model: Model::Affine,
            update: Update::InverseCompositional,
            match_scale: true,
            warp_sigma: 0.1,
            gain_bias: true,
            interpolation: Interpolation::Bicubic,
            min_texture: 0.5,
            noise: 2.0,
            settle: true,
            forward_backward_px: Some(0.5),
            max_residual: None,
            min_ncc: None,
        }
    }
}

impl TrackOptions {
    /// The paper's tracker: shifts, plain differences, 7×7 pixels unless said otherwise, no check.
    pub fn paper(window: usize) -> Self {
        Self {
            window,
            max_iterations: 30,
            model: Model::Translation,
            update: Update::ForwardAdditive,
            match_scale: false,
            gain_bias: false,
            interpolation: Interpolation::Bilinear,
            min_texture: 0.0,
            noise: 0.0,
            settle: false,
            forward_backward_px: None,
            ..Self::default()
        }
    }
}

/// Where a point is expected in frame `b`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guess {
    /// Expected position, pixels of `b`.
    pub position: Vec2,
    /// Expected local warp: a step `x` beside the point in `a` is the step `warp · x` in `b`.
    pub warp: Matrix2<f64>,
}

impl Guess {
    /// Expected at a position, with its surroundings unchanged.
    pub fn at(position: Vec2) -> Self {
        Self { position, warp: Matrix2::identity() }
    }
}

/// What became of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Found, and every check passed.
    Found,
    /// Its window, or the place it moved to, is not wholly within the frame.
    OutOfFrame,
    /// Its surroundings have no texture, or texture along one direction only, or none that stands out of the noise.
    LowTexture,
    /// The steps did not come to rest, or led too far away.
    NotConverged,
    /// What was found looks different: contrast or residual is beyond the limits.
    Dissimilar,
    /// Tracked back it does not return to where it began.
    Inconsistent,
}

/// A point in frame `b`. Unless `status` is [`Status::Found`] the numbers are the last ones known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Track {
    /// Position in `b`, pixels.
    pub position: Vec2,
    /// Local warp from `a` to `b`, as in [`Guess::warp`].
    pub warp: Matrix2<f64>,
    /// Root mean square difference of the patches after gain and bias, grey levels of `b`.
    pub residual: f64,
    /// Normalised correlation of the patches, −1 … 1; zero when they were not compared.
    pub ncc: f64,
    /// One standard deviation of the position along an axis, pixels; infinite when it was not found.
    pub sigma_px: f64,
    /// What became of the point.
    pub status: Status,
}

/// Tracks points of `a` into `b`, in parallel; the result does not depend on the number of threads.
///
/// Without `guesses` every point is expected where it was. Positions are pixels of the finest level.
pub fn track(
    a: &Pyramid,
    b: &Pyramid,
    points: &[Vec2],
    guesses: Option<&[Guess]>,
    options: &TrackOptions,
) -> Result<Vec<Track>, TrackError> {
    templates::run(a, b, points, guesses, options, None)
}

#[cfg(test)]
mod tests;
