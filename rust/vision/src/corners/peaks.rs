//! Peaks of the score, in the order in which they are taken: heaps give them one by one, so that those which nobody
//! asks for are never sorted.

use super::tiles::Tile;
use geometry::Vec2;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// A pixel with a score no less than those around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Peak {
    /// Number of the pixel in reading order.
    pub at: usize,
    pub score: f32,
    /// Scores to the left and the right.
    pub along_x: [f32; 2],
    /// Scores above and below.
    pub along_y: [f32; 2],
}

impl Peak {
    /// To a fraction of a pixel.
    pub fn position(&self, width: usize) -> Vec2 {
        let offset = [self.along_x, self.along_y].map(|[before, after]| parabola_peak(before, self.score, after));
        Vec2::new((self.at % width) as f64, (self.at / width) as f64) + Vec2::from(offset)
    }
}

/// The better one is greater; among equals the upper, then the left one.
impl Ord for Peak {
    fn cmp(&self, other: &Self) -> Ordering {
        self.score.total_cmp(&other.score).then(other.at.cmp(&self.at))
    }
}

impl PartialOrd for Peak {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Eq for Peak {}

/// Where the parabola through three values at −1, 0 and 1 peaks, given that the middle one is not the smallest.
fn parabola_peak(before: f32, here: f32, after: f32) -> f64 {
    let curvature = before - 2.0 * here + after;
    if curvature >= 0.0 { 0.0 } else { f64::from(0.5 * (before - after) / curvature).clamp(-0.5, 0.5) }
}

/// Tells which peaks are good enough, given those seen so far.
#[derive(Clone, Copy)]
pub(super) struct Threshold {
    min_score: f64,
    quality: f64,
    strongest: f64,
}

impl Threshold {
    pub fn new(min_score: f64, quality: f64) -> Self {
        Self { min_score, quality, strongest: 0.0 }
    }

    /// The limit, rounded down.
    pub fn least(&self) -> f32 {
        (self.min_score.max(self.quality * self.strongest) as f32).next_down()
    }

    /// Whether a peak's score is good enough beside the strongest so far, itself included.
    pub fn admits(&mut self, score: f32) -> bool {
        let score = f64::from(score);
        self.strongest = self.strongest.max(score);
        score >= self.min_score && score >= self.quality * self.strongest
    }
}

/// All peaks, best first.
pub(super) fn by_score(peaks: Vec<Peak>) -> impl Iterator<Item = Peak> {
    let mut heap = BinaryHeap::from(peaks);
    std::iter::from_fn(move || heap.pop())
}

/// The best of each cell of a grid of square cells, best first, then the second best of each cell, and so on.
pub(super) fn by_rounds(peaks: Vec<Peak>, bounds: Tile, width: usize, cell: f64) -> impl Iterator<Item = Peak> {
    let cell_of = |x: f64| (x / cell) as usize;
    // A peak is at most half a pixel beside its pixel.
    let cells = |from: usize, size: usize| {
        let first = cell_of(from as f64 - 0.5);
        (first, cell_of((from + size) as f64 + 0.5) - first + 1)
    };
    let ((left, columns), (top, rows)) = (cells(bounds.left, bounds.width), cells(bounds.top, bounds.height));
    let mut cells = vec![Vec::new(); columns * rows];
    for peak in peaks {
        let position = peak.position(width);
        cells[(cell_of(position.y) - top) * columns + cell_of(position.x) - left].push(peak);
    }
    let mut heaps: Vec<BinaryHeap<Peak>> = cells.into_iter().map(BinaryHeap::from).collect();
    let round = move || {
        heaps.retain(|heap| !heap.is_empty());
        let mut best: Vec<Peak> = heaps.iter_mut().filter_map(BinaryHeap::pop).collect();
        best.sort_unstable_by(|a, b| b.cmp(a));
        (!best.is_empty()).then_some(best)
    };
    std::iter::from_fn(round).flatten()
}

/// Takes peaks in order, at most `count`, leaving out those closer than `distance` to one taken before.
pub(super) fn spaced(
    peaks: impl Iterator<Item = Peak>,
    bounds: Tile,
    width: usize,
    count: usize,
    distance: f64,
) -> Vec<(Vec2, f64)> {
    let mut taken = Taken::new(bounds, distance);
    let mut chosen = Vec::new();
    for peak in peaks.take(if count == 0 { 0 } else { usize::MAX }) {
        let position = peak.position(width);
        if taken.add(&position) {
            chosen.push((position, f64::from(peak.score)));
            if chosen.len() == count {
                break;
            }
        }
    }
    chosen
}

/// Positions in the cells of a grid, each as wide as the least distance; the cells along the edge stay empty.
struct Taken {
    distance: f64,
    cell: f64,
    origin: Vec2,
    columns: usize,
    /// Number of the last position of each cell, plus one.
    last: Vec<u32>,
    /// Positions, each with the one before it in its cell, told in the same way.
    positions: Vec<(Vec2, u32)>,
}

impl Taken {
    fn new(bounds: Tile, distance: f64) -> Self {
        let cell = distance.max(1.0);
        let cells = |size: usize| (size as f64 / cell) as usize + 3;
        let (columns, rows) = (cells(bounds.width), cells(bounds.height));
        let origin = Vec2::new(bounds.left as f64, bounds.top as f64);
        Self { distance, cell, origin, columns, last: vec![0; columns * rows], positions: Vec::new() }
    }

    /// Adds a position unless another one is too near; tells whether it was added.
    fn add(&mut self, position: &Vec2) -> bool {
        let cell = (position - self.origin).map(|x| (x.max(0.0) / self.cell) as usize + 1);
        let around = (cell.y - 1..=cell.y + 1).flat_map(|y| &self.last[y * self.columns + cell.x - 1..][..3]);
        for &last in around {
            let mut next = last;
            while let Some((other, before)) = (next as usize).checked_sub(1).map(|k| self.positions[k]) {
                if (other - position).norm() < self.distance {
                    return false;
                }
                next = before;
            }
        }
        let last = &mut self.last[cell.y * self.columns + cell.x];
        self.positions.push((*position, *last));
        *last = self.positions.len() as u32;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 90;
    const BOUNDS: Tile = Tile { left: 10, top: 5, width: 70, height: 50 };

    /// Peaks on every third pixel; many have equal scores.
    fn peaks() -> Vec<Peak> {
        let pixels = (5..55).step_by(3).flat_map(|y| (10..80).step_by(3).map(move |x| y * WIDTH + x));
        let score = |at: usize| (at.wrapping_mul(2_654_435_761) >> 9) as u8 as f32 / 8.0;
        let peak = |at: usize| {
            let score = score(at).floor();
            Peak { at, score, along_x: [score - 1.0, score - 2.0], along_y: [score - 3.0, score - 1.0] }
        };
        pixels.map(peak).collect()
    }

    #[test]
    fn heaps_give_the_order_of_a_stable_sort() {
        let mut sorted = peaks();
        sorted.sort_by(|a, b| b.score.total_cmp(&a.score));
        assert_eq!(by_score(peaks()).collect::<Vec<_>>(), sorted);
        let cell_of = |peak: &Peak| {
            let position = peak.position(WIDTH);
            ((position.y / 8.0) as usize, (position.x / 8.0) as usize)
        };
        let mut taken = std::collections::BTreeMap::new();
        let round = |peak: &Peak| {
            let count = taken.entry(cell_of(peak)).or_insert(0);
            *count += 1;
            *count
        };
        let rounds: Vec<usize> = sorted.iter().map(round).collect();
        let mut ranked: Vec<_> = rounds.into_iter().zip(sorted).collect();
        ranked.sort_by_key(|(round, _)| *round);
        let ranked: Vec<Peak> = ranked.into_iter().map(|(_, peak)| peak).collect();
        assert_eq!(by_rounds(peaks(), BOUNDS, WIDTH, 8.0).collect::<Vec<_>>(), ranked);
    }

    #[test]
    fn what_is_spaced_is_what_comparing_with_all_gives() {
        for distance in [0.0, 0.5, 4.0, 7.3] {
            let mut expected: Vec<Vec2> = Vec::new();
            for peak in by_score(peaks()) {
                let position = peak.position(WIDTH);
                if expected.len() < 60 && expected.iter().all(|other| (other - position).norm() >= distance) {
                    expected.push(position);
                }
            }
            let found = spaced(by_score(peaks()), BOUNDS, WIDTH, 60, distance);
            assert_eq!(found.iter().map(|(position, _)| *position).collect::<Vec<_>>(), expected);
        }
        assert!(spaced(by_score(peaks()), BOUNDS, WIDTH, 0, 3.0).is_empty());
    }
}
