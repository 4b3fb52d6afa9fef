//! Who is next to whom before the motion (Delaunay), and where a point's neighbours put it in frame `b`.

use geometry::{Vec2, median};
use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector3};
use spade::{DelaunayTriangulation, Point2, Triangulation};

/// Re-weighted fits of the local affine map.
const FITS: usize = 8;
/// Fewer neighbours than this do not say where a point is.
const FEWEST: usize = 4;
/// The median length of a two-dimensional normal deviate.
pub(super) const MEDIAN_LENGTH: f64 = 1.177_410;
/// Residuals below this are not told apart by the re-weighting, pixels.
const FINEST_PX: f64 = 0.1;

/// A point where it comes from (its place in `a`, or where it was predicted in `b`) and where it is in `b`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Displaced {
    pub from: Vec2,
    pub to: Vec2,
}

/// The Delaunay graph of the points where they come from.
pub(super) struct Graph {
    /// Points that share an edge, or the place, with each point.
    pub first: Vec<Vec<usize>>,
    /// Those and their neighbours.
    pub second: Vec<Vec<usize>>,
    /// Triangles, all turning the same way.
    pub triangles: Vec<[usize; 3]>,
}

impl Graph {
    /// Of all points, those that were not found in `b` too.
    pub fn new(origins: &[Vec2]) -> Self {
        let mut delaunay = DelaunayTriangulation::<Point2<f64>>::new();
        let mut members: Vec<Vec<usize>> = Vec::new();
        for (i, origin) in origins.iter().enumerate() {
            // Insertion fails for numbers that are not finite or absurd; such a point has no neighbours.
            let Ok(vertex) = delaunay.insert(Point2::new(origin.x, origin.y)) else { continue };
            members.resize_with(members.len().max(vertex.index() + 1), Vec::new);
            members[vertex.index()].push(i);
        }
        let mut first = vec![Vec::new(); origins.len()];
        for vertex in delaunay.vertices() {
            let here = &members[vertex.index()];
            let around = vertex.out_edges().flat_map(|edge| &members[edge.to().index()]);
            let mut all: Vec<usize> = here.iter().chain(around).copied().collect();
            all.sort_unstable();
            for &i in here {
                first[i] = all.iter().copied().filter(|&j| j != i).collect();
            }
        }
        let triangle = |corners: [usize; 3]| corners.map(|vertex| members[vertex][0]);
        let triangles =
            delaunay.inner_faces().map(|face| triangle(face.vertices().map(|vertex| vertex.index()))).collect();
        let second = (0..origins.len()).map(|i| within_two(&first, i)).collect();
        Self { first, second, triangles }
    }

    /// Flipped triangles at each point, among the active points: their turn is not the same in `b`, by more than
    /// `tolerance_px` of their height.
    pub fn flips(&self, matches: &[Displaced], active: &[bool], tolerance_px: f64) -> (usize, Vec<usize>) {
        let (mut total, mut flips) = (0, vec![0; matches.len()]);
        for triangle in self.triangles.iter().filter(|triangle| triangle.iter().all(|&i| active[i])) {
            let twice_area = |p: [Vec2; 3]| (p[1] - p[0]).perp(&(p[2] - p[0]));
            let [from, to] = [triangle.map(|i| matches[i].from), triangle.map(|i| matches[i].to)];
            let longest = (0..3).map(|k| (to[k] - to[(k + 1) % 3]).norm()).fold(0.0, f64::max);
            if twice_area(from).signum() * twice_area(to) < -tolerance_px * longest {
                total += 1;
                triangle.iter().for_each(|&i| flips[i] += 1);
            }
        }
        (total, flips)
    }
}

/// Neighbours and their neighbours, sorted.
fn within_two(first: &[Vec<usize>], i: usize) -> Vec<usize> {
    let mut all: Vec<usize> =
        first[i].iter().flat_map(|&j| first[j].iter().chain([j].as_slice()).copied().collect::<Vec<_>>()).collect();
    all.sort_unstable();
    all.dedup();
    all.retain(|&j| j != i);
    all
}

/// Where its neighbours put a point.
pub(super) struct LocalMap {
    /// Position in `b`.
    pub position: Vec2,
    /// Local warp of the displacement.
    pub warp: Matrix2<f64>,
    /// Standard deviation of a residual relative to the neighbours': above one, more so at the rim.
    pub spread: f64,
    /// Median residual of the neighbours themselves, as a standard deviation along an axis: large where the surface
    /// bends, and the map with it.
    pub scale: f64,
}

/// The affine map of the active neighbours around point `i`, by least squares with Cauchy weights whose scale follows
/// the residuals, begun at the median displacement; near neighbours weigh more. `None` with too few of them.
pub(super) fn local_map(i: usize, graph: &Graph, matches: &[Displaced], active: &[bool]) -> Option<LocalMap> {
    let neighbours: Vec<Displaced> = graph.second[i].iter().filter(|&&j| active[j]).map(|&j| matches[j]).collect();
    if neighbours.len() < FEWEST {
        return None;
    }
    let here = matches[i].from;
    let mut distances: Vec<f64> = neighbours.iter().map(|m| (m.from - here).norm()).collect();
    let reach = median(distances.iter().copied()).unwrap_or(0.0).max(1e-6);
    distances.iter_mut().for_each(|d| *d = (-0.5 * (*d / reach).powi(2)).exp());
    let component = |k: usize| median(neighbours.iter().map(|m| m.to[k] - m.from[k])).unwrap_or(0.0);
    let mut coefficients = Matrix3x2::identity();
    coefficients.set_row(0, &nalgebra::RowVector2::new(here.x + component(0), here.y + component(1)));
    coefficients.set_row(1, &nalgebra::RowVector2::new(reach, 0.0));
    coefficients.set_row(2, &nalgebra::RowVector2::new(0.0, reach));
    let regressors: Vec<Vector3<f64>> = neighbours
        .iter()
        .map(|m| Vector3::new(1.0, (m.from.x - here.x) / reach, (m.from.y - here.y) / reach))
        .collect();
    let (mut spread, mut scale) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..FITS {
        let residuals: Vec<f64> =
            neighbours.iter().zip(&regressors).map(|(m, x)| (m.to - coefficients.transpose() * x).norm()).collect();
        scale = (median(residuals.iter().copied()).unwrap_or(0.0) / MEDIAN_LENGTH).max(FINEST_PX);
        let weights = residuals.iter().zip(&distances).map(|(r, d)| d / (1.0 + (r / (2.0 * scale)).powi(2)));
        (coefficients, spread) = fit(&neighbours, &regressors, weights, reach)?;
    }
    let rows = coefficients.fixed_rows::<2>(1).transpose() / reach;
    Some(LocalMap { position: coefficients.row(0).transpose(), warp: rows.into_owned(), spread, scale })
}

/// Weighted least squares of the map's coefficients, and the spread of a residual at the middle. Neighbours in a row
/// leave the map across it free: a little weight holds it to a plain shift.
fn fit(
    neighbours: &[Displaced],
    regressors: &[Vector3<f64>],
    weights: impl Iterator<Item = f64>,
    reach: f64,
) -> Option<(Matrix3x2<f64>, f64)> {
    const HELD: f64 = 1e-3;
    let (mut normal, mut noise, mut right) = (Matrix3::zeros(), Matrix3::zeros(), Matrix3x2::zeros());
    let mut sum = 0.0;
    for ((m, x), weight) in neighbours.iter().zip(regressors).zip(weights) {
        normal += x * x.transpose() * weight;
        noise += x * x.transpose() * (weight * weight);
        right += x * m.to.transpose() * weight;
        sum += weight;
    }
    for k in 0..2 {
        normal[(k + 1, k + 1)] += HELD * sum;
        right[(k + 1, k)] += HELD * sum * reach;
    }
    let inverse = normal.try_inverse()?;
    let variance = (inverse * noise * inverse)[(0, 0)];
    Some((inverse * right, (1.0 + variance).sqrt()))
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::Match;
    use super::*;
    use crate::pyramid::Pyramid;
    use image::{GrayImage, Luma};

    /// An analytic texture moved by `shift`.
    pub fn picture(shift: Vec2) -> Pyramid {
        let grey = |x: u32, y: u32| {
            let at = Vec2::new(f64::from(x), f64::from(y)) - shift;
            let wave = |k: u32| {
                let (length, turn) = (9.0 * 1.3_f64.powi(k as i32), 2.4 * f64::from(k));
                (std::f64::consts::TAU / length * (turn.cos() * at.x + turn.sin() * at.y) + f64::from(k * k)).sin()
            };
            Luma([(125.0 + (0..9).map(|k| 13.0 * wave(k)).sum::<f64>()).round() as u8])
        };
        Pyramid::new(&GrayImage::from_fn(240, 180, grey), 3)
    }

    pub fn row_of_points() -> Vec<Vec2> {
        (0..12).map(|i| Vec2::new(30.0 + 15.0 * f64::from(i), 84.0 + f64::from(i % 3))).collect()
    }

    pub fn displaced(points: &[Vec2], shift: Vec2) -> Vec<Match> {
        points.iter().map(|&a| Match { a, b: a + shift }).collect()
    }

    fn graph_of(matches: &[Displaced]) -> Graph {
        Graph::new(&matches.iter().map(|m| m.from).collect::<Vec<_>>())
    }

    #[test]
    fn the_local_map_is_exact_for_an_affine_field_with_outliers() {
        let warp = Matrix2::new(0.9, 0.1, -0.05, 1.1);
        let mut matches: Vec<Displaced> = (0..49)
            .map(|i| Vec2::new(f64::from(i % 7) * 10.0 + f64::from(i / 7 % 2) * 3.0, f64::from(i / 7) * 9.0))
            .map(|from| Displaced { from, to: warp * from + Vec2::new(4.0, -2.0) })
            .collect();
        for i in [16, 25, 31] {
            matches[i].to += Vec2::new(7.0, -4.0);
        }
        let active = vec![true; matches.len()];
        let graph = graph_of(&matches);
        let map = local_map(24, &graph, &matches, &active).unwrap();
        assert!((map.position - matches[24].to).norm() < 0.05, "{}", (map.position - matches[24].to).norm());
        assert!((map.warp - warp).norm() < 0.02);
    }

    #[test]
    fn points_in_one_place_or_in_a_row_have_neighbours_too() {
        let moved = |from: Vec2| Displaced { from, to: from + Vec2::new(2.0, 1.0) };
        let row = row_of_points();
        let collinear: Vec<Displaced> = row.iter().map(|p| moved(Vec2::new(p.x, 50.0))).collect();
        let twice: Vec<Displaced> = row.iter().chain(&row).map(|p| moved(*p)).collect();
        for matches in [collinear, twice] {
            let active = vec![true; matches.len()];
            let graph = graph_of(&matches);
            assert!((0..matches.len()).all(|i| !graph.first[i].is_empty() && !graph.first[i].contains(&i)));
            assert!(local_map(5, &graph, &matches, &active).is_some());
        }
    }
}
