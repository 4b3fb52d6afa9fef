//! The corners of a placed board, exactly: first roughly in a coarse level, then in the finest that tells more, along as much
//! of the edges as there is.

use super::lattice::{Cell, Lattice};
use super::level::{Level, finer};
use super::refine::{Corner, Effort, Fit, Guess, Shape};
use super::spread::{self, SquareCorner};
use super::{BoardCorner, BoardCorners, BoardOptions, arrange::Placement};
use geometry::{Board, Mat3, Pattern, Vec2, Vec3};
use rayon::prelude::*;

/// The first fit is made in the coarsest level whose squares are at least this wide, pixels.
const MIN_STEP: f64 = 18.0;
/// Standard deviation of the edges' blur that the first fit begins with, pixels.
const FIRST_BLUR: f64 = 0.7;
/// With a wider blur found, the first fit is made again.
const MAX_FIRST_BLUR: f64 = 1.0;
/// The last fit is made in the coarsest level with at least this blur: less would be undersampled, more only adds work.
const MIN_LAST_BLUR: f64 = 0.5;
/// Radius of the windows of the first and of the last fit, pixels of their levels.
const FIRST_RADIUS: f64 = 9.0;
const LAST_RADIUS: f64 = 44.0;
const FIRST: Effort = Effort { max_steps: 2, last_step: 0.3 };
const LAST: Effort = Effort { max_steps: 10, last_step: 0.15 };
/// Where both edges of a corner end, their directions matter to its place.
const EXACT: Effort = Effort { max_steps: 10, last_step: 0.01 };
/// Residual of a corner's fit relative to its contrast above which it is not a corner.
const MAX_RESIDUAL: f64 = 0.2;
/// Less than this part of a board's seen corners being clear, it is not measured.
const MIN_CLEAR: f64 = 0.75;
/// Corners to each side that tell how an edge bends.
const BEND_REACH: usize = 2;
/// One task fits so many corners.
const TASK: usize = 8;

/// Fits the corners of `placement`, roughly known in the last level. `None` where too many look like no corner.
pub(super) fn measure(
    levels: &[Level],
    placement: &Placement,
    board: &Board,
    options: &BoardOptions,
) -> Option<BoardCorners> {
    let mut grid = Grid { board, level: levels.len() - 1, positions: placement.positions.clone() };
    while grid.level > 0 && grid.smallest_step() < MIN_STEP {
        grid.refine_level();
    }
    let mut fitted = grid.fit(&levels[grid.level], FIRST_BLUR, FIRST_RADIUS, &FIRST, options);
    let mut blur = blur_of(&fitted);
    if blur > MAX_FIRST_BLUR {
        fitted = grid.fit(&levels[grid.level], blur, FIRST_RADIUS, &LAST, options);
        blur = blur_of(&fitted);
    }
    while grid.level > 0 && blur < 2.0 * MIN_LAST_BLUR {
        grid.refine_level();
        blur *= 2.0;
    }
    let level = &levels[grid.level];
    let last = match board.pattern {
        Pattern::Checkerboard => grid.fit(level, blur, LAST_RADIUS, &LAST, options),
        Pattern::Squares { .. } => grid.fit_squares(level, blur, options),
    };
    let clear: Vec<(usize, Corner)> = last.into_iter().enumerate().filter_map(|(k, c)| Some((k, c?))).collect();
    if (clear.len() as f64) < MIN_CLEAR * placement.seen() as f64 || clear.len() < options.min_corners {
        return None;
    }
    let scale = f64::from(1_u32 << grid.level);
    let corner = |&(index, c): &(usize, Corner)| BoardCorner {
        index,
        position: (0..grid.level).fold(c.position, |p, _| finer(p)),
        sigma_px: c.sigma * scale,
    };
    Some(BoardCorners {
        board: placement.board,
        corners: clear.iter().map(corner).collect(),
        oriented: placement.oriented,
        blur_px: median(clear.iter().map(|c| c.1.blur)) * scale,
        contrast: median(clear.iter().map(|c| c.1.contrast.abs())),
    })
}

/// Whether most of a lattice's corners look like corners: a texture's do not.
pub(super) fn is_board(level: &Level, lattice: &Lattice, board: &Board, options: &BoardOptions) -> bool {
    let guess = |(&cell, position): (&Cell, &Vec2)| {
        let local = lattice.predict(cell)?;
        let steps = match board.pattern {
            Pattern::Checkerboard => [local.u, local.v],
            // Inwards, as far as the window may reach to both sides.
            Pattern::Squares { gap } => {
                let inward = |k: i32| if k.rem_euclid(2) == 0 { gap.min(1.0) } else { -gap.min(1.0) };
                [local.u * inward(cell.0), local.v * inward(cell.1)]
            }
        };
        Some(Guess {
            shape: shape(board),
            position: *position,
            steps,
            angles: steps.map(|s| angle(&s)),
            curvatures: [0.0; 2],
            blur: FIRST_BLUR,
            radius: FIRST_RADIUS,
        })
    };
    let guesses: Vec<_> = lattice.cells.iter().map(guess).collect();
    let sound = run(level, &guesses, &LAST).iter().flatten().filter(|c| is_sound(c, board, options)).count();
    2 * sound > lattice.cells.len()
}

fn shape(board: &Board) -> Shape {
    match board.pattern {
        Pattern::Checkerboard => Shape::Crossing,
        Pattern::Squares { .. } => Shape::Square,
    }
}

fn run(level: &Level, guesses: &[Option<Guess>], effort: &Effort) -> Vec<Option<Corner>> {
    guesses.par_iter().with_min_len(TASK).map(|guess| Fit::new(level, guess.as_ref()?)?.run(effort)).collect()
}

fn blur_of(fitted: &[Option<Corner>]) -> f64 {
    median(fitted.iter().flatten().map(|c| c.blur))
}

fn is_sound(corner: &Corner, board: &Board, options: &BoardOptions) -> bool {
    let contrast = match board.pattern {
        Pattern::Checkerboard => corner.contrast.abs(),
        Pattern::Squares { .. } => -corner.contrast,
    };
    contrast >= options.min_contrast && corner.residual <= MAX_RESIDUAL * contrast
}

/// What is known of a board's corners, row by row, in one level; nothing where a corner is not seen.
struct Grid<'a> {
    board: &'a Board,
    level: usize,
    positions: Vec<Option<Vec2>>,
}

impl Grid<'_> {
    /// Goes to the next finer level.
    fn refine_level(&mut self) {
        self.positions.iter_mut().flatten().for_each(|p| *p = finer(*p));
        self.level -= 1;
    }

    /// Fits all corners from where they are now, and keeps those that look like corners.
    fn fit(
        &mut self,
        level: &Level,
        blur: f64,
        radius: f64,
        effort: &Effort,
        options: &BoardOptions,
    ) -> Vec<Option<Corner>> {
        let guesses: Vec<_> = (0..self.positions.len()).map(|k| self.guess(k, blur, radius)).collect();
        let mut fitted = run(level, &guesses, effort);
        fitted.iter_mut().for_each(|corner| *corner = corner.filter(|c| is_sound(c, self.board, options)));
        self.positions = fitted.iter().map(|corner| Some(corner.as_ref()?.position)).collect();
        fitted
    }

    /// The corners of separate squares where they were printed. A tone curve makes the profile of an edge lopsided and moves
    /// it: of the grey values and the light behind them, those are taken in which edges look more like edges.
    fn fit_squares(&mut self, level: &Level, blur: f64, options: &BoardOptions) -> Vec<Option<Corner>> {
        let start = self.positions.clone();
        let mut tries = [None, Some(level.linear())].map(|linear| {
            self.positions.clone_from(&start);
            let fitted = self.fit(linear.as_ref().unwrap_or(level), blur, LAST_RADIUS, &EXACT, options);
            let residual = median(fitted.iter().flatten().map(|c| c.residual / c.contrast.abs()));
            (fitted, residual)
        });
        let [(as_seen, in_grey), (as_light, in_light)] = &mut tries;
        let fitted = if in_light < in_grey { as_light } else { as_seen };
        self.positions = fitted.iter().map(|corner| Some(corner.as_ref()?.position)).collect();
        self.take_back_spread(fitted);
        std::mem::take(fitted)
    }

    /// Moves the corners of separate squares to where they were printed.
    fn take_back_spread(&self, fitted: &mut [Option<Corner>]) {
        let corner = |k: usize| Some(SquareCorner { index: k, position: self.positions[k]?, sides: self.steps(k)? });
        let corners: Vec<SquareCorner> = (0..fitted.len()).filter_map(corner).collect();
        let Some(shift) = spread::estimate(self.board, &corners) else { return };
        for c in &corners {
            if let Some(corner) = &mut fitted[c.index] {
                corner.position -= spread::inward(&c.sides) * shift;
            }
        }
    }

    fn smallest_step(&self) -> f64 {
        let steps = (0..self.positions.len()).filter_map(|k| self.steps(k)).flatten().map(|s| s.norm());
        steps.fold(f64::INFINITY, f64::min)
    }

    /// What a corner and its neighbours say about its edges. `None` for one that is not seen or has no neighbour along an axis.
    fn guess(&self, k: usize, blur: f64, radius: f64) -> Option<Guess> {
        let (position, steps) = (self.positions[k]?, self.steps(k)?);
        let [row, column] = self.axes(k);
        let edges = [self.edge(k, row, steps[0]), self.edge(k, column, steps[1])];
        let [angles, curvatures] = [edges.map(|e| e.0), edges.map(|e| e.1)];
        Some(Guess { shape: shape(self.board), position, steps, angles, curvatures, blur, radius })
    }

    /// To the next parallel edges along both axes.
    fn steps(&self, k: usize) -> Option<[Vec2; 2]> {
        let position = self.positions[k]?;
        let step = |axis: Axis| match self.board.pattern {
            Pattern::Checkerboard => {
                let before = self.neighbour(k, axis, -1).map(|p| position - p);
                shorter(before, self.neighbour(k, axis, 1).map(|p| p - position))
            }
            Pattern::Squares { gap } => {
                let inward = if axis.index.is_multiple_of(2) { 1 } else { -1 };
                Some((self.neighbour(k, axis, inward)? - position) * gap.min(1.0))
            }
        };
        let [u, v] = self.axes(k).map(step);
        Some([u?, v?])
    }

    /// The place of corner `k` along the columns and along the rows.
    fn axes(&self, k: usize) -> [Axis; 2] {
        let (columns, rows) = self.board.corners();
        let along_row = Axis { index: k % columns, count: columns, stride: 1 };
        [along_row, Axis { index: k / columns, count: rows, stride: columns }]
    }

    fn neighbour(&self, k: usize, axis: Axis, by: isize) -> Option<Vec2> {
        let there = axis.index.checked_add_signed(by).filter(|&i| i < axis.count)?;
        self.positions[k + there * axis.stride - axis.index * axis.stride]
    }

    /// Direction and curvature of the edge along an axis: those of the parabola through the corners around, or of the step
    /// alone where too few are seen.
    fn edge(&self, k: usize, axis: Axis, step: Vec2) -> (f64, f64) {
        let straight = (angle(&step), 0.0);
        let Some(origin) = self.positions[k] else { return straight };
        let first = axis.index.saturating_sub(BEND_REACH).min(axis.count.saturating_sub(2 * BEND_REACH + 1));
        let line =
            (first..axis.count.min(first + 2 * BEND_REACH + 1)).map(|i| k + i * axis.stride - axis.index * axis.stride);
        let along = step.normalize();
        let points =
            line.filter_map(|k| Some(self.positions[k]? - origin)).map(|p| Vec2::new(along.dot(&p), along.perp(&p)));
        parabola(points).map_or(straight, |(slope, bend)| (angle(&step) + slope.atan(), bend))
    }
}

/// A corner's place along one axis of the board.
#[derive(Clone, Copy)]
struct Axis {
    index: usize,
    count: usize,
    stride: usize,
}

fn shorter(a: Option<Vec2>, b: Option<Vec2>) -> Option<Vec2> {
    match (a, b) {
        (Some(a), Some(b)) if b.norm() < a.norm() => Some(b),
        (Some(a), _) => Some(a),
        (None, b) => b,
    }
}

fn angle(v: &Vec2) -> f64 {
    v.y.atan2(v.x)
}

/// Slope and second derivative, at zero, of the parabola that fits three or more points best.
fn parabola(points: impl Iterator<Item = Vec2>) -> Option<(f64, f64)> {
    let (mut normal, mut right, mut count) = (Mat3::zeros(), Vec3::zeros(), 0);
    for p in points {
        let row = Vec3::new(1.0, p.x, p.x * p.x);
        normal += row * row.transpose();
        right += row * p.y;
        count += 1;
    }
    let fitted = if count < 3 { None } else { Some(normal.cholesky()?.solve(&right)) };
    fitted.map(|c| (c.y, 2.0 * c.z))
}

/// Middle value; 0 for none.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    geometry::median(values).unwrap_or(0.0)
}
