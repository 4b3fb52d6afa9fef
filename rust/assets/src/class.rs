//! A linear class of heads from many samples: generalised Procrustes analysis, then principal components.
//!
//! # Entry points
//! [`learn`]; [`Class`].
//!
//! # Method
//! Samples are aligned by similarities, so that neither place, turn nor size of a head is part of its identity. Each sample
//! counts together with its mirror image: the mean is symmetric and every component is symmetric or antisymmetric, so both
//! halves are decomposed apart, by subspace iteration with a fixed start (Halko, Martinsson and Tropp 2011).

use crate::random::Random;
use crate::symmetry::reflect;
use anyhow::Context;
use geometry::{Similarity, Vec3};
use nalgebra::{DMatrix, SymmetricEigen};
use rayon::prelude::*;

/// Extra directions of the subspace, and how often it is iterated.
const OVERSAMPLING: usize = 30;
const ITERATIONS: usize = 4;
/// Rows of one parallel task: fixed, so that the sums do not depend on the number of threads.
const BLOCK: usize = 1024;

/// What [`learn`] looks at.
pub struct ClassInput<'a> {
    /// Samples: positions of all vertices, any unit, any pose.
    pub samples: Vec<Vec<Vec3>>,
    /// First guess of the mean: symmetric.
    pub reference: &'a [Vec3],
    /// The vertex on the other side.
    pub mirror: &'a [u32],
    /// How much each vertex counts in the alignment.
    pub alignment: &'a [f64],
    /// How much each vertex counts in the components.
    pub importance: &'a [f64],
    /// Number of components.
    pub components: usize,
}

/// A mean and its components.
pub struct Class {
    /// Mean positions, symmetric.
    pub mean: Vec<Vec3>,
    /// `components × n` offsets per standard deviation, largest first; of each, the largest coordinate is positive.
    pub basis: Vec<Vec<Vec3>>,
}

/// Learns a linear class.
///
/// # Errors
/// When a sample is degenerate or there are fewer samples than components.
pub fn learn(input: ClassInput) -> anyhow::Result<Class> {
    let ClassInput { mut samples, reference, mirror, alignment, importance, components } = input;
    let mut mean = reference.to_vec();
    for _ in 0..2 {
        samples.par_iter_mut().try_for_each(|sample| align(sample, &mean, alignment))?;
        mean = symmetric_mean(&samples, mirror);
    }
    let [even, odd] = [1.0, -1.0].map(|sign| half(&samples, &mean, mirror, sign));
    let mut found = principal_components(&even, importance, components)?;
    found.extend(principal_components(&odd, importance, components)?);
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.truncate(components);
    Ok(Class { mean, basis: found.into_iter().map(|(_, offsets)| offsets).collect() })
}

fn align(sample: &mut [Vec3], mean: &[Vec3], weights: &[f64]) -> anyhow::Result<()> {
    let similarity = Similarity::fit(sample, mean, Some(weights), true).context("a sample has no shape")?;
    sample.iter_mut().for_each(|p| *p = similarity.apply(p));
    Ok(())
}

fn symmetric_mean(samples: &[Vec<Vec3>], mirror: &[u32]) -> Vec<Vec3> {
    let mut mean = vec![Vec3::zeros(); mirror.len()];
    for sample in samples {
        mean.iter_mut().zip(sample).for_each(|(m, p)| *m += p / samples.len() as f64);
    }
    let reflected = reflect(&mean, mirror);
    mean.iter().zip(&reflected).map(|(a, b)| (a + b) / 2.0).collect()
}

/// Deviations from the mean, one sample a column, averaged with (`sign` 1) or against (`sign` −1) their mirror images.
fn half(samples: &[Vec<Vec3>], mean: &[Vec3], mirror: &[u32], sign: f64) -> DMatrix<f32> {
    let column = |sample: &Vec<Vec3>| -> Vec<f32> {
        let deviation: Vec<Vec3> = sample.iter().zip(mean).map(|(p, m)| p - m).collect();
        let reflected = reflect(&deviation, mirror);
        deviation.iter().zip(&reflected).flat_map(|(d, r)| ((d + r * sign) / 2.0).map(|x| x as f32).data.0[0]).collect()
    };
    let columns: Vec<Vec<f32>> = samples.par_iter().map(column).collect();
    DMatrix::from_vec(3 * mean.len(), samples.len(), columns.concat())
}

/// The first components of zero-mean columns: deviation in the weighted metric, offsets per standard deviation.
fn principal_components(
    data: &DMatrix<f32>,
    importance: &[f64],
    components: usize,
) -> anyhow::Result<Vec<(f64, Vec<Vec3>)>> {
    let count = data.ncols();
    let rank = (components + OVERSAMPLING).min(count);
    anyhow::ensure!(components <= count, "{count} samples cannot make {components} components");
    let squares: Vec<f64> = importance.iter().flat_map(|w| [*w; 3]).collect();
    let mut random = Random::new(0, 0);
    let mut scores = DMatrix::from_fn(count, rank, |_, _| random.normal(0.0, 1.0));
    for _ in 0..ITERATIONS {
        orthonormalise(&mut scores)?;
        scores = transposed_times(data, &weighted(times(data, &scores), &squares));
    }
    orthonormalise(&mut scores)?;
    // Rayleigh–Ritz: the Gram matrix of the samples within the subspace.
    let projected = times(data, &scores);
    let gram = projected.transpose() * weighted(projected.clone(), &squares);
    let eigen = SymmetricEigen::new((&gram + gram.transpose()) * 0.5);
    let mut order: Vec<usize> = (0..rank).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let scale = 1.0 / (count as f64).sqrt();
    let component = |&i: &usize| {
        let offsets = &projected * eigen.eigenvectors.column(i) * scale;
        let largest = offsets.iter().fold(0.0_f64, |m, &x| if x.abs() > m.abs() + 1e-9 { x } else { m });
        let vectors = offsets.as_slice().chunks_exact(3).map(|d| Vec3::new(d[0], d[1], d[2]) * largest.signum());
        (eigen.eigenvalues[i].max(0.0).sqrt() * scale, vectors.collect())
    };
    Ok(order.iter().take(components).map(component).collect())
}

/// `data · right`, in parallel over rows.
fn times(data: &DMatrix<f32>, right: &DMatrix<f64>) -> DMatrix<f64> {
    let right: DMatrix<f32> = right.map(|x| x as f32);
    let blocks: Vec<DMatrix<f32>> = (0..data.nrows().div_ceil(BLOCK))
        .into_par_iter()
        .map(|b| data.rows(b * BLOCK, BLOCK.min(data.nrows() - b * BLOCK)) * &right)
        .collect();
    DMatrix::from_fn(data.nrows(), right.ncols(), |i, j| f64::from(blocks[i / BLOCK][(i % BLOCK, j)]))
}

/// `dataᵀ · right`, in parallel over columns of `data`.
fn transposed_times(data: &DMatrix<f32>, right: &DMatrix<f64>) -> DMatrix<f64> {
    let right: DMatrix<f32> = right.map(|x| x as f32);
    let width = BLOCK / 4;
    let blocks: Vec<DMatrix<f32>> = (0..data.ncols().div_ceil(width))
        .into_par_iter()
        .map(|b| data.columns(b * width, width.min(data.ncols() - b * width)).transpose() * &right)
        .collect();
    DMatrix::from_fn(data.ncols(), right.ncols(), |i, j| f64::from(blocks[i / width][(i % width, j)]))
}

fn weighted(mut matrix: DMatrix<f64>, weights: &[f64]) -> DMatrix<f64> {
    for mut column in matrix.column_iter_mut() {
        column.iter_mut().zip(weights).for_each(|(x, w)| *x *= w);
    }
    matrix
}

/// Gram–Schmidt by Cholesky, twice (CholeskyQR2).
fn orthonormalise(matrix: &mut DMatrix<f64>) -> anyhow::Result<()> {
    for _ in 0..2 {
        let mut gram = matrix.tr_mul(matrix);
        let floor = gram.diagonal().max() * 1e-14;
        (0..gram.nrows()).for_each(|i| gram[(i, i)] += floor);
        let factor = gram.cholesky().context("the samples do not differ")?.l();
        let mut transposed = matrix.transpose();
        factor.solve_lower_triangular_mut(&mut transposed);
        *matrix = transposed.transpose();
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    /// A lattice symmetric in x, and its mirror map.
    fn lattice() -> (Vec<Vec3>, Vec<u32>) {
        let point = |i: u32| Vec3::new(f64::from(i % 4) - 1.5, f64::from(i / 4 % 4), (1.3 * f64::from(i / 4)).sin());
        ((0..64).map(point).collect(), (0..64).map(|i| i / 4 * 4 + 3 - i % 4).collect())
    }

    /// Two modes, one symmetric, one not, of deviations 0.05 and 0.02, in any pose.
    fn samples(count: u64) -> Vec<Vec<Vec3>> {
        let (lattice, _) = lattice();
        let one = |k: u64| {
            let mut random = Random::new(5, k);
            let (a, b) = (random.normal(0.0, 0.05), random.normal(0.0, 0.02));
            let turn = Rotation3::new(Vec3::new(random.uniform(), random.uniform(), 0.3));
            let bend = |p: &Vec3| {
                p + Vec3::new(0.0, 0.0, (2.0 * p.y).cos()) * a + Vec3::new(0.0, 0.0, p.x.powi(3) - 2.05 * p.x) * b
            };
            lattice.iter().map(|p| turn * bend(p) * (1.0 + random_scale(k)) + Vec3::new(3.0, 0.0, 1.0)).collect()
        };
        (0..count).map(one).collect()
    }

    fn random_scale(k: u64) -> f64 {
        0.3 * Random::new(6, k).uniform()
    }

    fn class(components: usize) -> Class {
        let (reference, mirror) = lattice();
        let ones = vec![1.0; 64];
        let samples = samples(200);
        let input = ClassInput {
            samples,
            reference: &reference,
            mirror: &mirror,
            alignment: &ones,
            importance: &ones,
            components,
        };
        learn(input).unwrap()
    }

    #[test]
    fn two_modes_are_found_in_any_pose() {
        let class = class(4);
        let size = |k: usize| class.basis[k].iter().map(|d| d.norm_squared()).sum::<f64>().sqrt();
        assert!(size(1) > 10.0 * size(2), "{} {} {}", size(0), size(1), size(2));
        let (_, mirror) = lattice();
        for (component, sign) in [(0, 1.0), (1, -1.0)] {
            let reflected = reflect(&class.basis[component], &mirror);
            let worst =
                reflected.iter().zip(&class.basis[component]).map(|(r, d)| (r * sign - d).norm()).fold(0.0, f64::max);
            assert!(worst < 1e-5, "component {component} is neither even nor odd: {worst}");
        }
    }

    #[test]
    fn coefficients_have_unit_deviation() {
        let class = class(2);
        let size: f64 = class.basis[0].iter().map(|d| d.z * d.z).sum::<f64>().sqrt();
        let (lattice, _) = lattice();
        let shape: Vec<f64> = lattice.iter().map(|p| (2.0 * p.y).cos()).collect();
        let mean = shape.iter().sum::<f64>() / 64.0;
        let expected = 0.05 * shape.iter().map(|s| (s - mean).powi(2)).sum::<f64>().sqrt();
        assert!((size / expected - 1.0).abs() < 0.2, "{size} {expected}");
    }

    #[test]
    fn too_few_samples_are_refused() {
        let (reference, mirror) = lattice();
        let ones = vec![1.0; 64];
        let input = ClassInput {
            samples: samples(3),
            reference: &reference,
            mirror: &mirror,
            alignment: &ones,
            importance: &ones,
            components: 10,
        };
        assert!(learn(input).is_err());
    }
}
