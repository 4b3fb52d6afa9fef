//! Boards: their corners to a few hundredths of a pixel.
//!
//! # Entry points
//! - [`detect`]: a picture and the boards it may show in, the corners in the board's order out.
//!
//! # Conventions
//! Corners are counted row by row as in [`Board`]; columns to rows turn as x to y of the picture. The square left of and above
//! a checkerboard's first corner is black: that settles the order of a board with one odd and one even number of corners. One
//! with two even or two odd numbers, and one of separate squares, looks the same after half a turn, unless its mark is seen; of
//! the two orders the one with its rows to the right is taken, and [`BoardCorners::oriented`] says so. Pixel centres are at
//! integers.
//!
//! # How
//! From the coarsest level of a pyramid to the finest, until the board is found: saddle points of the grey values (or dark
//! quadrilaterals), a lattice grown over them by local homographies, the board placed in it, then each corner fitted by a model
//! of blurred edges.

mod arrange;
mod grow;
mod lattice;
mod level;
mod mark;
mod measure;
mod refine;
mod saddles;
#[cfg(test)]
mod scene;
mod spread;
mod squares;

use arrange::{Mismatch, Placement, arrange};
use geometry::{Board, Pattern, Vec2};
use image::GrayImage;
use lattice::Lattice;
use level::Level;

/// The search begins in the finest level with no more pixels than this.
const COARSEST_PIXELS: usize = 120_000;

/// How to look for a board.
#[derive(Clone, Copy, Debug)]
pub struct BoardOptions {
    /// Least difference of white and black, grey levels.
    pub min_contrast: f64,
    /// At most this many saddle points or squares of a level are tried, strongest first.
    pub max_candidates: usize,
    /// At most this many of them are tried as a first one.
    pub max_seeds: usize,
    /// Fewer corners of a board that is not whole are not worth having.
    pub min_corners: usize,
}

impl Default for BoardOptions {
    fn default() -> Self {
        Self { min_contrast: 12.0, max_candidates: 3000, max_seeds: 1000, min_corners: 12 }
    }
}

/// One corner of a board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoardCorner {
    /// Its number on the board, row by row.
    pub index: usize,
    /// Pixels.
    pub position: Vec2,
    /// Standard deviation along one axis, pixels, by the residual of its fit.
    pub sigma_px: f64,
}

/// The corners of a board that a picture shows.
#[derive(Clone, Debug, PartialEq)]
pub struct BoardCorners {
    /// Which of the boards asked for it is.
    pub board: usize,
    /// Its corners in rising order; those outside the picture or covered are missing.
    pub corners: Vec<BoardCorner>,
    /// Whether the order is certain; otherwise half a turn of the board gives the same picture.
    pub oriented: bool,
    /// Median standard deviation of the edges' blur, pixels.
    pub blur_px: f64,
    /// Median difference of white and black, grey levels.
    pub contrast: f64,
}

/// Several boards, in a sentence.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked(Vec<Board>);

impl From<Vec<Board>> for Asked {
    fn from(boards: Vec<Board>) -> Self {
        Self(boards)
    }
}

impl std::fmt::Display for Asked {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let names: Vec<String> = self.0.iter().map(ToString::to_string).collect();
        f.write_str(&names.join(" or "))
    }
}

/// Why there are no corners.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BoardError {
    /// A board too small to be told from other things.
    #[error(
        "a board needs at least 3x3 inner corners or 2x2 squares, {asked} was asked for: count the points where four squares meet"
    )]
    Impossible {
        /// The boards asked for.
        asked: Asked,
    },
    /// No board at all.
    #[error("no board was found (asked for {asked}): show all of it, sharp and evenly lit")]
    NotFound {
        /// The boards asked for.
        asked: Asked,
    },
    /// Another board.
    #[error(
        "found a board of {found}, asked for {asked}: of a checkerboard count the points where four squares meet, not the squares"
    )]
    WrongSize {
        /// The boards asked for.
        asked: Asked,
        /// The board seen; the size of its squares is that asked for.
        found: Board,
    },
    /// Part of the board is outside the picture or covered, and what is seen does not tell which part.
    #[error(
        "{seen} corners of a board are seen, but not which of {asked}: keep two sides of the board in the picture and uncovered"
    )]
    NotWhole {
        /// The boards asked for.
        asked: Asked,
        /// How many corners were seen.
        seen: usize,
    },
    /// Corners that do not look like any.
    #[error("a board of {asked} is there but can't be measured: is it blurred, or something before it?")]
    Unclear {
        /// The boards asked for.
        asked: Asked,
    },
}

/// Finds one of `boards` in a picture.
///
/// Squares may be from about 8 pixels to the whole picture, tilted up to 60° or so, blurred and unevenly lit. A part of a board
/// will do when two of its sides show which part it is. Errors say what was seen instead.
pub fn detect(image: &GrayImage, boards: &[Board], options: &BoardOptions) -> Result<BoardCorners, BoardError> {
    let asked = || Asked(boards.to_vec());
    let too_small = |b: &Board| match b.pattern {
        Pattern::Checkerboard => b.columns.min(b.rows) < 3,
        Pattern::Squares { gap } => b.columns.min(b.rows) < 2 || !(gap > 0.0 && gap.is_finite()),
    };
    if boards.is_empty() || boards.iter().any(too_small) {
        return Err(BoardError::Impossible { asked: asked() });
    }
    // One hand-over to the thread pool instead of one for each of many short loops.
    rayon::scope(|_| search(image, boards, options))
}

fn search(image: &GrayImage, boards: &[Board], options: &BoardOptions) -> Result<BoardCorners, BoardError> {
    let asked = || Asked(boards.to_vec());
    let levels = pyramid(image);
    let mut search = Search { boards, options, part: None, mismatch: Mismatch::Nothing, unclear: false };
    // The coarsest level only serves where motion has smeared the corners of the next one.
    let coarsest = levels.len() - 1;
    let order = [coarsest.saturating_sub(1), coarsest].into_iter().chain((0..coarsest.saturating_sub(1)).rev());
    for n in order {
        if let Some(found) = search.look(&levels[..=n]) {
            return Ok(found);
        }
    }
    let Search { part, mismatch, unclear, .. } = search;
    part.map(|(_, corners)| corners).ok_or_else(|| match mismatch {
        Mismatch::Other { found } => BoardError::WrongSize { asked: asked(), found },
        Mismatch::Unplaced { corners } => BoardError::NotWhole { asked: asked(), seen: corners },
        Mismatch::Nothing if unclear => BoardError::Unclear { asked: asked() },
        Mismatch::Nothing => BoardError::NotFound { asked: asked() },
    })
}

/// The picture and its halves down to [`COARSEST_PIXELS`], and one more.
fn pyramid(image: &GrayImage) -> Vec<Level<'_>> {
    let mut levels = vec![Level::from_image(image)];
    while let Some(coarser) = levels.last().filter(|l| l.width * l.height > COARSEST_PIXELS).map(Level::halved) {
        levels.push(coarser);
    }
    levels.extend(levels.last().map(Level::halved));
    levels
}

/// What the levels searched so far have shown.
struct Search<'a> {
    boards: &'a [Board],
    options: &'a BoardOptions,
    /// The largest part of a board, and how many corners of it were seen.
    part: Option<(usize, BoardCorners)>,
    mismatch: Mismatch,
    unclear: bool,
}

impl Search<'_> {
    /// Looks at the last of some levels; the board when nothing of it is left to be found in finer ones.
    fn look(&mut self, levels: &[Level]) -> Option<BoardCorners> {
        let level = &levels[levels.len() - 1];
        let whole = |l: &Lattice| arrange(l, level, self.boards).is_ok_and(|p| p.complete);
        let mut lattices = self.squares(level, &whole);
        lattices.extend(self.checkerboard(level, &whole));
        lattices.into_iter().find_map(|lattice| self.judge(levels, &lattice))
    }

    fn checkerboard(&self, level: &Level, enough: &impl Fn(&Lattice) -> bool) -> Option<Lattice> {
        if !self.boards.iter().any(|b| b.pattern == Pattern::Checkerboard) {
            return None;
        }
        let saddles = saddles::find(level, self.options.min_contrast, self.options.max_candidates);
        grow::grow(&saddles, self.options.max_seeds, enough)
    }

    /// The lattice for each gap asked for.
    fn squares(&self, level: &Level, enough: &impl Fn(&Lattice) -> bool) -> Vec<Lattice> {
        let mut gaps: Vec<f64> = Vec::new();
        for board in self.boards {
            if let Pattern::Squares { gap } = board.pattern
                && !gaps.contains(&gap)
            {
                gaps.push(gap);
            }
        }
        if gaps.is_empty() {
            return Vec::new();
        }
        let found = squares::find(level, self.options.min_contrast, self.options.max_candidates);
        gaps.into_iter().filter_map(|gap| squares::grow(&found, gap, enough)).collect()
    }

    /// Measures a lattice that is a board asked for; keeps the best excuse otherwise.
    fn judge(&mut self, levels: &[Level], lattice: &Lattice) -> Option<BoardCorners> {
        let level = &levels[levels.len() - 1];
        match arrange(lattice, level, self.boards) {
            Ok(placement) => {
                let measured = measure::measure(levels, &placement, &self.boards[placement.board], self.options);
                self.unclear |= placement.complete && measured.is_none();
                if placement.complete {
                    return measured;
                }
                self.keep(&placement, measured?);
            }
            Err(mismatch) => {
                let board = self.boards.iter().find(|board| lattice.could_show(board))?;
                if mismatch.corners() > self.mismatch.corners()
                    && measure::is_board(level, lattice, board, self.options)
                {
                    self.mismatch = mismatch;
                }
            }
        }
        None
    }

    fn keep(&mut self, placement: &Placement, measured: BoardCorners) {
        let seen = placement.seen();
        if self.part.as_ref().is_none_or(|(best, _)| seen > *best) {
            self.part = Some((seen, measured));
        }
    }
}

#[cfg(test)]
mod tests;
