//! Which numbers a patch is taken and looked for in: whole ones where it is only shifted and all pixels count alike,
//! else floating point ones.

use super::iterate::{Iterate, Judge, Plan, Rest, Search};
use super::lanes::dispatch;
use super::patch::{Patch, Stats, Taking, Unpacking};
use super::region::Region;
use super::solve::{Fit, Pose, Solver};
use super::tracker::{Source, Tracker};
use super::whole::{IterateWhole, JudgeWhole, TakingWhole, WholePatch};
use super::{Model, TrackOptions};
use crate::pyramid::{Interpolation, Level};
use geometry::Vec2;
use nalgebra::Matrix2;

/// After a shorter last step the fit before it still holds, pixels.
const SAME_FIT_PX: f64 = 0.02;

/// Buffers that a thread uses for one point after another.
#[derive(Default)]
pub(super) struct Scratch<const STRIPS: usize> {
    pub patch: Box<Patch<STRIPS>>,
    pub whole: Box<WholePatch>,
    /// Which of the two patches is looked for.
    in_whole: bool,
    /// Pixels that templates are taken from.
    source: Region,
    /// Pixels that are searched.
    sought: Region,
    /// Pixels at the frame's edge.
    copy: Vec<i16>,
}

impl<const STRIPS: usize> Scratch<STRIPS> {
    /// What is known of the patch that was taken last.
    pub fn stats(&self) -> &Stats {
        if self.in_whole { &self.whole.stats } else { &self.patch.stats }
    }

    /// Another level or picture is searched next.
    pub fn forget(&mut self) {
        self.sought.clear();
    }
}

/// Whether patches that are not warped are taken in whole numbers.
pub(super) fn is_whole(options: &TrackOptions) -> bool {
    options.model == Model::Translation
        && options.interpolation == Interpolation::Bilinear
        && options.window_sigma.is_none()
        && !options.gain_bias
}

impl<const STRIPS: usize> Tracker<'_, STRIPS> {
    /// Takes a patch that will be looked for along a warp, by an interpolation and for the affine model or not.
    pub fn take(
        &self,
        source: &Source,
        level: usize,
        warp: &Matrix2<f64>,
        (interpolation, affine): (Interpolation, bool),
        scratch: &mut Scratch<STRIPS>,
    ) {
        let plain = source.grid == Matrix2::identity();
        scratch.in_whole = is_whole(self.options) && plain && *warp == Matrix2::identity();
        let kept = source.kept.zip(self.kept).filter(|_| plain && scratch.in_whole == is_whole(self.options));
        if let Some((index, kept)) = kept {
            let (packed, stats) = kept.get(index, level);
            return self.unpack(packed, stats, scratch);
        }
        let (level, at) = (&source.picture.levels()[level], source.at / f64::from(1_u32 << level));
        if scratch.in_whole {
            self.take_whole(level, at, scratch);
        } else {
            self.take_fresh(level, at, source.grid, (interpolation, affine), scratch);
        }
    }

    /// A patch that was kept, in the numbers of the options.
    fn unpack(&self, packed: &[i16], stats: &Stats, scratch: &mut Scratch<STRIPS>) {
        if scratch.in_whole {
            return scratch.whole.unpack(packed, stats);
        }
        let patch = &mut scratch.patch;
        patch.stats.clone_from(stats);
        dispatch(Unpacking { packed, window: self.window, weights: &self.weights, patch });
    }

    /// Takes a patch in whole numbers.
    pub fn take_whole(&self, level: &Level, centre: Vec2, scratch: &mut Scratch<STRIPS>) {
        let Scratch { whole, copy, .. } = scratch;
        dispatch(TakingWhole { level, centre, window: self.window, copy, patch: whole });
    }

    /// Takes a patch along a grid in floating point numbers.
    pub fn take_fresh(
        &self,
        level: &Level,
        centre: Vec2,
        grid: Matrix2<f64>,
        (interpolation, affine): (Interpolation, bool),
        scratch: &mut Scratch<STRIPS>,
    ) {
        dispatch(Taking {
            level,
            centre,
            grid,
            interpolation,
            window: self.window,
            weights: &self.weights,
            affine,
            gain_bias: self.options.gain_bias,
            region: &mut scratch.source,
            patch: &mut scratch.patch,
        });
    }

    /// Steps the patch that was taken to where it fits.
    pub fn iterate(
        &self,
        level: &Level,
        pose: &mut Pose,
        solver: &Solver,
        plan: Plan,
        scratch: &mut Scratch<STRIPS>,
    ) -> Option<Rest> {
        if scratch.in_whole {
            let Scratch { whole: patch, copy, .. } = scratch;
            return dispatch(IterateWhole { level, window: self.window, patch, copy, pose, solver, plan });
        }
        let search = self.search(level, scratch);
        dispatch(Iterate { search, pose, solver, plan })
    }

    /// The fit at the pose where stepping came to rest.
    pub fn fit(
        &self,
        level: &Level,
        pose: &Pose,
        rest: &Rest,
        interpolation: Interpolation,
        scratch: &mut Scratch<STRIPS>,
    ) -> Fit {
        if scratch.in_whole {
            let Scratch { whole: patch, copy, .. } = scratch;
            return dispatch(JudgeWhole { level, window: self.window, patch, copy, position: pose.position });
        }
        if self.options.gain_bias && rest.last < SAME_FIT_PX {
            return rest.fit;
        }
        let search = self.search(level, scratch);
        dispatch(Judge { search, pose, interpolation, gain_bias: self.options.gain_bias })
    }

    fn search<'s>(&'s self, level: &'s Level, scratch: &'s mut Scratch<STRIPS>) -> Search<'s, STRIPS> {
        let Scratch { patch, sought, .. } = scratch;
        Search { level, window: self.window, weights: &self.weights, patch, region: sought }
    }
}
