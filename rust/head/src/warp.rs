//! The smooth map between two heads of one topology, with its derivative, anywhere near the skin.
//!
//! # Entry point
//! [`LocalWarp`]: moving least squares (Levin 1998) from vertex pairs, degree one: near a place the map is the affine
//! one that fits the pairs there best. Where the pairs lie in a plane, what they leave open comes from the similarity
//! that fits them. Space, not the surface, decides what is near: lips and lids that face each other get one map.

use geometry::{Mat3, Vec3};

/// Usual reach of a vertex pair, metres: an eye's width.
const REACH: f64 = 0.024;
/// Fewest pairs that a map is fitted to.
const LEAST: usize = 12;
/// Pull of the derivative towards the similarity, relative to the pairs' spread.
const STIFFNESS: f64 = 0.02;

/// Vertex pairs with weights, ready for queries.
pub struct LocalWarp<'a> {
    from: &'a [Vec3],
    to: &'a [Vec3],
    weights: &'a [f64],
    reach: f64,
}

/// The warp at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Local {
    /// Where the place goes.
    pub position: Vec3,
    /// Derivative of the map there.
    pub linear: Mat3,
    /// Scale of the best similarity there.
    pub scale: f64,
}

impl<'a> LocalWarp<'a> {
    /// Of pairs `from[i] → to[i]`; pairs of weight zero are left out. The slices must be of one length.
    pub fn new(from: &'a [Vec3], to: &'a [Vec3], weights: &'a [f64]) -> Self {
        Self::with_reach(from, to, weights, REACH)
    }

    /// With another reach of the pairs, metres.
    pub fn with_reach(from: &'a [Vec3], to: &'a [Vec3], weights: &'a [f64], reach: f64) -> Self {
        Self { from, to, weights, reach }
    }

    /// The warp at a place; that of the nearest pairs when none lies within reach.
    pub fn at(&self, place: &Vec3) -> Local {
        let mut reach = self.reach;
        loop {
            let near = self.near(place, reach);
            if near.len() >= LEAST.min(self.from.len()) || reach > 1.0 {
                return self.fit(place, &near);
            }
            reach *= 2.0;
        }
    }

    fn near(&self, place: &Vec3, reach: f64) -> Vec<(usize, f64)> {
        let kernel = |(i, p): (usize, &Vec3)| {
            let t = 1.0 - (p - place).norm_squared() / (reach * reach);
            (t > 0.0 && self.weights[i] > 0.0).then(|| (i, self.weights[i] * t * t * t))
        };
        self.from.iter().enumerate().filter_map(kernel).collect()
    }

    fn fit(&self, place: &Vec3, near: &[(usize, f64)]) -> Local {
        let total: f64 = near.iter().map(|n| n.1).sum();
        if total <= 0.0 {
            return Local { position: *place, linear: Mat3::identity(), scale: 1.0 };
        }
        let mean = |points: &[Vec3]| near.iter().fold(Vec3::zeros(), |sum, &(i, w)| sum + points[i] * w) / total;
        let (centre, image) = (mean(self.from), mean(self.to));
        let (mut spread, mut cross) = (Mat3::zeros(), Mat3::zeros());
        for &(i, w) in near {
            let (a, b) = (self.from[i] - centre, self.to[i] - image);
            spread += a * a.transpose() * (w / total);
            // Displacements rather than positions: equal heads then give exactly the identity.
            cross += (b - a) * a.transpose() * (w / total);
        }
        let trace = spread.trace().max(1e-30);
        let scale = 1.0 + cross.trace() / trace;
        let ridge = Mat3::identity() * (STIFFNESS * trace);
        let wanted = cross + ridge * (scale - 1.0);
        let inverse = (spread + ridge).try_inverse().unwrap_or_else(Mat3::zeros);
        let linear = Mat3::identity() + wanted * inverse;
        Local { position: place + (image - centre) + (linear - Mat3::identity()) * (place - centre), linear, scale }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet() -> Vec<Vec3> {
        let wave = |i: i32, j: i32| 0.004 * (f64::from(i) * 0.7).sin() * (f64::from(j) * 0.5).cos();
        (0..400)
            .map(|k| (k % 20, k / 20))
            .map(|(i, j)| Vec3::new(f64::from(i) * 0.004, f64::from(j) * 0.004, wave(i, j)))
            .collect()
    }

    #[test]
    fn equal_heads_give_exactly_the_identity() {
        let points = sheet();
        let weights = vec![1.0; points.len()];
        let local = LocalWarp::new(&points, &points, &weights).at(&Vec3::new(0.031, 0.042, 0.003));
        assert_eq!((local.linear, local.scale), (Mat3::identity(), 1.0));
        assert_eq!(local.position, Vec3::new(0.031, 0.042, 0.003));
    }

    #[test]
    fn a_similarity_is_found_even_across_a_flat_sheet() {
        let points: Vec<Vec3> = sheet().iter().map(|p| Vec3::new(p.x, p.y, 0.0)).collect();
        let moved: Vec<Vec3> = points.iter().map(|p| p * 1.2 + Vec3::new(0.1, 0.0, 0.0)).collect();
        let weights = vec![1.0; points.len()];
        let local = LocalWarp::new(&points, &moved, &weights).at(&Vec3::new(0.03, 0.03, 0.01));
        assert!((local.linear - Mat3::identity() * 1.2).norm() < 1e-9, "{}", local.linear);
        assert!((local.position - Vec3::new(0.136, 0.036, 0.012)).norm() < 1e-9);
    }

    #[test]
    fn far_places_follow_the_nearest_pairs() {
        let points = sheet();
        let moved: Vec<Vec3> = points.iter().map(|p| p + Vec3::new(0.0, 0.01, 0.0)).collect();
        let weights = vec![1.0; points.len()];
        let local = LocalWarp::new(&points, &moved, &weights).at(&Vec3::new(0.2, 0.0, 0.0));
        assert!((local.position - Vec3::new(0.2, 0.01, 0.0)).norm() < 1e-6);
    }
}
