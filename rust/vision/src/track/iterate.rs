//! Gauss–Newton at one level, from a pose to where the patch fits best.

use super::Update;
use super::lanes::{Kernel, Vectors};
use super::measure::{Measure, Sums};
use super::patch::{AFFINE, Patch, SHIFT, Stats};
use super::region::{Region, Sight};
use super::solve::{CONTRAST, Fit, Pose, Solver, plausible};
use super::window::{Weights, Window};
use crate::pyramid::{Interpolation, Level};
use geometry::Vec2;
use nalgebra::Matrix2;

/// Least part of a step that is taken.
const SLOWEST: f64 = 0.25;
/// Two steps that undo each other within this end the paper's iteration half way between, pixels.
const UNDONE_PX: f64 = 0.01;

/// When and how to step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plan {
    pub update: Update,
    pub interpolation: Interpolation,
    pub max_steps: usize,
    /// A shorter step is the last, pixels.
    pub enough: f64,
    /// Halve steps that turn back.
    pub damped: bool,
    pub gain_bias: bool,
    /// A point that goes further is lost, pixels.
    pub reach: f64,
}

/// Where stepping ended.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rest {
    /// How far a pixel of the window moved in the last step.
    pub last: f64,
    /// The fit before the last step; only of plans with gain and bias.
    pub fit: Fit,
}

/// A patch being looked for.
pub(super) struct Search<'s, const STRIPS: usize> {
    pub level: &'s Level,
    pub window: Window,
    pub weights: &'s Weights<STRIPS>,
    pub patch: &'s Patch<STRIPS>,
    pub region: &'s mut Region,
}

impl<const STRIPS: usize> Search<'_, STRIPS> {
    #[inline(always)]
    fn measure<V: Vectors, const WARP: bool, const FULL: bool>(
        &mut self,
        v: V,
        pose: &Pose,
        interpolation: Interpolation,
    ) -> Sums {
        let side = self.window.side;
        let sight = Sight {
            centre: pose.position,
            warp: pose.warp,
            origin: self.window.half,
            columns: side,
            rows: side,
            span: STRIPS * super::lanes::LANES,
        };
        self.region.cover(self.level, &sight, interpolation, true);
        let task = Measure::<V, STRIPS, WARP, FULL> { vectors: v, patch: self.patch, window: self.window };
        self.region.read(v, &sight, interpolation, task)
    }
}

/// Steps until they are short; `None` when they lead too far, or no step can be made.
pub(super) struct Iterate<'s, const STRIPS: usize> {
    pub search: Search<'s, STRIPS>,
    pub pose: &'s mut Pose,
    pub solver: &'s Solver,
    pub plan: Plan,
}

impl<const STRIPS: usize> Kernel for Iterate<'_, STRIPS> {
    type Output = Option<Rest>;

    #[inline(always)]
    fn call<V: Vectors>(self, v: V) -> Option<Rest> {
        let Self { search, pose, solver, plan } = self;
        let (patch, total) = (search.patch, search.weights.total);
        let stepping = Stepping { solver, plan, stats: &patch.stats, total, half: search.window.half as f64 };
        match (solver, plan.gain_bias) {
            (Solver::Shift { .. }, false) => stepping.run::<V, _, false, false>(v, pose, search),
            (Solver::Shift { .. }, true) => stepping.run::<V, _, false, true>(v, pose, search),
            (Solver::Affine { .. }, _) => stepping.run::<V, _, true, true>(v, pose, search),
        }
    }
}

impl<V: Vectors, const STRIPS: usize, const WARP: bool, const FULL: bool> Look<V, WARP, FULL> for Search<'_, STRIPS> {
    #[inline(always)]
    fn look(&mut self, v: V, pose: &Pose, interpolation: Interpolation) -> Sums {
        self.measure::<V, WARP, FULL>(v, pose, interpolation)
    }
}

/// Compares a patch with a picture at a pose.
pub(super) trait Look<V, const WARP: bool, const FULL: bool> {
    fn look(&mut self, v: V, pose: &Pose, interpolation: Interpolation) -> Sums;
}

/// How a patch is stepped to where it fits.
pub(super) struct Stepping<'s> {
    pub solver: &'s Solver,
    pub plan: Plan,
    pub stats: &'s Stats,
    /// Σ of the window's weights.
    pub total: f64,
    /// Half the window.
    pub half: f64,
}

impl Stepping<'_> {
    #[inline(always)]
    pub fn run<V: Vectors, L: Look<V, WARP, FULL>, const WARP: bool, const FULL: bool>(
        self,
        v: V,
        at: &mut Pose,
        mut picture: L,
    ) -> Option<Rest> {
        let Self { solver, plan, stats, total, half } = self;
        let mut pose = *at;
        let (start, mut before, mut rate) = (pose.position, Vec2::zeros(), 1.0_f64);
        let mut rest = Rest { last: f64::INFINITY, fit: Fit { gain: 1.0, variance: 0.0, ncc: 0.0 } };
        let mut last = Sums::default();
        for _ in 0..plan.max_steps {
            let sums = picture.look(v, &pose, plan.interpolation);
            let gain = sums.gain(stats, plan.gain_bias).clamp(*CONTRAST.start(), *CONTRAST.end());
            let products = sums.products(stats, total, plan.gain_bias, gain, if WARP { AFFINE } else { SHIFT });
            let (shift, stretch) = solver.solve(&products, &pose.warp, half);
            step::<WARP>(&mut pose, plan.update, &(shift * rate), &(stretch * rate))?;
            rest.last = shift.norm() + if WARP { 0.5 * half * stretch.norm() } else { 0.0 };
            if !(pose.position - start).norm_squared().le(&(plan.reach * plan.reach))
                || (WARP && !plausible(&pose.warp))
            {
                return None;
            }
            if FULL {
                last = sums;
            }
            if rest.last < plan.enough {
                break;
            }
            if plan.damped {
                // Slopes of the finest texture come out too small and steps too long: halve them when they turn back.
                if before.dot(&shift) < 0.0 {
                    rate = (0.5 * rate).max(SLOWEST);
                }
            } else if (before + shift).amax() < UNDONE_PX {
                pose.position += pose.warp * shift * 0.5;
                break;
            }
            before = shift;
        }
        if FULL {
            rest.fit = Fit::new(&last, stats, total, plan.gain_bias);
        }
        *at = pose;
        Some(rest)
    }
}

/// Moves a pose by a shift and a stretch of the template's frame.
#[inline(always)]
fn step<const WARP: bool>(pose: &mut Pose, update: Update, shift: &Vec2, stretch: &Matrix2<f64>) -> Option<()> {
    if !WARP {
        pose.position -= pose.warp * shift;
    } else if update == Update::ForwardAdditive {
        pose.position -= pose.warp * shift;
        pose.warp -= pose.warp * stretch;
    } else {
        pose.warp *= (Matrix2::identity() + stretch).try_inverse()?;
        pose.position -= pose.warp * shift;
    }
    Some(())
}

/// Measures the fit where a patch is.
pub(super) struct Judge<'s, const STRIPS: usize> {
    pub search: Search<'s, STRIPS>,
    pub pose: &'s Pose,
    pub interpolation: Interpolation,
    pub gain_bias: bool,
}

impl<const STRIPS: usize> Kernel for Judge<'_, STRIPS> {
    type Output = Fit;

    #[inline(always)]
    fn call<V: Vectors>(mut self, v: V) -> Fit {
        let sums = self.search.measure::<V, false, true>(v, self.pose, self.interpolation);
        Fit::new(&sums, &self.search.patch.stats, self.search.weights.total, self.gain_bias)
    }
}
