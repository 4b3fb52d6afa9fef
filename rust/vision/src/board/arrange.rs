//! From a grown lattice to a board that was asked for: which one, which of its corners, or what is wrong.

use super::lattice::{Cell, Lattice};
use super::level::Level;
use super::mark;
use geometry::{Board, Vec2};

/// A side line of a lattice belongs to the board when at least this part of it was found.
const MIN_FILLED: f64 = 0.5;
/// Corners in a row and in a column that tell a board from a texture.
const MIN_SPAN: i32 = 3;

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

    /// The four lines of cells `outside` steps beyond (0: the outermost lines themselves): before and after the columns,
    /// before and after the rows.
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

/// A board in a lattice.
#[derive(Debug)]
pub(super) struct Placement {
    /// Index among the boards asked for.
    pub(super) board: usize,
    /// Position of each of the board's corners, row by row; `None` where it was not seen.
    pub(super) positions: Vec<Option<Vec2>>,
    /// Whether half a turn of the board would be noticed.
    pub(super) oriented: bool,
    /// Whether no corner is missing inside the picture.
    pub(super) complete: bool,
}

impl Placement {
    pub(super) fn seen(&self) -> usize {
        self.positions.iter().flatten().count()
    }
}

/// A lattice that is none of the boards asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Mismatch {
    /// No board at all.
    Nothing,
    /// So many corners of one asked for, but not which.
    Unplaced { corners: usize },
    /// Another one; its squares' size is not known.
    Other { found: Board },
}

impl Mismatch {
    /// How many corners there are.
    pub(super) fn corners(&self) -> usize {
        match *self {
            Self::Nothing => 0,
            Self::Unplaced { corners } => corners,
            Self::Other { found } => found.corners().0 * found.corners().1,
        }
    }
}

/// A board asked for and the cells it would take, seen or not.
struct Candidate {
    board: usize,
    extent: Extent,
}

/// Finds the board that a lattice is.
pub(super) fn arrange(lattice: &Lattice, level: &Level, boards: &[Board]) -> Result<Placement, Mismatch> {
    let Some(all) = Extent::of(lattice) else { return Err(Mismatch::Nothing) };
    let likely = || boards.iter().enumerate().filter(|(_, board)| lattice.could_show(board));
    if let Some(whole) = likely().find_map(|(k, board)| whole_board(lattice, all, k, board)) {
        let whole_readings = readings(lattice, level, &whole, &boards[whole.board]);
        return choose(whole_readings, true).ok_or(Mismatch::Nothing);
    }
    let seen = trimmed(lattice, all);
    if seen.columns().min(seen.rows()) < MIN_SPAN || seen.filled(lattice) < MIN_FILLED {
        return Err(Mismatch::Nothing);
    }
    let ends = [0, 1, 2, 3].map(|side| Side::of(lattice, level, seen, side));
    let fits = |(k, board): (usize, &Board)| sizes(board).map(move |size| part_of_board(k, size, seen, ends));
    let candidates: Vec<Candidate> = likely().flat_map(fits).flatten().collect();
    let complete = seen.filled(lattice) == 1.0;
    let possible: Vec<Reading> =
        candidates.iter().flat_map(|c| readings(lattice, level, c, &boards[c.board])).collect();
    choose(possible, complete).ok_or_else(|| mismatch(lattice, seen, ends, boards))
}

/// How a lattice ends at one of its sides.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Side {
    /// With the board's last corners: its border is seen beyond them.
    Ends,
    /// At the picture's border.
    Cut,
    /// Somehow: something may be before the board.
    Unclear,
}

impl Side {
    /// Of the side with this number in [`Extent::sides`].
    fn of(lattice: &Lattice, level: &Level, seen: Extent, side: usize) -> Self {
        if lattice.is_paired() {
            return Self::of_squares(lattice, level, seen, side);
        }
        let (last, beyond) = (seen.sides(0)[side], seen.sides(1)[side]);
        if !lattice.is_inside(beyond.cells(), level) {
            return Self::Cut;
        }
        // One step beyond the last corners lies the border of the outer squares. Of the four quarters around a point there two
        // are alike, those outside: the difference of diagonal quarters is half of that at a corner.
        let crossing =
            |cell: Cell| Some(lattice.crossing(cell, level)? * if lattice.is_black_before(cell) { -1.0 } else { 1.0 });
        let mut whole: Vec<f64> = last.cells().filter_map(crossing).collect();
        whole.sort_by(f64::total_cmp);
        let Some(&contrast) = whole.get(whole.len() / 2) else { return Self::Unclear };
        let parts: Vec<f64> = beyond.cells().filter_map(crossing).map(|c| c / contrast).collect();
        let halves = parts.iter().filter(|part| (0.25..0.75).contains(*part)).count();
        if 3 * halves > 2 * parts.len() { Self::Ends } else { Self::Unclear }
    }

    /// The same of squares that stand apart: where the next ones would be is white paper.
    fn of_squares(lattice: &Lattice, level: &Level, seen: Extent, side: usize) -> Self {
        let [far, near, last, inner, other] = [2, 1, 0, -1, -2].map(|outside| seen.sides(outside)[side]);
        if !lattice.is_inside(far.cells(), level) {
            return Self::Cut;
        }
        // A line of squares ends with its last corners: with odd ones after, with even ones before.
        let whole = match side {
            0 => last.first.0.rem_euclid(2) == 0,
            1 => last.first.0.rem_euclid(2) == 1,
            2 => last.first.1.rem_euclid(2) == 0,
            _ => last.first.1.rem_euclid(2) == 1,
        };
        // Between two lines of corners, at each square: corners of a square follow each other.
        let between = |a: Extent, b: Extent| -> Vec<Option<f64>> {
            let corners = |e: Extent| e.cells().map(|c| Some(lattice.predict(c)?.position)).collect::<Vec<_>>();
            let (a, b) = (corners(a), corners(b));
            let middle = |k: usize| Some((a[k]? + a[k + 1]? + b[k]? + b[k + 1]?) / 4.0);
            let grey = |p: Vec2| level.contains(&p, 1.0).then(|| level.interpolate(&p));
            (0..a.len() - 1).step_by(2).map(|k| middle(k).and_then(grey)).collect()
        };
        // White is told by a gap between squares that are seen: what is beyond them may be anything.
        let (next, gaps, squares) = (between(far, near), between(inner, other), between(last, inner));
        let part = |k: usize| Some((next[k]? - squares[k]?) / (gaps[k]? - squares[k]?));
        let parts: Vec<f64> = (0..next.len()).filter_map(part).collect();
        let white = parts.iter().filter(|part| (0.8..1.25).contains(*part)).count();
        if whole && 3 * white > 2 * parts.len() { Self::Ends } else { Self::Unclear }
    }
}

/// Columns and rows of a board's corners in the two ways it can lie in a lattice; once where they are the same.
fn sizes(board: &Board) -> impl Iterator<Item = (i32, i32)> + use<> {
    let (columns, rows) = board.corners();
    let (columns, rows) = (columns as i32, rows as i32);
    [(columns, rows), (rows, columns)].into_iter().take(if columns == rows { 1 } else { 2 })
}

/// The extent of exactly a board's size that is full, while the lines around it are not the board's.
fn whole_board(lattice: &Lattice, all: Extent, index: usize, board: &Board) -> Option<Candidate> {
    for (columns, rows) in sizes(board) {
        for j in all.first.1..=all.last.1 - rows + 1 {
            for i in all.first.0..=all.last.0 - columns + 1 {
                let extent = Extent { first: (i, j), last: (i + columns - 1, j + rows - 1) };
                let ends = extent.sides(1).into_iter().all(|side| side.filled(lattice) < MIN_FILLED);
                if ends && extent.filled(lattice) == 1.0 {
                    return Some(Candidate { board: index, extent });
                }
            }
        }
    }
    None
}

/// The cells of a board of which a part is seen and the rest is cut off by the picture's border. `None` where the part is
/// too large, or where the sides that end in the picture do not tell which part it is.
fn part_of_board(board: usize, (columns, rows): (i32, i32), seen: Extent, ends: [Side; 4]) -> Option<Candidate> {
    let along = |first: i32, last: i32, size: i32, ends: [Side; 2]| match (last - first + 1 - size, ends) {
        (0, _) => Some((first, last)),
        (1.., _) => None,
        (_, [Side::Ends, Side::Cut]) => Some((first, first + size - 1)),
        (_, [Side::Cut, Side::Ends]) => Some((last - size + 1, last)),
        _ => None,
    };
    let (i0, i1) = along(seen.first.0, seen.last.0, columns, [ends[0], ends[1]])?;
    let (j0, j1) = along(seen.first.1, seen.last.1, rows, [ends[2], ends[3]])?;
    Some(Candidate { board, extent: Extent { first: (i0, j0), last: (i1, j1) } })
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

/// A way to read a board's corners out of a lattice, and how well it agrees with the picture.
struct Reading {
    placement: Placement,
    /// Whether the mark is there; `None` where it can't be seen.
    marked: Option<bool>,
    /// How much the rows run to the right, −1…1.
    rightward: f64,
}

/// The turns of a candidate in which black squares are where the board has them.
fn readings(lattice: &Lattice, level: &Level, candidate: &Candidate, board: &Board) -> Vec<Reading> {
    let Extent { first: (i0, j0), last: (i1, j1) } = candidate.extent;
    // First corner and steps along a row and along a column, by quarter turns.
    let turns = [
        ((i0, j0), (1, 0), (0, 1)),
        ((i1, j0), (0, 1), (-1, 0)),
        ((i1, j1), (-1, 0), (0, -1)),
        ((i0, j1), (0, -1), (1, 0)),
    ];
    let (columns, rows) = (board.corners().0 as i32, board.corners().1 as i32);
    let reading = |turn: usize| {
        let (corner, a, b) = turns[turn];
        let cell = move |c: i32, r: i32| (corner.0 + a.0 * c + b.0 * r, corner.1 + a.1 * c + b.1 * r);
        let fits = candidate.extent.columns() == if turn.is_multiple_of(2) { columns } else { rows };
        if !fits || !is_coloured(lattice, corner, turn) {
            return None;
        }
        let at = |c: i32, r: i32| lattice.cells.get(&cell(c, r)).copied();
        let positions: Vec<_> = (0..rows).flat_map(|r| (0..columns).map(move |c| at(c, r))).collect();
        let marked = mark::is_there(level, [at(0, 0), at(1, 0), at(1, 1), at(0, 1)]);
        let placement = Placement { board: candidate.board, positions, oriented: false, complete: false };
        Some(Reading { rightward: rightward(&placement.positions, columns as usize), placement, marked })
    };
    (0..4).filter_map(reading).collect()
}

/// Whether the square that belongs to a board's first corner is black where `corner` is that corner.
fn is_coloured(lattice: &Lattice, corner: Cell, turn: usize) -> bool {
    // Squares that stand apart look the same after each turn. On a checkerboard the lattice's colour is told for the square
    // before a cell along both axes, and changes with each quarter turn.
    lattice.is_paired() || lattice.is_black_before(corner) == turn.is_multiple_of(2)
}

fn rightward(positions: &[Option<Vec2>], columns: usize) -> f64 {
    let steps = positions.chunks(columns).flat_map(|row| row.windows(2)).filter_map(|w| Some(w[1]? - w[0]?));
    let sum: Vec2 = steps.sum();
    sum.x / sum.norm()
}

/// The one reading that the mark or the colours allow; of two that look the same the one with its rows to the right.
fn choose(readings: Vec<Reading>, complete: bool) -> Option<Placement> {
    let marked = readings.iter().filter(|r| r.marked == Some(true)).count();
    let open = readings.iter().filter(|r| r.marked != Some(false)).count();
    let one = readings.len() == 1;
    let by_mark = marked == 1 && open == 1;
    // Readings of one board that differ by a turn are the same corners in another order; others are not the same corners.
    let same = |r: &Reading| {
        let seen = |r: &Reading| r.placement.positions.iter().map(Option::is_some).collect::<Vec<_>>();
        let first = &readings[0];
        let reversed = first.placement.positions.iter().rev().map(Option::is_some).collect::<Vec<_>>();
        r.placement.board == first.placement.board && (seen(r) == seen(first) || seen(r) == reversed)
    };
    let turned = readings.iter().all(same);
    if !(one || by_mark || turned) {
        return None;
    }
    let rank = |r: &Reading| (r.marked == Some(true) && by_mark, r.rightward);
    let best = readings.into_iter().max_by(|p, q| {
        let (p, q) = (rank(p), rank(q));
        p.0.cmp(&q.0).then(p.1.total_cmp(&q.1))
    })?;
    Some(Placement { oriented: one || by_mark, complete, ..best.placement })
}

/// What to say of a lattice that is no board asked for.
fn mismatch(lattice: &Lattice, seen: Extent, ends: [Side; 4], boards: &[Board]) -> Mismatch {
    let corners = seen.count(lattice);
    let (columns, rows) = (seen.columns(), seen.rows());
    let smaller = |(c, r): (i32, i32)| columns <= c && rows <= r;
    let likely = || boards.iter().filter(|board| lattice.could_show(board));
    let could_be = likely().flat_map(sizes).any(smaller);
    let same = likely().flat_map(sizes).any(|size| size == (columns, rows));
    let cut = ends.contains(&Side::Cut) || seen.sides(1).into_iter().any(|side| side.count(lattice) > 0);
    if same || (could_be && cut) {
        return Mismatch::Unplaced { corners };
    }
    let (wide, tall) = (columns.max(rows) as u32, columns.min(rows) as u32);
    let like = likely().next();
    let each = if lattice.is_paired() { 2 } else { 1 };
    let (wide, tall) = (wide / each, tall / each);
    let lying = like.is_none_or(|b| b.columns >= b.rows);
    let (columns, rows) = if lying { (wide, tall) } else { (tall, wide) };
    like.map_or(Mismatch::Nothing, |b| Mismatch::Other { found: Board { columns, rows, ..*b } })
}
