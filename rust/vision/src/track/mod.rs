//! Points found again in another frame: pyramidal Lucas–Kanade (paper, section 2.3, eq. 2–4).
//!
//! # Entry points
//! [`track`] with [`TrackOptions`]: [`TrackOptions::paper`] is the paper's tracker (shifts, plain differences),
//! [`TrackOptions::default`] compensates gain and bias, refines a local affine warp at the finest level and tracks
//! back to check.
//!
//! # Conventions
//! The template is always the patch of frame `a` around the point. A [`Guess`] says where the patch is expected in `b`
//! and how it is warped there, so that over a long turn the caller keeps `a` and predicts from the head's pose instead
//! of chaining frame to frame, which drifts. Levels are tracked from the coarsest to the finest,
//! `g^{l−1} = 2 (g^l + d^l)`.
//!
//! # Source
//! Lucas and Kanade 1981; Shi and Tomasi 1994; Bouguet, "Pyramidal implementation of the Lucas Kanade feature tracker",
//! 2000; Baker and Matthews, "Lucas–Kanade 20 years on", 2004.

mod align;
mod sampler;
mod template;

use crate::pyramid::{Interpolation, Pyramid};
use align::{Fit, Pose, SLOPE_NOISE, Scratch, Solver, Step, deviation, plausible};
use geometry::Vec2;
use nalgebra::Matrix2;
use rayon::prelude::*;
use sampler::Window;

/// A last step longer than this at the finest level means that the point has not settled, pixels.
const SETTLED_PX: f64 = 0.1;
/// Levels and models that others follow need no more, pixels of the level.
const ROUGH_PX: f64 = 0.05;
/// Least part of a step that is taken.
const SLOWEST: f64 = 0.25;
/// Last steps at the finest level that read the picture with the interpolation of the options.
const LAST_STEPS: usize = 2;
/// Fewer points than this are not worth a thread.
const POINTS_PER_TASK: usize = 16;

/// Why nothing could be tracked.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TrackError {
    /// The window is even, or outside 3 … 31.
    #[error("the tracking window is {0} pixels: choose an odd number from 3 to 31")]
    Window(usize),
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

/// How to track.
#[derive(Clone, Debug)]
pub struct TrackOptions {
    /// Side of the window, pixels at every level; odd, 3 … 31. About a tenth of a face's width: 11 suits 352×288.
    pub window: usize,
    /// Pyramid levels used; 1 with a good guess, 3 or 4 without.
    pub levels: usize,
    /// Steps at most, per level and model.
    pub max_iterations: usize,
    /// A shorter step ends the last iteration, pixels; those before it end a little earlier.
    pub epsilon: f64,
    /// How a patch may change.
    pub model: Model,
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
    /// Track the found point back, and refuse it if it comes back further than this from where it began, pixels.
    pub forward_backward_px: Option<f64>,
    /// Refuse a point whose patches differ by more than this, root mean square grey levels.
    pub max_residual: Option<f64>,
}

impl Default for TrackOptions {
    fn default() -> Self {
        Self {
            window: 11,
            levels: 4,
            max_iterations: 20,
            epsilon: 0.01,
            model: Model::Affine,
            warp_sigma: 0.1,
            gain_bias: true,
            interpolation: Interpolation::Bicubic,
            min_texture: 0.5,
            noise: 2.0,
            forward_backward_px: Some(0.5),
            max_residual: None,
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
            gain_bias: false,
            interpolation: Interpolation::Bilinear,
            min_texture: 0.0,
            noise: 0.0,
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
    if !(3..=31).contains(&options.window) || options.window.is_multiple_of(2) {
        return Err(TrackError::Window(options.window));
    }
    if let Some(guesses) = guesses
        && guesses.len() != points.len()
    {
        return Err(TrackError::Guesses { guesses: guesses.len(), points: points.len() });
    }
    let tracker = Tracker { options, window: Window::new(options.window) };
    let one = |scratch: &mut Scratch, i: usize| {
        let guess = guesses.map_or_else(|| Guess::at(points[i]), |guesses| guesses[i]);
        tracker.checked(a, b, points[i], guess, scratch)
    };
    let indices = (0..points.len()).into_par_iter().with_min_len(POINTS_PER_TASK);
    Ok(indices.map_init(Scratch::default, one).collect())
}

struct Tracker<'o> {
    options: &'o TrackOptions,
    window: Window,
}

impl Tracker<'_> {
    /// Forward, and back if asked for.
    fn checked(&self, a: &Pyramid, b: &Pyramid, point: Vec2, guess: Guess, scratch: &mut Scratch) -> Track {
        let mut track = self.forward(a, b, point, guess, scratch);
        let (Status::Found, Some(limit)) = (track.status, self.options.forward_backward_px) else {
            return track;
        };
        // The way back begins as ignorant as the way there: with the guess's displacement undone, not from the answer.
        let back = guess.warp.try_inverse().map(|warp| {
            let expected = Guess { position: track.position - (guess.position - point), warp };
            self.forward(b, a, track.position, expected, scratch)
        });
        if !back.is_some_and(|back| back.status == Status::Found && (back.position - point).norm() <= limit) {
            track.status = Status::Inconsistent;
        }
        track
    }

    /// From the coarsest level to the finest.
    fn forward(&self, a: &Pyramid, b: &Pyramid, point: Vec2, guess: Guess, scratch: &mut Scratch) -> Track {
        let mut pose = Pose { position: guess.position, warp: guess.warp };
        let lost = |pose: &Pose, status| Track {
            position: pose.position,
            warp: pose.warp,
            residual: f64::INFINITY,
            sigma_px: f64::INFINITY,
            status,
        };
        let margin = self.window.half as f64;
        if !a.finest().contains(&point, margin) || !b.finest().contains(&guess.position, 0.0) {
            return lost(&pose, Status::OutOfFrame);
        }
        if !plausible(&guess.warp) {
            return lost(&pose, Status::NotConverged);
        }
        let levels = self.options.levels.min(a.levels().len()).min(b.levels().len());
        for level in (1..levels).rev() {
            self.coarse(a, b, level, &point, &mut pose, scratch);
        }
        match self.finest(a, b, &point, &mut pose, scratch) {
            Ok(_) if !b.finest().contains(&pose.position, margin) => lost(&pose, Status::OutOfFrame),
            Ok((residual, sigma_px)) => {
                let alike = self.options.max_residual.is_none_or(|limit| residual <= limit);
                let status = if alike { Status::Found } else { Status::Dissimilar };
                Track { position: pose.position, warp: pose.warp, residual, sigma_px, status }
            }
            Err(_) if !b.finest().contains(&pose.position, margin) => lost(&pose, Status::OutOfFrame),
            Err(status) => lost(&pose, status),
        }
    }

    /// Shifts the pose at a coarse level; leaves it alone where that level has no texture or leads astray.
    fn coarse(&self, a: &Pyramid, b: &Pyramid, level: usize, point: &Vec2, pose: &mut Pose, scratch: &mut Scratch) {
        let (scale, options) = (f64::from(1_u32 << level), self.options);
        // Half a window beyond the frame is mostly the frame's edge repeated.
        let within = |picture: &Pyramid, at: &Vec2| {
            picture.levels()[level].contains(&(at / scale), self.window.half as f64 / 2.0)
        };
        if !within(a, point) || !within(b, &pose.position) {
            return;
        }
        let (window, fast) = (self.window, Interpolation::Bilinear);
        scratch.template.take(&a.levels()[level], &(point / scale), window, fast, template::SHIFT, options.gain_bias);
        let mut moved = Pose { position: pose.position / scale, ..*pose };
        let start = moved.position;
        let Some(solver) = Solver::textured_shift(&scratch.template, window) else { return };
        scratch.region.clear();
        let settled = self.iterate(b, level, &mut moved, &solver, ROUGH_PX, scratch).is_some();
        if settled && (moved.position - start).norm() <= window.side as f64 {
            pose.position = moved.position * scale;
        }
    }

    /// Shift, then warp, then the last careful steps; gives the residual and the standard deviation.
    fn finest(
        &self,
        a: &Pyramid,
        b: &Pyramid,
        point: &Vec2,
        pose: &mut Pose,
        scratch: &mut Scratch,
    ) -> Result<(f64, f64), Status> {
        let (options, window, level) = (self.options, self.window, b.finest());
        let (gain_bias, careful) = (options.gain_bias, options.interpolation);
        let unknowns = if options.model == Model::Affine { template::AFFINE } else { template::SHIFT };
        scratch.template.take(a.finest(), point, window, careful, unknowns, gain_bias);
        let (start, predicted) = (pose.position, pose.warp);
        let mut solver = Solver::shift(&scratch.template, window, self.least_slope()).ok_or(Status::LowTexture)?;
        scratch.region.clear();
        let affine = options.model == Model::Affine;
        let enough = if affine { ROUGH_PX.max(options.epsilon) } else { options.epsilon };
        let mut last = self.iterate(b, 0, pose, &solver, enough, scratch).ok_or(Status::NotConverged)?;
        if affine {
            let fit = self.fit(b, pose, scratch, Interpolation::Bilinear)?;
            let template = &scratch.template;
            solver = Solver::affine(template, window, &fit, options.warp_sigma, predicted).ok_or(Status::LowTexture)?;
            last = self.iterate(b, 0, pose, &solver, options.epsilon, scratch).ok_or(Status::NotConverged)?;
        }
        if careful != Interpolation::Bilinear {
            for _ in 0..LAST_STEPS {
                let step = scratch.step(level, pose, window, careful, &solver, gain_bias, 1.0);
                last = step.ok_or(Status::NotConverged)?.length;
            }
        }
        if last > SETTLED_PX || (pose.position - start).norm() > window.side as f64 {
            return Err(Status::NotConverged);
        }
        let fit = self.fit(b, pose, scratch, careful)?;
        let sigma_px = deviation(&solver, &fit, pose, window, options.noise).ok_or(Status::LowTexture)?;
        Ok((fit.variance.sqrt(), sigma_px))
    }

    /// Least eigenvalue of the gradient matrix, per pixel, noise included.
    fn least_slope(&self) -> f64 {
        self.options.min_texture + SLOPE_NOISE * self.options.noise.powi(2)
    }

    fn fit(&self, b: &Pyramid, pose: &Pose, scratch: &mut Scratch, reading: Interpolation) -> Result<Fit, Status> {
        scratch.fit(b.finest(), pose, self.window, reading, self.options.gain_bias).ok_or(Status::Dissimilar)
    }

    /// Steps until they are short; the length of the last one, or `None` when the window's side is left behind.
    fn iterate(
        &self,
        b: &Pyramid,
        level: usize,
        pose: &mut Pose,
        solver: &Solver,
        enough: f64,
        scratch: &mut Scratch,
    ) -> Option<f64> {
        let (options, level, fast) = (self.options, &b.levels()[level], Interpolation::Bilinear);
        let (start, mut last, mut rate) = (pose.position, None::<Step>, 1.0_f64);
        for _ in 0..options.max_iterations {
            let step = scratch.step(level, pose, self.window, fast, solver, options.gain_bias, rate)?;
            // Slopes of the finest texture come out too small and steps too long: halve them when they turn back.
            if last.is_some_and(|last| last.shift.dot(&step.shift) < 0.0) {
                rate = (0.5 * rate).max(SLOWEST);
            }
            if (pose.position - start).norm() > 2.0 * self.window.side as f64 {
                return None;
            }
            let length = step.length;
            last = Some(step);
            if length < enough {
                break;
            }
        }
        Some(last.map_or(f64::INFINITY, |step| step.length))
    }
}

#[cfg(test)]
mod tests;
