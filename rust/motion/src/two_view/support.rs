//! Whether a match moves along its epipolar line as some of its neighbours do: what the distance from the line cannot tell.
//!
//! Points near each other lie at similar depths, but for the edges of things. A wrong match that happens to lie on its line
//! is given away by its parallax, to which none of its neighbours comes near.

use geometry::{Transform, Vec2};

/// At least this many neighbours are considered, where there are as many.
const NEIGHBOURS: usize = 8;
/// The neighbour whose parallax is the so-manieth nearest decides: one may be wrong itself.
const DECIDING: usize = 1;
/// A factor beyond this makes no difference.
const MOST: f64 = 1e6;

/// For each match the density of wrong ones over that of right ones, by the parallax of its neighbours: one where nothing is
/// known.
///
/// `inliers`: matches that agree with the motion, which alone are compared; `reach`: parallaxes of wrong matches differ by so
/// much (normalised units).
pub(super) fn factors(a: &[Vec2], b: &[Vec2], b_from_a: &Transform, inliers: &[bool], reach: f64) -> Vec<f64> {
    let chosen: Vec<usize> = (0..a.len()).filter(|&i| inliers[i]).collect();
    let mut factors = vec![1.0; a.len()];
    if chosen.len() <= NEIGHBOURS {
        return factors;
    }
    let places: Vec<Vec2> = chosen.iter().map(|&i| a[i]).collect();
    let parallaxes: Vec<f64> = chosen.iter().map(|&i| parallax(b_from_a, &a[i], &b[i])).collect();
    let grid = Grid::new(&places);
    let mut near = Vec::new();
    let differences: Vec<f64> = (0..chosen.len())
        .map(|i| {
            grid.nearest(&places, i, &mut near);
            let mut apart: Vec<f64> = near.iter().map(|&(_, j)| (parallaxes[i] - parallaxes[j]).abs()).collect();
            apart.sort_by(f64::total_cmp);
            apart.get(DECIDING).copied().unwrap_or(0.0)
        })
        .collect();
    let mut sorted = differences.clone();
    sorted.sort_by(f64::total_cmp);
    // The mean of an exponential distribution by its median: the few wrong ones do not count.
    let usual = (sorted[sorted.len() / 2] / std::f64::consts::LN_2).max(1e-9);
    for (&i, difference) in chosen.iter().zip(&differences) {
        factors[i] = (usual / reach * (difference / usual).exp()).min(MOST);
    }
    factors
}

/// How far a match has moved along its epipolar line from where a point at infinity would be, normalised units.
fn parallax(b_from_a: &Transform, a: &Vec2, b: &Vec2) -> f64 {
    let (far, t) = (b_from_a.rotation * a.push(1.0), &b_from_a.translation);
    let far = far.xy() / far.z;
    let along = (t.xy() - far * t.z).try_normalize(1e-12).unwrap_or_else(Vec2::zeros);
    (b - far).dot(&along)
}

/// Places sorted into square cells.
struct Grid {
    cells: Vec<Vec<usize>>,
    columns: usize,
    rows: usize,
    low: Vec2,
    size: f64,
}

impl Grid {
    /// Cells that hold about three places each.
    fn new(places: &[Vec2]) -> Self {
        let low = places.iter().fold(Vec2::repeat(f64::INFINITY), |low, p| low.inf(p));
        let high = places.iter().fold(Vec2::repeat(f64::NEG_INFINITY), |high, p| high.sup(p));
        let extent = (high - low).map(|v| v.max(1e-9));
        let size = (3.0 * extent.x * extent.y / places.len() as f64).sqrt().max(extent.max() / 64.0);
        let [columns, rows] = [extent.x, extent.y].map(|length| (length / size) as usize + 1);
        let mut grid = Self { cells: vec![Vec::new(); columns * rows], columns, rows, low, size };
        for (i, place) in places.iter().enumerate() {
            let (column, row) = grid.cell(place);
            grid.cells[row * columns + column].push(i);
        }
        grid
    }

    fn cell(&self, place: &Vec2) -> (usize, usize) {
        let at = (place - self.low) / self.size;
        ((at.x as usize).min(self.columns - 1), (at.y as usize).min(self.rows - 1))
    }

    /// The places nearest to one of them, with squared distances; rings of cells are added until there are enough.
    fn nearest(&self, places: &[Vec2], of: usize, near: &mut Vec<(f64, usize)>) {
        let (column, row) = self.cell(&places[of]);
        for ring in 1..self.columns.max(self.rows).max(2) {
            near.clear();
            for y in row.saturating_sub(ring)..=(row + ring).min(self.rows - 1) {
                for x in column.saturating_sub(ring)..=(column + ring).min(self.columns - 1) {
                    let others = self.cells[y * self.columns + x].iter().filter(|&&i| i != of);
                    near.extend(others.map(|&i| ((places[i] - places[of]).norm_squared(), i)));
                }
            }
            if near.len() >= NEIGHBOURS {
                break;
            }
        }
        if near.len() > NEIGHBOURS {
            near.select_nth_unstable_by(NEIGHBOURS, |p, q| p.0.total_cmp(&q.0).then(p.1.cmp(&q.1)));
            near.truncate(NEIGHBOURS);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::Vec3;
    use nalgebra::Rotation3;
    use synthetic::Random;

    #[test]
    fn a_match_that_slid_along_its_line_is_given_away_and_the_edges_of_things_are_not() {
        let motion = Transform::new(Rotation3::identity(), Vec3::new(-0.2, 0.0, 0.0));
        let mut random = Random::new(1);
        let a: Vec<Vec2> = (0..150).map(|_| Vec2::new(random.between(-0.3, 0.3), random.between(-0.2, 0.2))).collect();
        // A near thing before a far wall.
        let depth = |p: &Vec2| if p.norm() < 0.12 { 1.0 } else { 3.0 };
        let see = |p: &Vec2| p + Vec2::new(-0.2 / depth(p), 0.0) + random.normal2(4e-4);
        let mut b: Vec<Vec2> = a.iter().map(see).collect();
        let slid = [3, 40, 77];
        slid.iter().for_each(|&i| b[i].x -= 0.03);
        let found = factors(&a, &b, &motion, &[true; 150], 0.05);
        assert!(slid.iter().all(|&i| found[i] > 1e3));
        let blamed = (0..150).filter(|i| !slid.contains(i) && found[*i] > 1e3).count();
        assert!(blamed <= 3, "{blamed}");
    }

    #[test]
    fn places_on_a_line_or_all_the_same_have_neighbours() {
        for step in [0.0, 0.01] {
            let places: Vec<Vec2> = (0..30).map(|i| Vec2::new(step * f64::from(i), 0.0)).collect();
            let (grid, mut near) = (Grid::new(&places), Vec::new());
            grid.nearest(&places, 4, &mut near);
            assert_eq!(near.len(), NEIGHBOURS);
            assert!(near.iter().all(|(squared, _)| *squared <= (8.0 * step).powi(2) + 1e-12));
        }
    }
}
