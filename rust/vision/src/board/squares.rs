//! Dark squares apart from each other (Zhang's board), and the lattice of their corners.
//!
//! Pixels darker than their surroundings are joined to regions; a region whose outline is a quadrilateral is a square. From
//! any square the next ones are predicted by the lattice of corners known so far.

use super::lattice::{Cell, Lattice};
use super::level::Level;
use geometry::{Pattern, Vec2};

/// Surroundings reach this part of the picture's shorter side to each side of a pixel.
const SURROUNDINGS: f64 = 0.12;
/// Least pixels of a square.
const MIN_AREA: usize = 20;
/// The outline's area may differ by this part from the region's.
const AREA_TOLERANCE: f64 = 0.15;
/// A neighbour's middle may miss its prediction by this part of a side.
const POSITION_TOLERANCE: f64 = 0.3;
/// A neighbour's area may differ by this factor.
const MAX_AREA_RATIO: f64 = 2.0;

/// A dark quadrilateral.
#[derive(Clone, Copy, Debug)]
pub(super) struct Square {
    /// Turning from x to y.
    corners: [Vec2; 4],
    area: f64,
}

impl Square {
    fn middle(&self) -> Vec2 {
        self.corners.iter().sum::<Vec2>() / 4.0
    }

    fn side(&self) -> f64 {
        self.area.sqrt()
    }

    /// The corners from the one nearest to `first`.
    fn from(&self, first: &Vec2) -> [Vec2; 4] {
        let distance = |k: &usize| (self.corners[*k] - first).norm();
        let start = (0..4).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0);
        std::array::from_fn(|k| self.corners[(start + k) % 4])
    }
}

/// The dark quadrilaterals of a level, largest first.
pub(super) fn find(level: &Level, min_contrast: f64, limit: usize) -> Vec<Square> {
    let dark = darker_than_surroundings(level, min_contrast / 4.0);
    let mut squares: Vec<Square> =
        regions(&dark, level.width).iter().filter_map(|region| outline(region, &dark, level.width)).collect();
    squares.sort_by(|a, b| b.area.total_cmp(&a.area));
    squares.truncate(limit);
    squares
}

/// Whether each pixel is darker by `difference` than the mean around it.
fn darker_than_surroundings(level: &Level, difference: f64) -> Vec<bool> {
    let (width, height) = (level.width, level.height);
    let reach = (SURROUNDINGS * width.min(height) as f64).ceil() as usize;
    let mut sums = vec![0.0_f64; (width + 1) * (height + 1)];
    for y in 0..height {
        let mut row = 0.0;
        for x in 0..width {
            row += f64::from(level.value(x, y));
            sums[(y + 1) * (width + 1) + x + 1] = sums[y * (width + 1) + x + 1] + row;
        }
    }
    let at = |x: usize, y: usize| sums[y * (width + 1) + x];
    let is_dark = |k: usize| {
        let (x, y) = (k % width, k / width);
        let (x0, x1) = (x.saturating_sub(reach), (x + reach + 1).min(width));
        let (y0, y1) = (y.saturating_sub(reach), (y + reach + 1).min(height));
        let sum = at(x1, y1) - at(x0, y1) - at(x1, y0) + at(x0, y0);
        f64::from(level.value(x, y)) < sum / ((x1 - x0) * (y1 - y0)) as f64 - difference
    };
    (0..width * height).map(is_dark).collect()
}

/// Pixels of each region joined side by side.
fn regions(dark: &[bool], width: usize) -> Vec<Vec<usize>> {
    let mut seen = vec![false; dark.len()];
    let mut all = Vec::new();
    for start in 0..dark.len() {
        if !dark[start] || seen[start] {
            continue;
        }
        seen[start] = true;
        let mut region = vec![start];
        let mut next = 0;
        while next < region.len() {
            for k in neighbours(region[next], dark.len(), width).into_iter().flatten() {
                if dark[k] && !seen[k] {
                    seen[k] = true;
                    region.push(k);
                }
            }
            next += 1;
        }
        all.push(region);
    }
    all
}

fn neighbours(k: usize, count: usize, width: usize) -> [Option<usize>; 4] {
    let x = k % width;
    [
        (x > 0).then(|| k - 1),
        (x + 1 < width).then_some(k + 1),
        k.checked_sub(width),
        (k + width < count).then_some(k + width),
    ]
}

/// The quadrilateral that a region is; `None` where it is another shape or reaches the picture's border.
fn outline(region: &[usize], dark: &[bool], width: usize) -> Option<Square> {
    if region.len() < MIN_AREA {
        return None;
    }
    let mut border = Vec::new();
    for &k in region {
        let around = neighbours(k, dark.len(), width);
        if around.iter().any(Option::is_none) {
            return None;
        }
        if around.iter().flatten().any(|&n| !dark[n]) {
            border.push(Vec2::new((k % width) as f64, (k / width) as f64));
        }
    }
    let farthest = |from: &dyn Fn(&Vec2) -> f64| border.iter().max_by(|p, q| from(p).total_cmp(&from(q))).copied();
    let middle = border.iter().sum::<Vec2>() / border.len() as f64;
    let a = farthest(&|p| (p - middle).norm())?;
    let c = farthest(&|p| (p - a).norm())?;
    let b = farthest(&|p| -(c - a).perp(&(p - a)))?;
    let d = farthest(&|p| (c - a).perp(&(p - a)))?;
    let corners = [a, b, c, d];
    let is_convex = (0..4).all(|k| {
        let [p, q, r] = [corners[k], corners[(k + 1) % 4], corners[(k + 2) % 4]];
        (q - p).perp(&(r - q)) > 0.0
    });
    let doubled = (c - a).perp(&(d - b));
    let perimeter: f64 = (0..4).map(|k| (corners[(k + 1) % 4] - corners[k]).norm()).sum();
    // The corners are pixel centres: half a pixel of the outline lies around them. A mark makes a hole.
    let area = doubled / 2.0 + perimeter / 2.0 + 1.0;
    let hole = std::f64::consts::PI * geometry::Board::MARK_RADIUS.powi(2);
    let filled = region.len() as f64 / area;
    let fits = filled < 1.0 + AREA_TOLERANCE && filled > 1.0 - hole - AREA_TOLERANCE;
    let grown = corners.map(|p| p + (p - middle) * (2.0 / perimeter.max(1.0)) * std::f64::consts::SQRT_2);
    (is_convex && fits).then_some(Square { corners: grown, area })
}

/// The largest lattice of squares `gap` sides apart.
pub(super) fn grow(squares: &[Square], gap: f64, enough: impl Fn(&Lattice) -> bool) -> Option<Lattice> {
    let mut used = vec![false; squares.len()];
    let mut best: Option<Lattice> = None;
    for seed in 0..squares.len() {
        if used[seed] {
            continue;
        }
        let lattice = grown(squares, seed, gap, &mut used);
        if enough(&lattice) {
            return Some(lattice);
        }
        if best.as_ref().is_none_or(|b| lattice.cells.len() > b.cells.len()) {
            best = Some(lattice);
        }
    }
    best
}

fn grown(squares: &[Square], seed: usize, gap: f64, used: &mut [bool]) -> Lattice {
    let mut lattice = Lattice::new(Pattern::Squares { gap }, true, []);
    let mut taken = vec![false; squares.len()];
    let mut frontier = vec![((0, 0), seed)];
    let first = squares[seed].corners[0];
    add(&mut lattice, (0, 0), squares[seed].from(&first));
    (taken[seed], used[seed]) = (true, true);
    while let Some(((i, j), _)) = frontier.pop() {
        for next in [(i + 1, j), (i, j + 1), (i - 1, j), (i, j - 1)] {
            if lattice.cells.contains_key(&(2 * next.0, 2 * next.1)) {
                continue;
            }
            if let Some((k, corners)) = next_square(&lattice, squares, next, &taken) {
                add(&mut lattice, next, corners);
                (taken[k], used[k]) = (true, true);
                // Breadth first: squares far from the seed are predicted from many.
                frontier.insert(0, (next, k));
            }
        }
    }
    lattice
}

fn corner_cells((i, j): Cell) -> [Cell; 4] {
    [(2 * i, 2 * j), (2 * i + 1, 2 * j), (2 * i + 1, 2 * j + 1), (2 * i, 2 * j + 1)]
}

fn add(lattice: &mut Lattice, square: Cell, corners: [Vec2; 4]) {
    lattice.cells.extend(corner_cells(square).into_iter().zip(corners));
}

/// The square at a place of the lattice, its corners in the lattice's order.
fn next_square(lattice: &Lattice, squares: &[Square], place: Cell, taken: &[bool]) -> Option<(usize, [Vec2; 4])> {
    let mut predicted = [Vec2::zeros(); 4];
    for (position, cell) in predicted.iter_mut().zip(corner_cells(place)) {
        *position = lattice.predict(cell)?.position;
    }
    let middle = predicted.iter().sum::<Vec2>() / 4.0;
    let area = (predicted[2] - predicted[0]).perp(&(predicted[3] - predicted[1])) / 2.0;
    let distance = |k: &usize| (squares[*k].middle() - middle).norm();
    let fits = |&k: &usize| {
        let ratio = squares[k].area / area;
        !taken[k]
            && distance(&k) < POSITION_TOLERANCE * squares[k].side()
            && (1.0 / MAX_AREA_RATIO..MAX_AREA_RATIO).contains(&ratio)
    };
    let nearest = (0..squares.len()).filter(fits).min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    Some((nearest, squares[nearest].from(&predicted[0])))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A board of 4×3 squares, side 14 and 14 apart, turned a little, on paper that is darker to the right.
    fn picture() -> Level<'static> {
        let (width, height) = (170, 130);
        let value = |k: usize| {
            let (x, y) = ((k % width) as f64 - 25.0, (k / width) as f64 - 15.0);
            let (u, v) = ((0.98 * x + 0.2 * y) / 14.0, (0.98 * y - 0.2 * x) / 14.0);
            let on_board = (0.0..7.0).contains(&u) && (0.0..5.0).contains(&v);
            let black = on_board && u.rem_euclid(2.0) < 1.0 && v.rem_euclid(2.0) < 1.0;
            (if black { 40.0 } else { 200.0 }) * (1.0 - 0.003 * (x + 25.0)) as f32
        };
        Level::from_values(width, height, (0..width * height).map(value).collect())
    }

    #[test]
    fn all_squares_and_their_lattice_are_found() {
        let squares = find(&picture(), 12.0, 100);
        assert_eq!(squares.len(), 12);
        let lattice = grow(&squares, 1.0, |l| l.cells.len() == 48).unwrap();
        assert_eq!(lattice.cells.len(), 48);
        for (&(i, j), position) in &lattice.cells {
            let right = lattice.cells.get(&(i + 1, j)).map(|p| (p - position).norm());
            assert!(right.is_none_or(|side| (side - 14.0).abs() < 2.0), "{right:?}");
        }
    }

    #[test]
    fn discs_and_regions_at_the_border_are_no_squares() {
        let (width, height) = (80, 60);
        let value = |k: usize| {
            let (x, y) = ((k % width) as f64, (k / width) as f64);
            let disc = (x - 40.0).hypot(y - 30.0) < 10.0;
            if disc || x < 9.0 { 30.0 } else { 200.0 }
        };
        let level = Level::from_values(width, height, (0..width * height).map(value).collect());
        assert!(find(&level, 12.0, 100).is_empty());
    }
}
