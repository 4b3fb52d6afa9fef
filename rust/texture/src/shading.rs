//! The light, told from the skin: one log-shading model for all views and one gain per view and channel.
//!
//! The light and the camera stand still while the head turns, so a point of the skin changes its colour with its normal
//! in the *camera's* frame. With `C` the colour of point `p` in view `v`,
//!
//! ```text
//! log C(p, v) = albedo(p) + gain(v) + Σ_k c_k Y_k(R_v n(p))
//! ```
//!
//! with the 15 real spherical harmonics of degree 1…3. The albedo of each point is eliminated, so only its *changes*
//! over the views count; what no view changes (a light that a small turn does not reveal) is held at zero by a weak
//! prior, which also keeps the model smooth. Colours are display-referred: a tone curve that is a power of the light
//! turns gains into gains.
//!
//! Entry points: [`Shading::log_gain`], and `fit` for the bake. Why few harmonics suffice: Ramamoorthi & Hanrahan,
//! An Efficient Representation for Irradiance Environment Maps, 2001.

use geometry::{Transform, Vec3};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Number of harmonics of degree 1…3.
const TERMS: usize = 15;
/// Normals are bent towards the camera until this cosine: beyond it the harmonics would be extrapolated.
const GRAZING: f64 = 0.25;
/// The model brightens or darkens at most by this factor's logarithm.
const LIMIT: f64 = 1.4;

/// The light in which the texture is given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Reference {
    /// The light of the frames as it falls on a head that looks at the camera.
    #[default]
    Frontal,
    /// Even light.
    Even,
}

/// Log-shading by camera-space normal, relative to a reference light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Shading {
    /// Coefficients of the harmonics, per colour channel.
    pub coefficients: [[f64; TERMS]; 3],
    /// The light of the texture.
    pub reference: Reference,
}

impl Shading {
    /// Logarithm of what the texture's colour is multiplied with to look as in a view, per channel.
    ///
    /// `normal_in_head` is a unit vector.
    pub fn log_gain(&self, normal_in_head: &Vec3, cam_from_head: &Transform) -> [f64; 3] {
        let lit = self.log_light(&(cam_from_head.rotation * normal_in_head));
        let reference = match self.reference {
            // The head's axes in a camera it faces: x stays to the right, y turns down, z turns away.
            Reference::Frontal => self.log_light(&Vec3::new(normal_in_head.x, -normal_in_head.y, -normal_in_head.z)),
            Reference::Even => [0.0; 3],
        };
        [0, 1, 2].map(|k| lit[k] - reference[k])
    }

    /// Log-shading of a unit normal in the camera frame.
    fn log_light(&self, normal_in_cam: &Vec3) -> [f64; 3] {
        let basis = harmonics(&facing(normal_in_cam));
        self.coefficients.map(|c| c.iter().zip(&basis).map(|(c, y)| c * y).sum::<f64>().clamp(-LIMIT, LIMIT))
    }
}

/// The normal, turned towards the camera where it looks past it or away.
fn facing(normal_in_cam: &Vec3) -> Vec3 {
    if normal_in_cam.z <= -GRAZING {
        return *normal_in_cam;
    }
    let side = normal_in_cam.xy().try_normalize(1e-9).unwrap_or_default() * (1.0 - GRAZING * GRAZING).sqrt();
    Vec3::new(side.x, side.y, -GRAZING)
}

/// Real spherical harmonics of degree 1, 2, 3, of unit mean square over the sphere.
fn harmonics(n: &Vec3) -> [f64; TERMS] {
    let (x, y, z) = (n.x, n.y, n.z);
    let (a, b, c) = (3f64.sqrt(), 15f64.sqrt(), 105f64.sqrt());
    let (d, e) = ((35f64 / 8.0).sqrt(), (21f64 / 8.0).sqrt());
    [
        a * x,
        a * y,
        a * z,
        b * x * y,
        b * y * z,
        b * x * z,
        b / 2.0 * (x * x - y * y),
        5f64.sqrt() / 2.0 * (3.0 * z * z - 1.0),
        d * y * (3.0 * x * x - y * y),
        c * x * y * z,
        e * y * (5.0 * z * z - 1.0),
        7f64.sqrt() / 2.0 * z * (5.0 * z * z - 3.0),
        e * x * (5.0 * z * z - 1.0),
        c / 2.0 * z * (x * x - y * y),
        d * x * (x * x - 3.0 * y * y),
    ]
}

/// Degree of each harmonic.
fn degree(term: usize) -> f64 {
    [1.0, 2.0, 3.0][usize::from(term >= 3) + usize::from(term >= 8)]
}

/// One point of the skin in one view.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Observation {
    /// Number of the view.
    pub(crate) view: usize,
    /// Unit normal in the camera frame.
    pub(crate) normal_in_cam: Vec3,
    /// Logarithm of the colour.
    pub(crate) log_colour: [f64; 3],
    /// How much it counts, before the loss.
    pub(crate) weight: f64,
}

/// How strongly the fit is held back.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Prior {
    /// Information per observation that pulls a harmonic of degree 1 to zero; degree l is pulled (l (l + 1) / 2)²
    /// times as strongly. A term that varies less than the root of it over the views vanishes.
    pub(crate) shading: f64,
    /// The same for the gains.
    pub(crate) gain: f64,
}

/// A light and the gains of the views.
#[derive(Clone, Debug)]
pub(crate) struct Light {
    coefficients: [[f64; TERMS]; 3],
    /// Log-gain per view and channel.
    pub(crate) gains: Vec<[f64; 3]>,
}

impl Light {
    /// No shading and no gains.
    pub(crate) fn none(views: usize) -> Self {
        Self { coefficients: [[0.0; TERMS]; 3], gains: vec![[0.0; 3]; views] }
    }

    /// The shading relative to a reference.
    pub(crate) fn shading(&self, reference: Reference) -> Shading {
        Shading { coefficients: self.coefficients, reference }
    }

    /// The logarithm of the colour without the light and the view's gain.
    pub(crate) fn log_albedo(&self, o: &Observation) -> [f64; 3] {
        let basis = harmonics(&facing(&o.normal_in_cam));
        [0, 1, 2].map(|k| {
            let light: f64 = self.coefficients[k].iter().zip(&basis).map(|(c, y)| c * y).sum();
            o.log_colour[k] - self.gains[o.view][k] - light.clamp(-LIMIT, LIMIT)
        })
    }
}

/// Fits light and gains to points seen in several views by iteratively re-weighted least squares (Cauchy loss at the
/// median residual); `None` with fewer than 30 such points.
pub(crate) fn fit(points: &[Vec<Observation>], views: usize, prior: &Prior) -> Option<Light> {
    let points: Vec<&[Observation]> = points.iter().map(|p| &p[..]).filter(|p| p.len() > 1).collect();
    if points.len() < 30 {
        return None;
    }
    let mut light = Light::none(views);
    let mut scale = f64::INFINITY;
    for _ in 0..12 {
        let found = solve(&points, &light, scale, views, prior)?;
        let change = (0..3).flat_map(|k| (0..TERMS).map(move |t| (k, t)));
        let change = change.map(|(k, t)| (found.coefficients[k][t] - light.coefficients[k][t]).abs());
        let change = change.fold(0.0, f64::max);
        light = found;
        scale = median_residual(&points, &light).max(0.01);
        if change < 1e-4 {
            break;
        }
    }
    Some(light)
}

/// Mean of the log-albedo over a point's observations.
fn mean_albedo(point: &[Observation], light: &Light, weight: impl Fn(usize) -> f64) -> [f64; 3] {
    let (mut sum, mut total) = ([0.0; 3], f64::MIN_POSITIVE);
    for (i, o) in point.iter().enumerate() {
        let (albedo, w) = (light.log_albedo(o), weight(i));
        total += w;
        (0..3).for_each(|k| sum[k] += w * albedo[k]);
    }
    sum.map(|s| s / total)
}

/// Distance of each observation from its point's mean under a light, root of the channels' sum of squares.
fn residuals(point: &[Observation], light: &Light) -> Vec<f64> {
    let mean = mean_albedo(point, light, |i| point[i].weight);
    let residual = |o: &Observation| {
        let albedo = light.log_albedo(o);
        (0..3).map(|k| (albedo[k] - mean[k]).powi(2)).sum::<f64>().sqrt()
    };
    point.iter().map(residual).collect()
}

fn median_residual(points: &[&[Observation]], light: &Light) -> f64 {
    let mut all: Vec<f64> = points.par_iter().flat_map_iter(|p| residuals(p, light)).collect();
    let middle = all.len() / 2;
    *all.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// One weighted solution: normal equations of the harmonics and gains with every point's albedo eliminated.
fn solve(points: &[&[Observation]], light: &Light, scale: f64, views: usize, prior: &Prior) -> Option<Light> {
    let unknowns = TERMS + views;
    // Chunks of fixed length summed in order: the same bytes on any number of threads.
    let parts: Vec<_> = points
        .par_chunks(256)
        .map(|chunk| {
            let mut part = (DMatrix::zeros(unknowns, unknowns), DMatrix::zeros(unknowns, 3), 0.0);
            chunk.iter().for_each(|point| accumulate(point, light, scale, &mut part));
            part
        })
        .collect();
    let (mut matrix, mut right, mut total) = (DMatrix::zeros(unknowns, unknowns), DMatrix::zeros(unknowns, 3), 0.0);
    for part in parts {
        matrix += part.0;
        right += part.1;
        total += part.2;
    }
    for i in 0..unknowns {
        let precision =
            if i < TERMS { prior.shading * (degree(i) * (degree(i) + 1.0) / 2.0).powi(2) } else { prior.gain };
        matrix[(i, i)] += total * precision;
    }
    let solution = matrix.cholesky()?.solve(&right);
    let mut found = Light::none(views);
    for k in 0..3 {
        (0..TERMS).for_each(|t| found.coefficients[k][t] = solution[(t, k)]);
        (0..views).for_each(|v| found.gains[v][k] = solution[(TERMS + v, k)]);
    }
    solution.iter().all(|x| x.is_finite()).then_some(found)
}

/// Adds a point's `Σ w x̃ x̃ᵀ` and `Σ w x̃ ỹᵀ` (tilde: minus the point's weighted mean) and its weight.
fn accumulate(point: &[Observation], light: &Light, scale: f64, part: &mut (DMatrix<f64>, DMatrix<f64>, f64)) {
    let (matrix, right, total) = part;
    let residuals = residuals(point, light);
    let mut mean_x = DVector::<f64>::zeros(matrix.nrows());
    let (mut mean_y, mut sum) = ([0.0; 3], 0.0);
    for (o, residual) in point.iter().zip(residuals) {
        let w = o.weight / (1.0 + (residual / (2.0 * scale)).powi(2));
        let (basis, gain) = (harmonics(&facing(&o.normal_in_cam)), TERMS + o.view);
        for i in 0..TERMS {
            (0..TERMS).for_each(|j| matrix[(i, j)] += w * basis[i] * basis[j]);
            (0..3).for_each(|k| right[(i, k)] += w * basis[i] * o.log_colour[k]);
            matrix[(i, gain)] += w * basis[i];
            matrix[(gain, i)] += w * basis[i];
            mean_x[i] += w * basis[i];
        }
        matrix[(gain, gain)] += w;
        mean_x[gain] += w;
        (0..3).for_each(|k| right[(gain, k)] += w * o.log_colour[k]);
        (0..3).for_each(|k| mean_y[k] += w * o.log_colour[k]);
        sum += w;
    }
    if sum > 0.0 {
        matrix.ger(-1.0 / sum, &mean_x, &mean_x, 1.0);
        right.ger(-1.0 / sum, &mean_x, &DVector::from_column_slice(&mean_y), 1.0);
        *total += sum;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    const PRIOR: Prior = Prior { shading: 1e-3, gain: 2e-3 };

    fn pose(yaw: f64) -> Transform {
        let frontal = Rotation3::from_euler_angles(std::f64::consts::PI, 0.0, 0.0);
        Transform::new(frontal * Rotation3::from_axis_angle(&Vec3::y_axis(), yaw), Vec3::zeros())
    }

    /// A light of another form than the model: ambient and one lamp, clipped at the terminator.
    fn lamp(n: &Vec3) -> f64 {
        (0.35 + 0.65 * n.dot(&Vec3::new(-0.6, -0.5, -0.62)).max(0.0)).ln()
    }

    fn noise(i: usize) -> f64 {
        ((i as f64 * 12.9898).sin() * 43758.5453).fract() - 0.5
    }

    fn points(yaws: &[f64], outliers: bool) -> Vec<Vec<Observation>> {
        let normal = |i: usize| {
            let (a, b) = (noise(3 * i) * 3.0, noise(3 * i + 1) * 2.4);
            Vec3::new(a.sin() * b.cos(), b.sin(), a.cos() * b.cos())
        };
        let observe = |i: usize, view: usize| {
            let normal_in_cam = pose(yaws[view]).rotation * normal(i);
            let albedo = [noise(7 * i), noise(7 * i) * 0.8, noise(7 * i + 2)];
            let bad = outliers && (i + view).is_multiple_of(6);
            let log_colour = [0, 1, 2].map(|k| {
                let wrong = if bad { -1.0 + 0.3 * albedo[k] } else { albedo[k] + lamp(&normal_in_cam) };
                wrong + 0.02 * noise(31 * i + 5 * view + k) + 0.05 * view as f64 / yaws.len() as f64
            });
            Observation { view, normal_in_cam, log_colour, weight: 1.0 }
        };
        let seen = |o: &Observation| o.normal_in_cam.z < -0.3;
        (0..3000).map(|i| (0..yaws.len()).map(|v| observe(i, v)).filter(seen).collect()).collect()
    }

    fn error(light: &Light, yaw: f64) -> f64 {
        let shading = light.shading(Reference::Frontal);
        let normals = (0..200).map(|i| Vec3::new(noise(i), noise(i + 300), 1.0).normalize());
        let difference = |n: &Vec3| {
            let truth = lamp(&(pose(yaw).rotation * n)) - lamp(&(pose(0.0).rotation * n));
            (shading.log_gain(n, &pose(yaw))[1] - truth).powi(2)
        };
        (normals.map(|n| difference(&n)).sum::<f64>() / 200.0).sqrt()
    }

    #[test]
    fn recovers_the_light_of_a_lamp_from_a_turn() {
        let yaws: Vec<f64> = (-5..=5).map(|i| f64::from(i) * 0.12).collect();
        let without = error(&Light::none(yaws.len()), 0.5);
        let light = fit(&points(&yaws, false), yaws.len(), &PRIOR).unwrap();
        assert!(error(&light, 0.5) < 0.3 * without, "{} of {without}", error(&light, 0.5));
        let light = fit(&points(&yaws, true), yaws.len(), &PRIOR).unwrap();
        assert!(error(&light, 0.5) < 0.4 * without, "{} of {without} with wrong observations", error(&light, 0.5));
    }

    #[test]
    fn a_tiny_turn_reveals_no_light() {
        let light = fit(&points(&[0.0, 0.004], false), 2, &PRIOR).unwrap();
        let shading = light.shading(Reference::Frontal);
        let gain = shading.log_gain(&Vec3::new(0.3, 0.2, 0.93).normalize(), &pose(0.8));
        assert!(gain.iter().all(|g| g.abs() < 0.25), "{gain:?}");
    }

    #[test]
    fn harmonics_have_unit_mean_square() {
        let n = 20_000;
        let mut squares = [0.0; TERMS];
        for i in 0..n {
            let z = 2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0;
            let (angle, r) = (2.399_963_229_728_653 * f64::from(i), (1.0 - z * z).sqrt());
            let y = harmonics(&Vec3::new(r * angle.cos(), r * angle.sin(), z));
            (0..TERMS).for_each(|t| squares[t] += y[t] * y[t] / f64::from(n));
        }
        assert!(squares.iter().all(|s| (s - 1.0).abs() < 1e-3), "{squares:?}");
    }

    #[test]
    fn too_few_points_have_no_light() {
        assert!(fit(&points(&[0.0, 0.2], false)[..20], 2, &PRIOR).is_none());
        assert!(fit(&points(&[0.0], false), 1, &PRIOR).is_none());
    }
}
