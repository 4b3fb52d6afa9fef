//! A smooth field of vectors through scattered values, which fades where there are none.
//!
//! Gaussian process regression with the Matérn kernel of degree 3/2 (Rasmussen and Williams 2006, eq. 4.17) and mean zero: at a place far
//! from every value the field is zero, and nothing grows beyond what was measured, as the affine part of an [`crate::rbf`] warp does.

use crate::Vec3;
use nalgebra::{Cholesky, DMatrix};

/// A fitted field.
#[derive(Clone, Debug)]
pub struct SmoothField {
    length: f64,
    places: Vec<Vec3>,
    /// `n × 3`.
    weights: DMatrix<f64>,
}

impl SmoothField {
    /// Fits the field of `values` at `places` (metres). It forgets them over `length` (metres); `noise` is the variance of a value over
    /// that of the field. `None` for lists of unequal length, for a length or noise that is not positive, and for values that are no numbers.
    pub fn fit(places: &[Vec3], values: &[Vec3], length: f64, noise: f64) -> Option<Self> {
        let numbers = values.iter().chain(places).flatten().all(|x| x.is_finite());
        if places.len() != values.len() || !(length > 0.0 && noise > 0.0 && numbers) {
            return None;
        }
        let n = places.len();
        let own = |i: usize, j: usize| if i == j { noise } else { 0.0 };
        let matrix = DMatrix::from_fn(n, n, |i, j| kernel((places[i] - places[j]).norm(), length) + own(i, j));
        let right = DMatrix::from_fn(n, 3, |i, k| values[i][k]);
        let weights = Cholesky::new(matrix)?.solve(&right);
        Some(Self { length, places: places.to_vec(), weights })
    }

    /// The field at a place.
    pub fn at(&self, place: &Vec3) -> Vec3 {
        let term = |(i, p): (usize, &Vec3)| self.weights.row(i).transpose() * kernel((p - place).norm(), self.length);
        self.places.iter().enumerate().map(term).fold(Vec3::zeros(), |sum, term| sum + term)
    }
}

fn kernel(distance: f64, length: f64) -> f64 {
    let r = 3.0_f64.sqrt() * distance / length;
    (1.0 + r) * (-r).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(p: &Vec3) -> Vec3 {
        Vec3::new(0.003 * (30.0 * p.y).sin(), 0.002, 0.004 * (25.0 * p.x).cos())
    }

    fn sheet() -> Vec<Vec3> {
        let at = |k: usize| Vec3::new((k % 12) as f64 * 0.01, (k / 12) as f64 * 0.01, 0.0);
        (0..144).map(at).collect()
    }

    #[test]
    fn between_values_the_field_is_what_they_say() {
        let places = sheet();
        let values: Vec<Vec3> = places.iter().map(wave).collect();
        let field = SmoothField::fit(&places, &values, 0.05, 1e-4).unwrap();
        for p in [Vec3::new(0.054, 0.047, 0.0), Vec3::new(0.021, 0.088, 0.0)] {
            assert!((field.at(&p) - wave(&p)).norm() < 1e-4, "{}", (field.at(&p) - wave(&p)).norm());
        }
    }

    #[test]
    fn far_from_values_it_fades_and_never_grows() {
        let places = sheet();
        // A slope, which an affine map would continue for ever.
        let values: Vec<Vec3> = places.iter().map(|p| Vec3::new(0.0, 0.0, 0.1 * p.y)).collect();
        let field = SmoothField::fit(&places, &values, 0.05, 1e-4).unwrap();
        let along = |y: f64| field.at(&Vec3::new(0.055, y, 0.0)).z;
        assert!(along(0.13) < 1.2 * along(0.11) && along(0.5).abs() < 1e-3 * along(0.11));
    }

    #[test]
    fn noise_is_smoothed() {
        let places = sheet();
        let noise = |k: usize| 0.001 * if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        let values: Vec<Vec3> = places.iter().enumerate().map(|(k, p)| wave(p) + Vec3::x() * noise(k)).collect();
        let field = SmoothField::fit(&places, &values, 0.05, 0.1).unwrap();
        let error = places.iter().map(|p| (field.at(p) - wave(p)).norm()).sum::<f64>() / places.len() as f64;
        assert!(error < 5e-4, "{error}");
    }

    #[test]
    fn bad_input_gives_no_field() {
        let places = sheet();
        assert!(SmoothField::fit(&places, &places[1..], 0.05, 1e-3).is_none());
        assert!(SmoothField::fit(&places, &places, 0.0, 1e-3).is_none());
        assert!(SmoothField::fit(&places, &places, 0.05, 0.0).is_none());
        assert!(SmoothField::fit(&places, &vec![Vec3::repeat(f64::NAN); 144], 0.05, 1e-3).is_none());
        let none = SmoothField::fit(&[], &[], 0.05, 1e-3).unwrap();
        assert_eq!(none.at(&Vec3::x()), Vec3::zeros());
    }
}
