//! One point from the coarsest level to the finest, and back to check.

use super::arithmetic::Scratch;
use super::iterate::{Plan, Rest};
use super::solve::{CONTRAST, Fit, Pose, SLOPE_NOISE, Solver, deviation, plausible};
use super::templates::Kept;
use super::window::{Weights, Window};
use super::{Guess, Model, Status, Track, TrackOptions, Update};
use crate::pyramid::{Interpolation, Level, Pyramid};
use geometry::Vec2;
use nalgebra::Matrix2;

/// A last step longer than this at the finest level means that the point has not settled, pixels.
const SETTLED_PX: f64 = 0.1;
/// Levels and models that others follow need no more, pixels of the level.
const ROUGH_PX: f64 = 0.05;
/// Last steps at the finest level that read the picture with the interpolation of the options.
const LAST_STEPS: usize = 2;
/// Where nothing says how far a point may go, pixels of a level.
const FAR_PX: f64 = 64.0;
/// The correlation may still rise by this from the last coarse level, and from the shift alone, to the end.
const RISE: [f64; 2] = [0.5, 0.3];
/// A guess that stretches a patch by less than this is not worth another template.
const STRETCH: f64 = 1.1;

/// Where a template comes from: the patch of `picture` around `at`, along `grid`, unless it was kept.
#[derive(Clone, Copy)]
pub(super) struct Source<'s> {
    pub picture: &'s Pyramid,
    pub at: Vec2,
    pub grid: Matrix2<f64>,
    pub kept: Option<usize>,
}

/// Tracks points of `a`.
pub(super) struct Tracker<'t, const STRIPS: usize> {
    pub options: &'t TrackOptions,
    pub window: Window,
    pub weights: Weights<STRIPS>,
    pub a: &'t Pyramid,
    pub kept: Option<&'t Kept>,
}

impl<'t, const STRIPS: usize> Tracker<'t, STRIPS> {
    pub fn new(a: &'t Pyramid, options: &'t TrackOptions, kept: Option<&'t Kept>) -> Self {
        let window = Window::new(options.window);
        let weights = Weights::new(window, options.window_sigma);
        Self { options, window, weights, a, kept }
    }

    /// Forward, and back if asked for.
    pub fn track(&self, b: &Pyramid, index: usize, point: Vec2, guess: Guess, scratch: &mut Scratch<STRIPS>) -> Track {
        let kept = self.kept.map(|_| index);
        let source = Source { picture: self.a, at: point, grid: Matrix2::identity(), kept };
        let mut track = self.forward(&source, b, &guess, scratch);
        if let (Status::Found, Some(limit)) = (track.status, self.options.forward_backward_px)
            && !self.back(&source, b, &guess, &track, scratch).is_some_and(|back| (back - point).norm() <= limit)
        {
            track.status = Status::Inconsistent;
        }
        track
    }

    fn forward(&self, source: &Source, b: &Pyramid, guess: &Guess, scratch: &mut Scratch<STRIPS>) -> Track {
        let mut track = Track {
            position: guess.position,
            warp: guess.warp,
            residual: f64::INFINITY,
            ncc: 0.0,
            sigma_px: f64::INFINITY,
            status: Status::OutOfFrame,
        };
        let margin = self.margin(1.0);
        if !source.picture.finest().contains(&source.at, margin) || !b.finest().contains(&guess.position, 0.0) {
            return track;
        }
        if !plausible(&guess.warp) {
            track.status = Status::NotConverged;
            return track;
        }
        let grid = self.grid(&guess.warp);
        let mut pose = Pose { position: guess.position, warp: guess.warp };
        track.status = match self.coarse_levels(source, b, &mut pose, scratch) {
            Ok(()) => {
                pose.warp *= grid;
                let status = self.finest(&Source { grid, ..*source }, b, &mut pose, &mut track, scratch);
                pose.warp *= grid.try_inverse().unwrap_or_else(Matrix2::identity);
                status.map_or_else(|status| status, |()| Status::Found)
            }
            Err(status) => status,
        };
        (track.position, track.warp) = (pose.position, pose.warp);
        if !b.finest().contains(&pose.position, margin) {
            track.status = Status::OutOfFrame;
        }
        if track.status == Status::OutOfFrame || track.status == Status::NotConverged {
            (track.residual, track.sigma_px) = (f64::INFINITY, f64::INFINITY);
        }
        track
    }

    /// Where the found patch is in `a`. The way back begins as ignorant as the way there: with the guess's displacement
    /// undone, not from the answer.
    fn back(
        &self,
        source: &Source,
        b: &Pyramid,
        guess: &Guess,
        track: &Track,
        scratch: &mut Scratch<STRIPS>,
    ) -> Option<Vec2> {
        // The patch is read as it was found, so that only a shift is left to be sought.
        let found = Source { picture: b, at: track.position, grid: track.warp, kept: None };
        let mut pose = Pose { position: track.position - (guess.position - source.at), warp: Matrix2::identity() };
        if !source.picture.finest().contains(&pose.position, 0.0) {
            return None;
        }
        self.coarse_levels(&found, source.picture, &mut pose, scratch).ok()?;
        let grid = self.grid(&guess.warp);
        pose.warp = grid;
        let found = Source { grid: track.warp * grid, ..found };
        self.take(&found, 0, &pose.warp, (self.options.interpolation, false), scratch);
        let solver = Solver::shift(scratch.stats(), self.weights.total, self.least_slope())?;
        scratch.forget();
        let start = pose.position;
        let plan = Plan { enough: ROUGH_PX, ..self.plan() };
        let rest = self.iterate(source.picture.finest(), &mut pose, &solver, plan, scratch)?;
        self.settled(&rest, &start, &pose).then_some(pose.position)
    }

    /// From the frame of the window to that of the patch in `a`: the finer of the two pictures sets the size of the
    /// window, so that a patch that is stretched does not cover more of a curved surface than it must.
    fn grid(&self, warp: &Matrix2<f64>) -> Matrix2<f64> {
        let squares = warp.transpose() * warp;
        let (mean, half) = (squares.trace() / 2.0, (squares.m11 - squares.m22) / 2.0);
        let root = (half * half + squares.m12 * squares.m12).sqrt();
        if !self.options.match_scale || mean + root < STRETCH * STRETCH {
            return Matrix2::identity();
        }
        // Shrinks along the directions that are stretched: a function of the symmetric matrix, by its eigenvalues.
        let shrink = |square: f64| if square > 1.0 { 1.0 / square.sqrt() } else { 1.0 };
        let (low, high) = (shrink(mean - root), shrink(mean + root));
        let slope = if root > 1e-9 { (high - low) / (2.0 * root) } else { 0.0 };
        squares * slope + Matrix2::identity() * (high - slope * (mean + root))
    }

    fn coarse_levels(
        &self,
        source: &Source,
        to: &Pyramid,
        pose: &mut Pose,
        scratch: &mut Scratch<STRIPS>,
    ) -> Result<(), Status> {
        let levels = self.options.levels.min(source.picture.levels().len()).min(to.levels().len());
        for level in (1..levels).rev() {
            let fit = self.coarse(source, to, level, pose, scratch);
            if level == 1 && fit.is_some_and(|fit| self.hopeless(&fit, RISE[0])) {
                return Err(Status::Dissimilar);
            }
        }
        Ok(())
    }

    /// Shifts the pose at a coarse level; leaves it alone where that level has no texture or leads astray.
    fn coarse(
        &self,
        source: &Source,
        to: &Pyramid,
        level: usize,
        pose: &mut Pose,
        scratch: &mut Scratch<STRIPS>,
    ) -> Option<Fit> {
        let scale = f64::from(1_u32 << level);
        let (from, to) = (&source.picture.levels()[level], &to.levels()[level]);
        if !self.reaches(from, &(source.at / scale)) || !self.reaches(to, &(pose.position / scale)) {
            return None;
        }
        self.take(source, level, &pose.warp, (Interpolation::Bilinear, false), scratch);
        let solver = Solver::textured_shift(scratch.stats(), self.weights.total)?;
        let mut moved = Pose { position: pose.position / scale, ..*pose };
        let start = moved.position;
        scratch.forget();
        let plan = Plan { enough: ROUGH_PX, ..self.plan() };
        let rest = self.iterate(to, &mut moved, &solver, plan, scratch)?;
        if self.options.settle && (moved.position - start).norm() > self.window.side as f64 {
            return None;
        }
        pose.position = moved.position * scale;
        plan.gain_bias.then_some(rest.fit)
    }

    /// What must be within the frame on each side of a point, as part of half a window.
    fn margin(&self, part: f64) -> f64 {
        if self.options.settle { part * self.window.half as f64 } else { 0.0 }
    }

    /// Half a window beyond the frame is mostly the frame's edge repeated.
    pub fn reaches(&self, level: &Level, at: &Vec2) -> bool {
        level.contains(at, self.margin(0.5))
    }

    /// Shift, then warp, then the last careful steps; writes the quality of the fit.
    fn finest(
        &self,
        source: &Source,
        b: &Pyramid,
        pose: &mut Pose,
        track: &mut Track,
        scratch: &mut Scratch<STRIPS>,
    ) -> Result<(), Status> {
        let (options, level) = (self.options, b.finest());
        let affine = options.model == Model::Affine;
        self.take(source, 0, &pose.warp, (options.interpolation, affine), scratch);
        let (start, predicted, total) = (pose.position, pose.warp, self.weights.total);
        let mut solver = Solver::shift(scratch.stats(), total, self.least_slope()).ok_or(Status::LowTexture)?;
        scratch.forget();
        let careful = options.interpolation != Interpolation::Bilinear;
        let last_but_one = if affine || careful { ROUGH_PX.max(options.epsilon) } else { options.epsilon };
        let plan = Plan { enough: last_but_one, ..self.plan() };
        let mut rest = self.iterate(level, pose, &solver, plan, scratch).ok_or(Status::NotConverged)?;
        if affine {
            let fit = self.fit(level, pose, &rest, Interpolation::Bilinear, scratch);
            track.ncc = fit.ncc;
            if !CONTRAST.contains(&fit.gain) || self.hopeless(&fit, RISE[1]) {
                return Err(Status::Dissimilar);
            }
            let stats = scratch.stats();
            solver =
                Solver::affine(stats, self.window, &fit, options.warp_sigma, predicted).ok_or(Status::LowTexture)?;
            rest = self.iterate(level, pose, &solver, plan, scratch).ok_or(Status::NotConverged)?;
        }
        if careful {
            let interpolation = options.interpolation;
            let plan = Plan { interpolation, max_steps: LAST_STEPS, enough: 0.0, damped: true, ..plan };
            rest = self.iterate(level, pose, &solver, plan, scratch).ok_or(Status::NotConverged)?;
        }
        if !self.settled(&rest, &start, pose) {
            return Err(Status::NotConverged);
        }
        let fit = self.fit(level, pose, &rest, options.interpolation, scratch);
        (track.residual, track.ncc) = (fit.variance.sqrt(), fit.ncc);
        if !CONTRAST.contains(&fit.gain) {
            return Err(Status::Dissimilar);
        }
        track.sigma_px =
            deviation(&solver, &fit, pose, total, self.weights.effective, options.noise).ok_or(Status::LowTexture)?;
        let alike = options.max_residual.is_none_or(|limit| track.residual <= limit) && !self.hopeless(&fit, 0.0);
        if alike { Ok(()) } else { Err(Status::Dissimilar) }
    }

    /// Whether stepping came to rest within reach of where it began.
    fn settled(&self, rest: &Rest, start: &Vec2, pose: &Pose) -> bool {
        let near = (pose.position - start).norm() <= self.window.side as f64;
        !self.options.settle || (rest.last <= SETTLED_PX && near)
    }

    /// Whether the correlation stays below the limit even if it rises by so much.
    fn hopeless(&self, fit: &Fit, rise: f64) -> bool {
        self.options.min_ncc.is_some_and(|limit| fit.ncc + rise < limit)
    }

    /// Least eigenvalue of the gradient matrix, per pixel, noise included.
    fn least_slope(&self) -> f64 {
        self.options.min_texture + SLOPE_NOISE * self.options.noise.powi(2)
    }

    fn plan(&self) -> Plan {
        Plan {
            update: self.options.update,
            interpolation: Interpolation::Bilinear,
            max_steps: self.options.max_iterations,
            enough: self.options.epsilon,
            damped: self.options.update == Update::InverseCompositional,
            gain_bias: self.options.gain_bias,
            reach: if self.options.settle { 2.0 * self.window.side as f64 } else { FAR_PX },
        }
    }
}
