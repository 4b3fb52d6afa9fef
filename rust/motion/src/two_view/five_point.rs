//! The five-point algorithm (Nistér 2004): essential matrices of five matches by elimination of ten cubic equations.

use crate::polynomial::{add_product, evaluate, real_roots};
use geometry::{Mat3, Vec2};
use nalgebra::SVector;

/// Exponents of x, y, z.
type Monomial = [u8; 3];
const LINEAR: [Monomial; 4] = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]];
const QUADRATIC: [Monomial; 10] =
    [[2, 0, 0], [1, 1, 0], [1, 0, 1], [0, 2, 0], [0, 1, 1], [0, 0, 2], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]];
/// The ten that are eliminated come first; in pairs `x²z x²`, `y²z y²`, `xyz xy` they later give up their z.
#[rustfmt::skip]
const CUBIC: [Monomial; 20] = [
    [3, 0, 0], [0, 3, 0], [2, 1, 0], [1, 2, 0], [2, 0, 1], [2, 0, 0], [0, 2, 1], [0, 2, 0], [1, 1, 1], [1, 1, 0],
    [1, 0, 2], [1, 0, 1], [1, 0, 0], [0, 1, 2], [0, 1, 1], [0, 1, 0], [0, 0, 3], [0, 0, 2], [0, 0, 1], [0, 0, 0],
];
const LINEAR_TIMES_LINEAR: [[usize; 4]; 4] = products(&LINEAR, &QUADRATIC);
const QUADRATIC_TIMES_LINEAR: [[usize; 4]; 10] = products(&QUADRATIC, &CUBIC);

/// Where each product of a monomial and a linear one stands.
const fn products<const N: usize, const M: usize>(left: &[Monomial; N], table: &[Monomial; M]) -> [[usize; 4]; N] {
    let mut places = [[0; 4]; N];
    let mut i = 0;
    while i < N {
        let mut j = 0;
        while j < 4 {
            let mut k = 0;
            while k < M {
                let (l, r, t) = (left[i], LINEAR[j], table[k]);
                if l[0] + r[0] == t[0] && l[1] + r[1] == t[1] && l[2] + r[2] == t[2] {
                    places[i][j] = k;
                }
                k += 1;
            }
            j += 1;
        }
        i += 1;
    }
    places
}

type Linear = [f64; 4];
type Quadratic = [f64; 10];
type Cubic = [f64; 20];
/// Ten cubic equations, one a row.
type Equations = [Cubic; 10];
/// The rows below this one are reduced only as far as the pivots need.
const FIRST_REDUCED: usize = 4;

/// The essential matrices, of norm √2, that satisfy `bᵀ E a = 0` for five matches in normalised coordinates.
///
/// At most ten; none when the matches are degenerate (coinciding points).
pub fn five_point(a: &[Vec2; 5], b: &[Vec2; 5]) -> Vec<Mat3> {
    let Some(basis) = null_space(a, b) else { return Vec::new() };
    let Some(reduced) = eliminate(constraints(&basis)) else { return Vec::new() };
    let rows = [FIRST_REDUCED, 6, 8].map(|row| without_z(&reduced, row));
    real_roots(&determinant(&rows)).into_iter().filter_map(|z| essential_at(&rows, z, &basis)).collect()
}

/// Four orthonormal 9-vectors that every match annihilates, by Householder reflections of the transposed equations.
fn null_space(a: &[Vec2; 5], b: &[Vec2; 5]) -> Option<[SVector<f64, 9>; 4]> {
    let mut columns: [SVector<f64, 9>; 5] = std::array::from_fn(|i| {
        let (a, b) = (a[i].push(1.0), b[i].push(1.0));
        SVector::from_fn(|k, _| b[k / 3] * a[k % 3])
    });
    let mut mirrors = [SVector::<f64, 9>::zeros(); 5];
    for k in 0..5 {
        let mut mirror = columns[k];
        mirror.fixed_rows_mut::<5>(0).rows_mut(0, k).fill(0.0);
        mirror[k] += mirror.norm().copysign(mirror[k]);
        mirrors[k] = mirror.try_normalize(1e-12)?;
        for column in &mut columns[k + 1..] {
            *column -= mirrors[k] * (2.0 * mirrors[k].dot(column));
        }
    }
    Some(std::array::from_fn(|i| {
        let mut unit = SVector::<f64, 9>::zeros();
        unit[5 + i] = 1.0;
        mirrors.iter().rev().fold(unit, |v, mirror| v - mirror * (2.0 * mirror.dot(&v)))
    }))
}

fn add_linear(sum: &mut Quadratic, left: &Linear, right: &Linear, factor: f64) {
    for (i, l) in left.iter().enumerate() {
        for (j, r) in right.iter().enumerate() {
            sum[LINEAR_TIMES_LINEAR[i][j]] += factor * l * r;
        }
    }
}

fn add_quadratic(sum: &mut Cubic, left: &Quadratic, right: &Linear) {
    for (i, l) in left.iter().enumerate() {
        for (j, r) in right.iter().enumerate() {
            sum[QUADRATIC_TIMES_LINEAR[i][j]] += l * r;
        }
    }
}

/// `det E = 0` and `(E Eᵀ - ½ trace(E Eᵀ)) E = 0` with `E = x X + y Y + z Z + W`.
fn constraints(basis: &[SVector<f64, 9>; 4]) -> Equations {
    let e: [[Linear; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| basis.map(|v| v[3 * i + j])));
    let mut rows = [[0.0; 20]; 10];
    for j in 0..3 {
        let (k, l) = ((j + 1) % 3, (j + 2) % 3);
        let mut minor = [0.0; 10];
        add_linear(&mut minor, &e[1][k], &e[2][l], 1.0);
        add_linear(&mut minor, &e[1][l], &e[2][k], -1.0);
        add_quadratic(&mut rows[9], &minor, &e[0][j]);
    }
    let mut gram = [[[0.0; 10]; 3]; 3];
    for i in 0..3 {
        for j in 0..=i {
            for (left, right) in e[i].iter().zip(&e[j]) {
                add_linear(&mut gram[i][j], left, right, 1.0);
            }
            gram[j][i] = gram[i][j];
        }
    }
    let half_trace: Quadratic = std::array::from_fn(|m| 0.5 * (gram[0][0][m] + gram[1][1][m] + gram[2][2][m]));
    for (i, row) in gram.iter_mut().enumerate() {
        row[i].iter_mut().zip(half_trace).for_each(|(g, t)| *g -= t);
        for j in 0..3 {
            for k in 0..3 {
                add_quadratic(&mut rows[3 * i + j], &row[k], &e[k][j]);
            }
        }
    }
    rows
}

/// Gaussian elimination of the first ten columns with row pivots, then upwards to [`FIRST_REDUCED`].
fn eliminate(mut rows: Equations) -> Option<Equations> {
    for k in 0..10 {
        let pivot = (k..10).max_by(|&i, &j| rows[i][k].abs().total_cmp(&rows[j][k].abs()))?;
        if rows[pivot][k].abs() < 1e-14 {
            return None;
        }
        rows.swap(k, pivot);
        let inverse = 1.0 / rows[k][k];
        let row = rows[k].map(|value| value * inverse);
        rows[k] = row;
        for lower in &mut rows[k + 1..] {
            subtract(lower, &row, lower[k]);
        }
    }
    for k in (FIRST_REDUCED + 1..10).rev() {
        let row = rows[k];
        for upper in &mut rows[FIRST_REDUCED..k] {
            subtract(upper, &row, upper[k]);
        }
    }
    Some(rows)
}

fn subtract(from: &mut Cubic, row: &Cubic, factor: f64) {
    from.iter_mut().zip(row).for_each(|(value, other)| *value -= factor * other);
}

/// An equation `x p(z) + y q(z) + r(z) = 0` with `p`, `q` cubic and `r` quartic, ascending.
type Row = [[f64; 5]; 3];

/// Row `m` (led by a monomial times z) less z times row `m + 1` (led by the monomial): no leading monomial is left.
fn without_z(reduced: &Equations, m: usize) -> Row {
    let mut row = [[0.0; 5]; 3];
    for (part, (first, length)) in row.iter_mut().zip([(10, 3), (13, 3), (16, 4)]) {
        for power in 0..length {
            let column = first + length - 1 - power;
            part[power] += reduced[m][column];
            part[power + 1] -= reduced[m + 1][column];
        }
    }
    row
}

/// The tenth-degree determinant of the three equations.
fn determinant(rows: &[Row; 3]) -> [f64; 11] {
    let mut sum = [0.0; 11];
    for j in 0..3 {
        let (k, l) = ((j + 1) % 3, (j + 2) % 3);
        let length = |column: usize| if column == 2 { 5 } else { 4 };
        let mut minor = [0.0; 8];
        let part = |row: usize, column: usize| &rows[row][column][..length(column)];
        add_product(&mut minor, part(1, k), part(2, l), 1.0);
        add_product(&mut minor, part(1, l), part(2, k), -1.0);
        add_product(&mut sum, &minor[..length(k) + length(l) - 1], part(0, j), 1.0);
    }
    sum
}

fn essential_at(rows: &[Row; 3], z: f64, basis: &[SVector<f64, 9>; 4]) -> Option<Mat3> {
    let m = Mat3::from_fn(|i, j| evaluate(&rows[i][j], z));
    let [r0, r1, r2] = [0, 1, 2].map(|i| m.row(i).transpose());
    let null = [r0.cross(&r1), r1.cross(&r2), r2.cross(&r0)]
        .into_iter()
        .max_by(|p, q| p.norm_squared().total_cmp(&q.norm_squared()))?;
    let (x, y) = (null.x / null.z, null.y / null.z);
    let e = basis[0] * x + basis[1] * y + basis[2] * z + basis[3];
    let scale = std::f64::consts::SQRT_2 / e.norm();
    (scale.is_finite() && scale > 0.0).then(|| Mat3::from_fn(|i, j| e[3 * i + j] * scale))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::two_view::essential_of;
    use synthetic::{Scene, SceneOptions};

    fn samples() -> Vec<(Mat3, [Vec2; 5], [Vec2; 5])> {
        (0..60)
            .map(|seed| {
                let options =
                    SceneOptions { seed, noise_px: 0.0, points: 12, min_facing: -1.0, ..SceneOptions::default() };
                let scene = Scene::turning_head(&options);
                let (a, b) = (seed as usize % 30 + 20, seed as usize % 30 + 40);
                let matches = scene.matches(a, b);
                let mut motion = scene.b_from_a(a, b);
                motion.translation.normalize_mut();
                let camera = scene.camera;
                let first = std::array::from_fn(|i| camera.normalise(&matches[i].1));
                let second = std::array::from_fn(|i| camera.normalise(&matches[i].2));
                (essential_of(&motion), first, second)
            })
            .collect()
    }

    #[test]
    fn the_true_matrix_is_among_the_answers_for_a_head_turned_by_20_degrees() {
        let mut found = 0;
        for (truth, a, b) in samples() {
            let error = |e: &Mat3| (e - truth).norm().min((e + truth).norm());
            found += usize::from(five_point(&a, &b).iter().any(|e| error(e) < 1e-5));
        }
        assert!(found >= 58, "{found} of 60");
    }

    #[test]
    fn every_answer_is_an_essential_matrix_of_the_matches() {
        for (_, a, b) in samples() {
            for e in five_point(&a, &b) {
                let gram = e * e.transpose();
                assert!((gram * e - e * (0.5 * gram.trace())).norm() < 1e-4);
                for (a, b) in a.iter().zip(&b) {
                    assert!(b.push(1.0).dot(&(e * a.push(1.0))).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    #[ignore = "a measurement"]
    fn time_of_five_points() {
        let samples = samples();
        let started = crate::two_view::processor_ms();
        let mut answers = 0;
        for _ in 0..500 {
            answers += samples.iter().map(|(_, a, b)| five_point(a, b).len()).sum::<usize>();
        }
        let calls = 500.0 * samples.len() as f64;
        let us = 1e3 * (crate::two_view::processor_ms() - started) / calls;
        println!("{us:.2} us, {:.1} answers", answers as f64 / calls);
    }

    #[test]
    fn coinciding_matches_have_no_answer_and_do_no_harm() {
        let same = [Vec2::new(0.1, 0.2); 5];
        assert!(five_point(&same, &same).iter().all(|e| e.iter().all(|v| v.is_finite())));
    }
}
