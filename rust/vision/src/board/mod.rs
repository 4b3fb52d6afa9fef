//! Checkerboards: their inner corners to a few hundredths of a pixel.
//!
//! # Entry points
//! - [`detect`]: a picture and the number of inner corners in, the corners in the board's order out.
//!
//! # Conventions
//! Corners are row by row, `columns` to a row; columns to rows turn as x to y of the picture. The square left of and
//! above the first corner is black: that settles the order of a board with one odd and one even number of corners; one
//! with two even or two odd numbers looks the same from two sides, and of these the one with its rows to the right is
//! taken. Pixel centres are at integers.
//!
//! # How
//! From the coarsest level of a pyramid to the finest, until the board is found: saddle points of the grey values, a
//! lattice grown over them by local homographies, then each corner fitted by a model of blurred edges in finer and finer
//! levels, at last with the edges' curvature that the neighbours tell.

mod arrange;
mod lattice;
mod plane;
mod refine;
mod saddles;
#[cfg(test)]
mod scene;

use geometry::Vec2;
use image::GrayImage;
use lattice::Lattice;
use plane::{Plane, finer};
use rayon::prelude::*;
use refine::{Corner, Effort, Guess};
use saddles::Saddle;
use serde::{Deserialize, Serialize};

/// The search begins in the finest level with no more pixels than this.
const COARSEST_PIXELS: usize = 120_000;
/// A corner is measured in the finest level where the blur is below this, pixels: finer ones only add work.
const MAX_BLUR: f64 = 2.5;
/// Standard deviation of the edges' blur that the first fit begins with, pixels.
const FIRST_BLUR: f64 = 0.7;
/// Of all fits but the last.
const FIRST_EFFORT: Effort = Effort { max_radius: 8.0, last_step: 0.1 };
/// Residual of a corner's fit relative to its contrast above which it is not a corner.
const MAX_RESIDUAL: f64 = 0.2;

/// Number of inner corners, where four squares meet, of a checkerboard.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BoardSize {
    /// Corners in a row.
    pub columns: u32,
    /// Rows of corners.
    pub rows: u32,
}

impl BoardSize {
    fn turned(self) -> Self {
        Self { columns: self.rows, rows: self.columns }
    }

    fn sorted(self) -> (u32, u32) {
        (self.columns.min(self.rows), self.columns.max(self.rows))
    }

    fn wide(self) -> Self {
        let (rows, columns) = self.sorted();
        Self { columns, rows }
    }

    fn tall(self) -> Self {
        self.wide().turned()
    }
}

impl std::fmt::Display for BoardSize {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}x{}", self.columns, self.rows)
    }
}

/// How to look for a board.
#[derive(Clone, Copy, Debug)]
pub struct BoardOptions {
    /// Least difference of white and black, grey levels.
    pub min_contrast: f64,
    /// Largest radius of the window a corner is fitted in, pixels of the level it is measured in.
    pub max_radius: f64,
    /// At most this many saddle points of a level are looked at, strongest first.
    pub max_saddles: usize,
    /// At most this many of them are tried as a first corner.
    pub max_seeds: usize,
}

impl Default for BoardOptions {
    fn default() -> Self {
        Self { min_contrast: 12.0, max_radius: 32.0, max_saddles: 3000, max_seeds: 1000 }
    }
}

/// The inner corners of a board.
#[derive(Clone, Debug, PartialEq)]
pub struct BoardCorners {
    /// Corners to a row, and rows.
    pub size: BoardSize,
    /// Row by row, pixels.
    pub corners: Vec<Vec2>,
    /// Standard deviation of each corner along one axis, pixels, by the residual of its fit.
    pub sigma_px: Vec<f64>,
    /// Median standard deviation of the edges' blur, pixels.
    pub blur_px: f64,
    /// Median difference of white and black, grey levels.
    pub contrast: f64,
}

/// Why there are no corners.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BoardError {
    /// A board too small to be told from other crossings.
    #[error(
        "a board needs at least 3x3 inner corners, {asked} was asked for: count the points where four squares meet"
    )]
    InvalidSize {
        /// The size asked for.
        asked: BoardSize,
    },
    /// No lattice of corners.
    #[error(
        "no checkerboard was found (asked for {asked} inner corners): show all of it, sharp, with its white margin"
    )]
    NotFound {
        /// The size asked for.
        asked: BoardSize,
    },
    /// Another board.
    #[error(
        "found a board of {found} inner corners, asked for {asked}: count the points where four squares meet, not the squares"
    )]
    WrongSize {
        /// The size asked for.
        asked: BoardSize,
        /// The size seen.
        found: BoardSize,
    },
    /// Part of the board is outside the picture or covered.
    #[error(
        "the board is not whole: {seen} of its {asked} inner corners are seen; keep all of it in the picture and uncovered"
    )]
    NotWhole {
        /// The size asked for.
        asked: BoardSize,
        /// How many corners were seen.
        seen: usize,
    },
    /// One corner does not look like one.
    #[error(
        "inner corner {column} of row {row} of the board can't be measured: is something before it, or is it blurred?"
    )]
    UnclearCorner {
        /// Its column, from 0.
        column: usize,
        /// Its row, from 0.
        row: usize,
    },
}

/// Finds the board of `size` inner corners in a picture.
///
/// Squares may be from about 8 pixels to the whole picture, tilted up to 60° or so, blurred and unevenly lit; the board
/// has to be whole. Errors say what was seen instead.
pub fn detect(image: &GrayImage, size: BoardSize, options: &BoardOptions) -> Result<BoardCorners, BoardError> {
    if size.sorted().0 < 3 {
        return Err(BoardError::InvalidSize { asked: size });
    }
    let levels = pyramid(image);
    let (mut seen, mut error) = (0, BoardError::NotFound { asked: size });
    for n in (0..levels.len()).rev() {
        let level = &levels[n];
        let extent = (level.width, level.height);
        let saddles = saddles::find(level, options.min_contrast, options.max_saddles);
        let whole = |l: &Lattice| arrange::arrange(l, &saddles, size, extent).is_ok();
        let Some(lattice) = lattice::grow(&saddles, options.max_seeds, whole) else { continue };
        match arrange::arrange(&lattice, &saddles, size, extent) {
            Ok(positions) => match measure(&levels[..=n], positions, size, options) {
                Ok(corners) => return Ok(corners),
                Err(unclear) => (seen, error) = (lattice.cells.len(), unclear),
            },
            Err(mismatch) => {
                if mismatch.corners > seen && is_board(level, &lattice, &saddles, options) {
                    (seen, error) = (mismatch.corners, mismatch.error);
                }
            }
        }
    }
    Err(error)
}

/// The picture and its halves down to [`COARSEST_PIXELS`].
fn pyramid(image: &GrayImage) -> Vec<Plane> {
    let mut levels = vec![Plane::from_image(image)];
    while let Some(coarser) = levels.last().filter(|l| l.width * l.height > COARSEST_PIXELS).map(Plane::halved) {
        levels.push(coarser);
    }
    levels
}

/// Whether a lattice that is not the board asked for is one at all, and not a texture: most of its corners look like one.
fn is_board(level: &Plane, lattice: &Lattice, saddles: &[Saddle], options: &BoardOptions) -> bool {
    let sound = |(&cell, &k): (&lattice::Cell, &usize)| {
        let Some(local) = lattice.predict(saddles, cell) else { return false };
        let position = saddles[k].position;
        let guess = Guess { position, steps: [local.u, local.v], curvatures: [0.0; 2], blur: FIRST_BLUR };
        refine::fit(level, &guess, &FIRST_EFFORT).is_some_and(|c| is_sound(&c, options))
    };
    2 * lattice.cells.iter().filter(|&c| sound(c)).count() > lattice.cells.len()
}

fn is_sound(corner: &Corner, options: &BoardOptions) -> bool {
    corner.contrast >= options.min_contrast && corner.residual <= MAX_RESIDUAL * corner.contrast
}

/// Fits the corners, roughly at `positions` of the last level, in that level and on to the finest useful one.
fn measure(
    levels: &[Plane],
    mut positions: Vec<Vec2>,
    size: BoardSize,
    options: &BoardOptions,
) -> Result<BoardCorners, BoardError> {
    let columns = size.columns as usize;
    let fit = |level: &Plane, positions: &[Vec2], blur: f64, last: bool| -> Result<Vec<Corner>, BoardError> {
        let effort = if last { Effort { max_radius: options.max_radius, last_step: 0.02 } } else { FIRST_EFFORT };
        let guesses = guesses(positions, columns, blur, last);
        let fitted: Vec<_> = guesses.par_iter().map(|g| refine::fit(level, g, &effort)).collect();
        let unclear = |k: usize| BoardError::UnclearCorner { column: k % columns, row: k / columns };
        fitted.into_iter().enumerate().map(|(k, c)| c.filter(|c| is_sound(c, options)).ok_or(unclear(k))).collect()
    };
    let mut n = levels.len() - 1;
    let mut corners = fit(&levels[n], &positions, FIRST_BLUR, false)?;
    loop {
        positions = corners.iter().map(|c| c.position).collect();
        let blur = median(corners.iter().map(|c| c.blur));
        if n == 0 || 2.0 * blur > MAX_BLUR {
            corners = fit(&levels[n], &positions, blur, true)?;
            break;
        }
        n -= 1;
        positions = positions.into_iter().map(finer).collect();
        corners = fit(&levels[n], &positions, blur, false)?;
    }
    let scale = f64::from(1_u32 << n);
    Ok(BoardCorners {
        size,
        corners: corners.iter().map(|c| (0..n).fold(c.position, |p, _| finer(p))).collect(),
        sigma_px: corners.iter().map(|c| c.sigma * scale).collect(),
        blur_px: median(corners.iter().map(|c| c.blur)) * scale,
        contrast: median(corners.iter().map(|c| c.contrast)),
    })
}

/// What each corner's neighbours, row by row, say about its edges; curvatures only when `bent`.
fn guesses(positions: &[Vec2], columns: usize, blur: f64, bent: bool) -> Vec<Guess> {
    let rows = positions.len() / columns;
    let guess = |k: usize| {
        let axes = [(k % columns, columns, 1), (k / columns, rows, columns)];
        let steps = axes.map(|(index, count, stride)| {
            let after = (index + 1 < count).then(|| positions[k + stride] - positions[k]);
            let before = (index > 0).then(|| positions[k] - positions[k - stride]);
            match (before, after) {
                (Some(a), Some(b)) if b.norm() < a.norm() => b,
                (Some(a), _) => a,
                (None, b) => b.unwrap_or_default(),
            }
        });
        let curvatures = axes.map(|(index, count, stride)| {
            let middle = k + stride * index.clamp(1, count - 2) - stride * index;
            if bent {
                curvature(positions[middle - stride], positions[middle], positions[middle + stride])
            } else {
                0.0
            }
        });
        Guess { position: positions[k], steps, curvatures, blur }
    };
    (0..positions.len()).map(guess).collect()
}

/// Curvature of the parabola through three points, the chord of the outer two as its abscissa.
fn curvature(before: Vec2, middle: Vec2, after: Vec2) -> f64 {
    let along = (after - before).normalize();
    let (a, b) = (before - middle, after - middle);
    let slope = |d: &Vec2| along.perp(d) / along.dot(d);
    2.0 * (slope(&b) - slope(&a)) / (along.dot(&b) - along.dot(&a))
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests;
