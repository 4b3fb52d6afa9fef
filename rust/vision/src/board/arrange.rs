//! From a grown lattice to the board that was asked for: its extent, its first corner, or what is wrong with it.

use super::lattice::{Cell, Lattice};
use super::saddles::Saddle;
use super::{BoardError, BoardSize};
use geometry::Vec2;

/// A side line of a lattice belongs to the board when at least this part of it was found.
const MIN_FILLED: f64 = 0.5;

/// Cells from `first` to `last`, both included.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Extent {
    first: Cell,
    last: Cell,
}

impl Extent {
    fn of(lattice: &Lattice) -> Option<Self> {
        let mut cells = lattice.cells.keys();
        let start = *cells.next()?;
        let around = |e: Self, &(i, j): &Cell| Self {
            first: (e.first.0.min(i), e.first.1.min(j)),
            last: (e.last.0.max(i), e.last.1.max(j)),
        };
        Some(cells.fold(Self { first: start, last: start }, around))
    }

    fn columns(&self) -> i32 {
        self.last.0 - self.first.0 + 1
    }

    fn rows(&self) -> i32 {
        self.last.1 - self.first.1 + 1
    }

    fn cells(self) -> impl Iterator<Item = Cell> {
        (self.first.1..=self.last.1).flat_map(move |j| (self.first.0..=self.last.0).map(move |i| (i, j)))
    }

    /// The four lines of cells `outside` steps beyond (0: the outermost lines themselves).
    fn sides(self, outside: i32) -> [Self; 4] {
        let Self { first: (i0, j0), last: (i1, j1) } = self;
        let line = |first, last| Self { first, last };
        [
            line((i0 - outside, j0), (i0 - outside, j1)),
            line((i1 + outside, j0), (i1 + outside, j1)),
            line((i0, j0 - outside), (i1, j0 - outside)),
            line((i0, j1 + outside), (i1, j1 + outside)),
        ]
    }

    /// This extent without one of its [`Extent::sides`].
    fn without(mut self, side: usize) -> Self {
        match side {
            0 => self.first.0 += 1,
            1 => self.last.0 -= 1,
            2 => self.first.1 += 1,
            _ => self.last.1 -= 1,
        }
        self
    }

    fn count(self, lattice: &Lattice) -> usize {
        self.cells().filter(|c| lattice.cells.contains_key(c)).count()
    }

    fn filled(self, lattice: &Lattice) -> f64 {
        self.count(lattice) as f64 / f64::from(self.columns() * self.rows()).max(1.0)
    }
}

/// A lattice that is not the board asked for, and how many corners it has.
pub(super) struct Mismatch {
    pub(super) error: BoardError,
    pub(super) corners: usize,
}

/// The positions of the asked board's corners, row by row from its first corner, in a level of `width × height`.
pub(super) fn arrange(
    lattice: &Lattice,
    saddles: &[Saddle],
    asked: BoardSize,
    (width, height): (usize, usize),
) -> Result<Vec<Vec2>, Mismatch> {
    let nothing = Mismatch { error: BoardError::NotFound { asked }, corners: 0 };
    let Some(all) = Extent::of(lattice) else { return Err(nothing) };
    if let Some(board) = whole_board(lattice, all, asked) {
        return Ok(from_first_corner(lattice, saddles, board, asked));
    }
    let extent = trimmed(lattice, all);
    let corners = extent.count(lattice);
    if extent.columns().min(extent.rows()) < 3 || extent.filled(lattice) < MIN_FILLED {
        return Err(nothing);
    }
    let seen = BoardSize { columns: extent.columns() as u32, rows: extent.rows() as u32 };
    let (seen_sorted, asked_sorted) = (seen.sorted(), asked.sorted());
    let larger = seen_sorted.0 > asked_sorted.0 || seen_sorted.1 > asked_sorted.1;
    let continues = extent.sides(1).into_iter().any(|side| {
        side.count(lattice) > 0
            || side.cells().filter_map(|c| lattice.predict(saddles, c)).any(|p| {
                let p = p.position;
                p.x < 2.0 || p.y < 2.0 || p.x > width as f64 - 3.0 || p.y > height as f64 - 3.0
            })
    });
    let error = if seen_sorted == asked_sorted || (!larger && continues) {
        BoardError::NotWhole { asked, seen: corners }
    } else {
        BoardError::WrongSize { asked, found: if asked.columns >= asked.rows { seen.wide() } else { seen.tall() } }
    };
    Err(Mismatch { error, corners })
}

/// The extent of exactly the size asked that is full, while the lines around it are not the board's.
fn whole_board(lattice: &Lattice, all: Extent, asked: BoardSize) -> Option<Extent> {
    for size in [asked, asked.turned()] {
        let (columns, rows) = (size.columns as i32, size.rows as i32);
        for j in all.first.1..=all.last.1 - rows + 1 {
            for i in all.first.0..=all.last.0 - columns + 1 {
                let extent = Extent { first: (i, j), last: (i + columns - 1, j + rows - 1) };
                let ends = extent.sides(1).into_iter().all(|side| side.filled(lattice) < MIN_FILLED);
                if ends && extent.filled(lattice) == 1.0 {
                    return Some(extent);
                }
            }
        }
    }
    None
}

/// The extent without the side lines of which too little was found, emptiest first.
fn trimmed(lattice: &Lattice, mut extent: Extent) -> Extent {
    while extent.columns() > 1 && extent.rows() > 1 {
        let filled = extent.sides(0).map(|side| side.filled(lattice));
        let worst = (0..4).min_by(|&a, &b| filled[a].total_cmp(&filled[b])).unwrap_or(0);
        if filled[worst] >= MIN_FILLED {
            break;
        }
        extent = extent.without(worst);
    }
    extent
}

/// Reads a board out so that the square before the first corner is black, if any turn of the board allows that; of the
/// turns that remain, the one whose rows run most to the right.
fn from_first_corner(lattice: &Lattice, saddles: &[Saddle], board: Extent, asked: BoardSize) -> Vec<Vec2> {
    let Extent { first: (i0, j0), last: (i1, j1) } = board;
    // First corner and steps along a row and along a column, by quarter turns.
    let turns = [
        ((i0, j0), (1, 0), (0, 1)),
        ((i1, j0), (0, 1), (-1, 0)),
        ((i1, j1), (-1, 0), (0, -1)),
        ((i0, j1), (0, -1), (1, 0)),
    ];
    let (columns, rows) = (asked.columns as i32, asked.rows as i32);
    let at = |turn: usize, column: i32, row: i32| {
        let ((i, j), a, b) = turns[turn];
        saddles[lattice.cells[&(i + a.0 * column + b.0 * row, j + a.1 * column + b.1 * row)]].position
    };
    let fits = |turn: usize| board.columns() == if turn.is_multiple_of(2) { columns } else { rows };
    // A lattice edge along the columns' axis becomes one along the rows' axis by a quarter turn.
    let black = |turn: usize| lattice.is_black_before(turns[turn].0) == turn.is_multiple_of(2);
    let rank = |turn: usize| {
        let along = at(turn, columns - 1, 0) - at(turn, 0, 0);
        (black(turn), along.x / along.norm())
    };
    let best = (0..4).filter(|&t| fits(t)).max_by(|&a, &b| {
        let (a, b) = (rank(a), rank(b));
        a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    let turn = best.unwrap_or(0);
    (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row))).map(|(c, r)| at(turn, c, r)).collect()
}
