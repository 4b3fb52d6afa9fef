//! Cameras, their places on the rig and the boards together by Levenberg–Marquardt, the boards eliminated one by one
//! (Schur complement). One camera is a rig of one.

use super::gram::{Gram, Shape};
use super::{BoardView, Model};
use geometry::least_squares::Loss;
use geometry::{Camera, Transform, Vec2, skew};
use nalgebra::{Cholesky, Const, DMatrix, DVector, Matrix6, Vector6};
use std::ops::Range;

/// Part of the cost that a step must promise for another one to be taken: 1e-7 of it moves nothing by a hundredth of its
/// standard deviation.
const RELATIVE_COST: f64 = 1e-7;
/// As [`RELATIVE_COST`] while the corners' standard deviation is not yet known.
const ROUGH_COST: f64 = 1e-3;
/// Change of the corners' standard deviation, parts of it, that moves nothing else.
const SIGMA_CHANGE: f64 = 0.01;
/// A standard deviation is not estimated below this, pixels: perfect data would divide by zero.
pub(super) const MIN_SIGMA: f64 = 1e-6;
/// The median of the distance from the origin of a normal distribution in the plane, in standard deviations.
const RAYLEIGH_MEDIAN: f64 = 1.177_41;
/// Relative to the diagonal. The closed form starts near; a larger one slows the way along the flattest directions.
const FIRST_DAMPING: f64 = 1e-7;
const MAX_ITERATIONS: usize = 60;
const MAX_ROUNDS: usize = 8;

/// How a residual counts.
#[derive(Clone, Copy)]
pub(super) struct Weighting {
    pub(super) loss: Loss,
    pub(super) inverse_sigma: f64,
}

impl Weighting {
    /// The loss of a squared distance in pixels, and the root of its weight.
    #[inline]
    pub(super) fn of(self, squared: f64) -> (f64, f64) {
        let (loss, weight) = self.loss.evaluate(squared * self.inverse_sigma * self.inverse_sigma);
        (loss, weight.sqrt() * self.inverse_sigma)
    }
}

/// One picture of the board.
#[derive(Clone, Copy)]
pub(super) struct Sight<'a> {
    pub(super) camera: usize,
    pub(super) moment: usize,
    pub(super) view: &'a BoardView,
}

/// The data and what is to be found.
pub(super) struct Problem<'a> {
    pub(super) sights: Vec<Sight<'a>>,
    pub(super) model: Model,
    /// On distances divided by the camera's standard deviation.
    pub(super) loss: Loss,
    /// Standard deviation of a corner along one axis, pixels, of each camera.
    pub(super) sigmas: Vec<f64>,
}

/// Everything that is found.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub(super) cameras: Vec<Camera>,
    /// `camera_from_rig` of each camera; the first one's is the identity and stays it.
    pub(super) mounts: Vec<Transform>,
    /// `rig_from_board` of each moment.
    pub(super) boards: Vec<Transform>,
    pub(super) shape: Shape,
}

impl State {
    pub(super) fn pose(&self, sight: &Sight) -> Transform {
        let board = self.boards[sight.moment];
        if sight.camera == 0 { board } else { self.mounts[sight.camera] * board }
    }
}

/// What [`Problem::solve`] found.
pub(super) struct Solution {
    pub(super) state: State,
    pub(super) converged: bool,
}

impl Problem<'_> {
    /// The best state from a start, the corners' standard deviations being estimated on the way, because the loss needs
    /// them; `None` where a point of the start has no pixel.
    pub(super) fn solve(&mut self, start: State) -> Option<Solution> {
        self.sigmas = self.robust_sigmas(&start);
        let mut solution = Solution { state: start, converged: false };
        for round in 0..MAX_ROUNDS {
            let settled = self.loss == Loss::Squared || round > 0;
            solution = self.minimise(solution.state, if settled { RELATIVE_COST } else { ROUGH_COST })?;
            let sigmas = self.robust_sigmas(&solution.state);
            let before = std::mem::replace(&mut self.sigmas, sigmas);
            let still = |(a, b): (&f64, &f64)| (a - b).abs() <= SIGMA_CHANGE * b;
            if settled && (self.loss == Loss::Squared || before.iter().zip(&self.sigmas).all(still)) {
                break;
            }
        }
        Some(solution)
    }

    /// Levenberg–Marquardt with Nielsen's damping.
    fn minimise(&self, mut state: State, tolerance: f64) -> Option<Solution> {
        let mut grams = self.grams(&state)?;
        let moments = 0..state.boards.len();
        let mut normal = self.normal(&state, &grams, moments.clone());
        let (mut damping, mut growth, mut converged) = (FIRST_DAMPING, 2.0, false);
        for _ in 0..MAX_ITERATIONS {
            let cost = total(&grams);
            let Some(step) = normal.reduce(damping).and_then(|reduced| reduced.step(&normal, damping)) else { break };
            let next = self.moved(&state, &step);
            // The last step is the most exact one: it is still taken.
            converged = step.promised <= tolerance * cost.max(1.0);
            let Some(better) = self.grams(&next).filter(|grams| total(grams) <= cost) else {
                if converged || damping > 1e12 {
                    break;
                }
                damping *= growth;
                growth *= 2.0;
                continue;
            };
            let ratio = (cost - total(&better)) / step.promised.max(f64::MIN_POSITIVE);
            (state, grams) = (next, better);
            if converged {
                break;
            }
            normal = self.normal(&state, &grams, moments.clone());
            damping = (damping * (1.0 - (2.0 * ratio - 1.0).powi(3)).max(0.1)).max(1e-14);
            growth = 2.0;
        }
        Some(Solution { state, converged })
    }

    /// The same with the board's bend free.
    pub(super) fn with_bend(&self) -> Self {
        let model = Model { bend: true, ..self.model };
        Self { sights: self.sights.clone(), model, loss: self.loss, sigmas: self.sigmas.clone() }
    }

    /// The normal equations of each picture; `None` where a corner has no pixel.
    pub(super) fn grams(&self, state: &State) -> Option<Vec<Gram>> {
        let of = |sight: &Sight| {
            let weighting = Weighting { loss: self.loss, inverse_sigma: 1.0 / self.sigmas[sight.camera] };
            let seen = (&state.cameras[sight.camera], &state.pose(sight), &state.shape);
            Gram::of((&sight.view.points, &sight.view.pixels), seen, &self.model, weighting)
        };
        self.sights.iter().map(of).collect()
    }

    /// Corners less where a state puts them, pixels; `None` where it puts one nowhere.
    pub(super) fn residuals(&self, sight: &Sight, state: &State) -> Option<Vec<Vec2>> {
        let (camera, pose) = (&state.cameras[sight.camera], state.pose(sight));
        let each = sight.view.points.iter().zip(&sight.view.pixels);
        each.map(|(point, pixel)| {
            let place = camera.project(&pose.apply(&point.push(state.shape.height(point))))?;
            Some(pixel - place)
        })
        .collect()
    }

    /// Standard deviation of a corner along one axis by the median distance, for each camera.
    fn robust_sigmas(&self, state: &State) -> Vec<f64> {
        let data: usize = self.sights.iter().map(|s| 2 * s.view.pixels.len()).sum();
        let unknowns = self.layout().unknowns() + 6 * state.boards.len();
        // Fitted residuals are smaller than the errors by the unknowns' share of the data.
        let fitted = data as f64 / data.saturating_sub(unknowns).max(1) as f64;
        let of_camera = |camera: usize| {
            let own = self.sights.iter().filter(|s| s.camera == camera);
            let mut all: Vec<f64> = own.filter_map(|s| self.residuals(s, state)).flatten().map(|r| r.norm()).collect();
            let middle = all.len() / 2;
            let median = if all.is_empty() { 0.0 } else { *all.select_nth_unstable_by(middle, f64::total_cmp).1 };
            (median / RAYLEIGH_MEDIAN * fitted.sqrt()).max(MIN_SIGMA)
        };
        (0..state.cameras.len()).map(of_camera).collect()
    }

    pub(super) fn layout(&self) -> Layout {
        Layout { lens: self.model.free(), bend: if self.model.bend { 3 } else { 0 }, cameras: self.sigmas.len() }
    }

    /// The normal equations of the pictures of some moments, of which `grams` holds each picture's.
    pub(super) fn normal(&self, state: &State, grams: &[Gram], moments: Range<usize>) -> Normal {
        let layout = self.layout();
        let mut normal = Normal::zeros(layout.unknowns(), moments.clone());
        for (sight, gram) in self.sights.iter().zip(grams).filter(|(s, _)| moments.contains(&s.moment)) {
            normal.add(sight, gram, state, &layout);
        }
        normal
    }

    /// A state after a step.
    pub(super) fn moved(&self, state: &State, step: &Step) -> State {
        let (layout, mut next) = (self.layout(), state.clone());
        for (c, camera) in next.cameras.iter_mut().enumerate() {
            let mut numbers = camera.intrinsics();
            for (k, &column) in layout.lens.iter().enumerate() {
                numbers[column] += step.shared[layout.lens_at(c) + k];
            }
            numbers[1] = if self.model.square_pixels { numbers[0] } else { numbers[1] };
            *camera = camera.with_intrinsics(numbers);
        }
        for (c, mount) in next.mounts.iter_mut().enumerate().skip(1) {
            *mount = mount.retract(&step.shared.fixed_rows::<6>(layout.mount_at(c)).into_owned());
        }
        for (k, bend) in next.shape.bend.iter_mut().enumerate().take(layout.bend) {
            *bend += step.shared[layout.bend_at() + k];
        }
        for (board, own) in next.boards.iter_mut().zip(&step.boards).filter(|(_, own)| **own != Vector6::zeros()) {
            *board = board.retract(own);
        }
        next
    }
}

/// Where the unknowns that all boards share are: for each camera its lens, then but for the first its mount; then the bend.
pub(super) struct Layout {
    /// Free columns of the lens.
    pub(super) lens: Vec<usize>,
    pub(super) bend: usize,
    pub(super) cameras: usize,
}

impl Layout {
    pub(super) fn unknowns(&self) -> usize {
        self.bend_at() + self.bend
    }

    pub(super) fn lens_at(&self, camera: usize) -> usize {
        camera * (self.lens.len() + 6) - if camera == 0 { 0 } else { 6 }
    }

    pub(super) fn mount_at(&self, camera: usize) -> usize {
        self.lens_at(camera) + self.lens.len()
    }

    pub(super) fn bend_at(&self) -> usize {
        self.lens_at(self.cameras)
    }
}

/// Normal equations: of the shared unknowns, and of each board.
pub(super) struct Normal {
    hessian: DMatrix<f64>,
    gradient: DVector<f64>,
    moments: Range<usize>,
    /// Of each of these moments.
    boards: Vec<BoardBlock>,
}

/// One board's pose (`v`), and its products with each shared unknown (`w`).
struct BoardBlock {
    seen: bool,
    v: Matrix6<f64>,
    w: Vec<Vector6<f64>>,
    gradient: Vector6<f64>,
}

impl Normal {
    fn zeros(unknowns: usize, moments: Range<usize>) -> Self {
        let board = |_| BoardBlock {
            seen: false,
            v: Matrix6::zeros(),
            w: vec![Vector6::zeros(); unknowns],
            gradient: Vector6::zeros(),
        };
        Self {
            hessian: DMatrix::zeros(unknowns, unknowns),
            gradient: DVector::zeros(unknowns),
            boards: moments.clone().map(board).collect(),
            moments,
        }
    }

    /// Adds one picture. Its pose is `mount · board`, whose small motions follow from those of both.
    fn add(&mut self, sight: &Sight, gram: &Gram, state: &State, layout: &Layout) {
        let first = layout.lens_at(sight.camera);
        let lens = layout.lens.iter().enumerate().map(|(k, &column)| (first + k, column));
        let columns: Vec<(usize, usize)> =
            lens.chain((0..layout.bend).map(|k| (layout.bend_at() + k, 9 + k))).collect();
        let board = &mut self.boards[sight.moment - self.moments.start];
        board.seen = true;
        for &(i, a) in &columns {
            self.gradient[i] += gram.gradient(a);
            for &(j, b) in &columns {
                self.hessian[(i, j)] += gram.at(a, b);
            }
        }
        let (v, gradient) = (gram.pose(), gram.pose_gradient());
        if sight.camera == 0 {
            board.v += v;
            board.gradient += gradient;
            columns.iter().for_each(|&(i, a)| board.w[i] += gram.by_pose(a));
            return;
        }
        let (by_mount, by_board) = chain(&state.mounts[sight.camera], &state.boards[sight.moment]);
        let (at, mount_v) = (layout.mount_at(sight.camera), by_mount.tr_mul(&v));
        board.v += by_board.tr_mul(&v) * by_board;
        board.gradient += by_board.tr_mul(&gradient);
        let own = by_mount.tr_mul(&gradient);
        let (both, mixed) = (mount_v * by_mount, mount_v * by_board);
        for k in 0..6 {
            self.gradient[at + k] += own[k];
            board.w[at + k] += mixed.row(k).transpose();
            (0..6).for_each(|l| self.hessian[(at + k, at + l)] += both[(k, l)]);
        }
        for &(i, a) in &columns {
            let w = gram.by_pose(a);
            board.w[i] += by_board.tr_mul(&w);
            let with_mount = by_mount.tr_mul(&w);
            for k in 0..6 {
                self.hessian[(at + k, i)] += with_mount[k];
                self.hessian[(i, at + k)] += with_mount[k];
            }
        }
    }

    /// The equations of the shared unknowns alone, `None` where a board's pose is not determined.
    pub(super) fn reduce(&self, damping: f64) -> Option<Reduced> {
        let (mut hessian, mut gradient) = (self.hessian.clone(), self.gradient.clone());
        let mut factors = Vec::with_capacity(self.boards.len());
        let mut halves = vec![Vector6::zeros(); gradient.len()];
        for board in &self.boards {
            if !board.seen {
                factors.push(None);
                continue;
            }
            let factor = damped(board.v, damping).cholesky()?;
            let l = factor.l_dirty();
            let half = |v: &Vector6<f64>| l.solve_lower_triangular(v);
            let own = half(&board.gradient)?;
            for (half_of, w) in halves.iter_mut().zip(&board.w) {
                *half_of = half(w)?;
            }
            for (j, b) in halves.iter().enumerate() {
                gradient[j] -= b.dot(&own);
                for (i, a) in halves.iter().enumerate().skip(j) {
                    hessian[(i, j)] -= a.dot(b);
                }
            }
            factors.push(Some(factor));
        }
        hessian.fill_upper_triangle_with_lower_triangle();
        Some(Reduced { hessian, gradient, factors })
    }
}

/// The equations of the shared unknowns, and what brings the boards back.
pub(super) struct Reduced {
    pub(super) hessian: DMatrix<f64>,
    pub(super) gradient: DVector<f64>,
    factors: Vec<Option<Cholesky<f64, Const<6>>>>,
}

/// A step of all unknowns.
pub(super) struct Step {
    pub(super) shared: DVector<f64>,
    pub(super) boards: Vec<Vector6<f64>>,
    /// By how much the cost falls if it is quadratic.
    pub(super) promised: f64,
}

impl Reduced {
    /// Marquardt's step: each diagonal is raised by its `damping`-th part.
    fn step(&self, normal: &Normal, damping: f64) -> Option<Step> {
        let mut hessian = self.hessian.clone();
        for k in 0..hessian.nrows() {
            hessian[(k, k)] += damping * normal.hessian[(k, k)];
        }
        let shared = -hessian.cholesky()?.solve(&self.gradient);
        let boards = self.boards(normal, &shared);
        // With (H + λD) δ = -g the quadratic falls by -gᵀδ + λ δᵀ D δ.
        let falls = |gradient: f64, diagonal: f64, step: f64| step * (damping * diagonal * step - gradient);
        let of_shared = (0..shared.len()).map(|k| falls(normal.gradient[k], normal.hessian[(k, k)], shared[k]));
        let of_board = |(block, own): (&BoardBlock, &Vector6<f64>)| -> f64 {
            (0..6).map(|k| falls(block.gradient[k], block.v[(k, k)], own[k])).sum()
        };
        let promised = of_shared.sum::<f64>() + normal.boards.iter().zip(&boards).map(of_board).sum::<f64>();
        Some(Step { shared, boards, promised })
    }

    /// The best steps of the boards of its moments for a step of the shared unknowns.
    pub(super) fn boards(&self, normal: &Normal, shared: &DVector<f64>) -> Vec<Vector6<f64>> {
        let of = |(block, factor): (&BoardBlock, &Option<Cholesky<f64, Const<6>>>)| {
            let Some(factor) = factor else { return Vector6::zeros() };
            let moved = block.w.iter().zip(shared.iter()).fold(block.gradient, |sum, (w, s)| sum + w * *s);
            -factor.solve(&moved)
        };
        normal.boards.iter().zip(&self.factors).map(of).collect()
    }
}

/// How the small motions of `mount · board` follow from those of `mount` and of `board`, as in [`Transform::retract`].
fn chain(mount: &Transform, board: &Transform) -> (Matrix6<f64>, Matrix6<f64>) {
    let (mut by_mount, mut by_board) = (Matrix6::identity(), Matrix6::zeros());
    by_mount.fixed_view_mut::<3, 3>(3, 0).copy_from(&-skew(&(mount.rotation * board.translation)));
    by_board.fixed_view_mut::<3, 3>(0, 0).copy_from(mount.rotation.matrix());
    by_board.fixed_view_mut::<3, 3>(3, 3).copy_from(mount.rotation.matrix());
    (by_mount, by_board)
}

fn total(grams: &[Gram]) -> f64 {
    grams.iter().map(|g| g.cost).sum()
}

fn damped(mut matrix: Matrix6<f64>, damping: f64) -> Matrix6<f64> {
    for k in 0..6 {
        matrix[(k, k)] *= 1.0 + damping;
    }
    matrix
}

/// The middle of what all pictures show of a board, metres.
pub(super) fn middle<'a>(views: impl Iterator<Item = &'a BoardView>) -> Vec2 {
    let bound = |(low, high): (Vec2, Vec2), p: &Vec2| (low.inf(p), high.sup(p));
    let none = (Vec2::repeat(f64::INFINITY), Vec2::repeat(f64::NEG_INFINITY));
    let (low, high) = views.flat_map(|v| &v.points).fold(none, bound);
    (low + high) / 2.0
}
