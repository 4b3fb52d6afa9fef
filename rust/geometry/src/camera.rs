//! Pinhole camera with a lens that distorts: the paper's two radial terms (section 2.2), and if need be a third one and
//! the two tangential ones of Brown 1966.

use crate::{Vec2, Vec3};
use nalgebra::{Matrix2, Matrix2x3, SMatrix};
use serde::{Deserialize, Serialize};

/// Newton's method on a lens takes 3 to 6 steps; one that takes more is not on its way.
const MAX_NEWTON_STEPS: usize = 20;
/// Newton's last step, in normalised coordinates: what is left is of the order of its square.
const NEWTON_TOLERANCE: f64 = 1e-9;

/// A camera whose numbers make no sense.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CameraError {
    /// Width, height or focal length is not positive and finite.
    #[error("the camera's {name} is {value}, which no camera has: calibrate again or correct camera.json")]
    Impossible {
        /// Which number.
        name: &'static str,
        /// Its value.
        value: f64,
    },
}

/// A pinhole camera with a lens.
///
/// With `x = X/Z, y = Y/Z, r² = x² + y²` of a point in the camera frame and `ρ = 1 + k1 r² + k2 r⁴ + k3 r⁶`, the pixel is
/// `u = fx (x ρ + 2 p1 x y + p2 (r² + 2 x²)) + cx`, `v = fy (y ρ + p1 (r² + 2 y²) + 2 p2 x y) + cy`; pixel centres are at
/// integers. The paper's lens has `k3 = p1 = p2 = 0`; these are left out of files when they are zero.
///
/// A polynomial lens folds the picture over at some distance from its middle. What lies beyond is not seen:
/// [`Camera::project`] and [`Camera::try_normalise`] have no answer there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Picture width, pixels.
    pub width: u32,
    /// Picture height, pixels.
    pub height: u32,
    /// Focal length along x, pixels.
    pub fx: f64,
    /// Focal length along y, pixels.
    pub fy: f64,
    /// Principal point, pixels from the centre of the top left pixel.
    pub cx: f64,
    /// Principal point, pixels from the centre of the top left pixel.
    pub cy: f64,
    /// First radial coefficient.
    #[serde(default)]
    pub k1: f64,
    /// Second radial coefficient.
    #[serde(default)]
    pub k2: f64,
    /// Third radial coefficient.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub k3: f64,
    /// First tangential coefficient: the lens leans up or down.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub p1: f64,
    /// Second tangential coefficient: the lens leans to a side.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub p2: f64,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// Derivatives of a pixel: by the point in the camera frame and by `[fx, fy, cx, cy, k1, k2, k3, p1, p2]`.
pub struct CameraJacobian {
    /// Pixels per metre, 2×3.
    pub point: Matrix2x3<f64>,
    /// Pixels per unit of each intrinsic parameter, 2×9.
    pub intrinsics: SMatrix<f64, 2, 9>,
}

impl Camera {
    /// An undistorted camera with square pixels and a centred principal point; `focal` in pixels.
    ///
    /// Also the rest of a literal that names only some numbers: `Camera { k1: -0.2, ..Camera::centred(640, 480, 700.0) }`.
    pub fn centred(width: u32, height: u32, focal: f64) -> Self {
        let (cx, cy) = ((f64::from(width) - 1.0) / 2.0, (f64::from(height) - 1.0) / 2.0);
        Self { width, height, fx: focal, fy: focal, cx, cy, k1: 0.0, k2: 0.0, k3: 0.0, p1: 0.0, p2: 0.0 }
    }

    /// `[fx, fy, cx, cy, k1, k2, k3, p1, p2]`, the order of [`CameraJacobian::intrinsics`].
    pub fn intrinsics(&self) -> [f64; 9] {
        [self.fx, self.fy, self.cx, self.cy, self.k1, self.k2, self.k3, self.p1, self.p2]
    }

    /// The same picture size with other numbers, in the order of [`Camera::intrinsics`].
    pub fn with_intrinsics(&self, [fx, fy, cx, cy, k1, k2, k3, p1, p2]: [f64; 9]) -> Self {
        Self { fx, fy, cx, cy, k1, k2, k3, p1, p2, ..*self }
    }

    /// Checks that every number is possible.
    pub fn validate(&self) -> Result<(), CameraError> {
        let positive =
            [("width", f64::from(self.width)), ("height", f64::from(self.height)), ("fx", self.fx), ("fy", self.fy)];
        for (name, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(CameraError::Impossible { name, value });
            }
        }
        for (name, value) in ["fx", "fy", "cx", "cy", "k1", "k2", "k3", "p1", "p2"].into_iter().zip(self.intrinsics()) {
            if !value.is_finite() {
                return Err(CameraError::Impossible { name, value });
            }
        }
        Ok(())
    }

    /// The factor `ρ` at an undistorted radius squared.
    #[inline]
    fn radial(&self, r2: f64) -> f64 {
        1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
    }

    /// Derivative of `r ρ` by `r` at an undistorted radius squared.
    #[inline]
    fn slope(&self, r2: f64) -> f64 {
        1.0 + r2 * (3.0 * self.k1 + r2 * (5.0 * self.k2 + r2 * (7.0 * self.k3)))
    }

    /// Where [`Camera::slope`] has its extremes: radii squared, not ordered, NaN where there is none.
    fn slope_extremes(&self) -> [f64; 2] {
        let (a, b, c) = (21.0 * self.k3, 10.0 * self.k2, 3.0 * self.k1);
        // Citardauq's form keeps the digits when `a` is small or zero.
        let q = -0.5 * (b + (b * b - 4.0 * a * c).sqrt().copysign(b));
        [q / a, c / q]
    }

    /// Whether the radial terms keep the order of radii from the middle to a radius squared.
    #[inline(always)]
    fn keeps_order_to(&self, r2: f64) -> bool {
        // Nearly always even the terms' sizes are too small to turn the slope.
        r2 * (3.0 * self.k1.abs() + r2 * (5.0 * self.k2.abs() + r2 * (7.0 * self.k3.abs()))) < 1.0 || self.grows_to(r2)
    }

    /// As [`Camera::keeps_order_to`], of all terms together.
    #[cold]
    fn grows_to(&self, r2: f64) -> bool {
        self.slope(r2) > 0.0 && self.slope_extremes().iter().all(|&t| !(t > 0.0 && t < r2) || self.slope(t) > 0.0)
    }

    /// Whether the lens shows a direction, in normalised coordinates: it does not beyond its fold.
    #[inline(always)]
    fn shows(&self, normalised: &Vec2) -> bool {
        self.keeps_order_to(normalised.norm_squared())
            && (!self.is_tangential() || self.bend(normalised).1.determinant() > 0.0)
    }

    #[inline(always)]
    fn is_tangential(&self) -> bool {
        self.p1 != 0.0 || self.p2 != 0.0
    }

    /// Distorted normalised coordinates, and their derivatives by the undistorted ones.
    #[inline(always)]
    fn bend(&self, n: &Vec2) -> (Vec2, Matrix2<f64>) {
        let (x, y, r2) = (n.x, n.y, n.norm_squared());
        let radial = self.radial(r2);
        let slope = 2.0 * (self.k1 + r2 * (2.0 * self.k2 + r2 * (3.0 * self.k3)));
        let (mut by_x, mut mixed, mut by_y) = (radial + slope * x * x, slope * x * y, radial + slope * y * y);
        if self.is_tangential() {
            by_x += 2.0 * self.p1 * y + 6.0 * self.p2 * x;
            by_y += 6.0 * self.p1 * y + 2.0 * self.p2 * x;
            mixed += 2.0 * (self.p1 * x + self.p2 * y);
        }
        (self.bent(n), Matrix2::new(by_x, mixed, mixed, by_y))
    }

    /// Distorted normalised coordinates.
    #[inline(always)]
    fn bent(&self, n: &Vec2) -> Vec2 {
        let r2 = n.norm_squared();
        let straight = n * self.radial(r2);
        if !self.is_tangential() {
            return straight;
        }
        straight + n * (2.0 * (self.p1 * n.y + self.p2 * n.x)) + Vec2::new(self.p2, self.p1) * r2
    }

    /// The pixel of a point in the camera frame; `None` behind the camera, or so far aside that the distortion folds
    /// the picture over.
    #[inline]
    pub fn project(&self, point_in_cam: &Vec3) -> Option<Vec2> {
        if point_in_cam.z <= 1e-9 {
            return None;
        }
        let normalised = Vec2::new(point_in_cam.x, point_in_cam.y) / point_in_cam.z;
        self.shows(&normalised).then(|| self.distort(&normalised))
    }

    /// The pixel of undistorted normalised coordinates.
    #[inline]
    pub fn distort(&self, normalised: &Vec2) -> Vec2 {
        let d = self.bent(normalised);
        Vec2::new(self.fx * d.x + self.cx, self.fy * d.y + self.cy)
    }

    /// The undistorted normalised coordinates of a pixel.
    ///
    /// A pixel that shows nothing, because the lens folds over before it gets there, is given the direction on the fold in
    /// the pixel's direction from the principal point; [`Camera::try_normalise`] tells such pixels.
    pub fn normalise(&self, pixel: &Vec2) -> Vec2 {
        let distorted = self.without_pinhole(pixel);
        let nearest = |d: &Vec2| self.unbend_radially(d).unwrap_or_else(|| self.on_fold(d));
        self.unbend(&distorted).unwrap_or_else(|| nearest(&distorted))
    }

    /// The undistorted normalised coordinates of a pixel; `None` where the lens folds over before it gets there.
    pub fn try_normalise(&self, pixel: &Vec2) -> Option<Vec2> {
        self.unbend(&self.without_pinhole(pixel))
    }

    fn without_pinhole(&self, pixel: &Vec2) -> Vec2 {
        Vec2::new((pixel.x - self.cx) / self.fx, (pixel.y - self.cy) / self.fy)
    }

    /// The inverse of [`Camera::bent`], by Newton's method in the plane from the inverse of the radial terms.
    fn unbend(&self, distorted: &Vec2) -> Option<Vec2> {
        let radial = self.unbend_radially(distorted)?;
        if !self.is_tangential() {
            return Some(radial);
        }
        let mut n = radial;
        for _ in 0..MAX_NEWTON_STEPS {
            let (bent, derivative) = self.bend(&n);
            let step = derivative.try_inverse()? * (bent - distorted);
            n -= step;
            if step.norm() <= NEWTON_TOLERANCE {
                return self.shows(&n).then_some(n);
            }
        }
        None
    }

    /// The inverse of the radial terms, by Newton's method on the radius.
    fn unbend_radially(&self, distorted: &Vec2) -> Option<Vec2> {
        let target = distorted.norm();
        if target < 1e-12 || (self.k1 == 0.0 && self.k2 == 0.0 && self.k3 == 0.0) {
            return Some(*distorted);
        }
        // The inverse series' first term.
        let mut r = target * (1.0 - self.k1 * target * target).max(0.5);
        for _ in 0..MAX_NEWTON_STEPS {
            let step = (r * self.radial(r * r) - target) / self.slope(r * r);
            r -= step;
            if step.abs() <= NEWTON_TOLERANCE {
                let valid = r > 0.0 && self.keeps_order_to(r * r);
                return if valid { Some(distorted * (r / target)) } else { self.bisected(distorted, target) };
            }
        }
        self.bisected(distorted, target)
    }

    /// As [`Camera::unbend_radially`] where Newton's method leaves the part before the fold.
    fn bisected(&self, distorted: &Vec2, target: f64) -> Option<Vec2> {
        let reached = |r: f64| r * self.radial(r * r) >= target;
        let limit = self.fold_radius().unwrap_or(f64::MAX.sqrt().sqrt());
        if !reached(limit) {
            return None;
        }
        let first = |r: &f64| *r >= limit || reached(*r);
        let high = (0..).map(|k| target * f64::powi(2.0, k)).find(first)?.min(limit);
        Some(distorted * (bisect(0.0, high, reached) / target))
    }

    /// The least radius at which the radial terms stop growing.
    fn fold_radius(&self) -> Option<f64> {
        let mut bounds: Vec<f64> = self.slope_extremes().into_iter().filter(|t| *t > 0.0 && t.is_finite()).collect();
        bounds.sort_by(f64::total_cmp);
        // Beyond its last extreme the slope falls for ever or not at all.
        let last = bounds.last().copied().unwrap_or(0.0).max(1e-3);
        bounds.extend((1..200).map(|k| last * f64::powi(2.0, k)));
        let falls = |t: f64| self.slope(t) <= 0.0;
        let end = bounds.iter().position(|&t| falls(t))?;
        let start = if end == 0 { 0.0 } else { bounds[end - 1] };
        Some(bisect(start, bounds[end], falls).sqrt())
    }

    fn on_fold(&self, distorted: &Vec2) -> Vec2 {
        self.fold_radius().map_or(*distorted, |r| distorted * (r / distorted.norm()))
    }

    /// The unit direction, in the camera frame, of the ray through a pixel; as for [`Camera::normalise`].
    pub fn ray(&self, pixel: &Vec2) -> Vec3 {
        let n = self.normalise(pixel);
        Vec3::new(n.x, n.y, 1.0).normalize()
    }

    /// The pixel of a point in the camera frame with its derivatives; `None` as for [`Camera::project`].
    // Inlined, the derivatives that a caller leaves alone cost nothing: a quarter of the time.
    #[inline(always)]
    pub fn project_with_jacobian(&self, point_in_cam: &Vec3) -> Option<(Vec2, CameraJacobian)> {
        if point_in_cam.z <= 1e-9 {
            return None;
        }
        let iz = 1.0 / point_in_cam.z;
        let n = Vec2::new(point_in_cam.x * iz, point_in_cam.y * iz);
        if !self.shows(&n) {
            return None;
        }
        let (x, y, r2) = (n.x, n.y, n.norm_squared());
        let (bent, by_normalised) = self.bend(&n);
        let in_pixels = Matrix2::new(
            self.fx * by_normalised.m11,
            self.fx * by_normalised.m12,
            self.fy * by_normalised.m21,
            self.fy * by_normalised.m22,
        );
        let normalised_by_point = Matrix2x3::new(iz, 0.0, -x * iz, 0.0, iz, -y * iz);
        let (along_x, along_y, r4) = (self.fx * x * r2, self.fy * y * r2, r2 * r2);
        #[rustfmt::skip]
        let intrinsics = SMatrix::<f64, 2, 9>::from_row_slice(&[
            bent.x, 0.0, 1.0, 0.0, along_x, along_x * r2, along_x * r4,
                self.fx * 2.0 * x * y, self.fx * (r2 + 2.0 * x * x),
            0.0, bent.y, 0.0, 1.0, along_y, along_y * r2, along_y * r4,
                self.fy * (r2 + 2.0 * y * y), self.fy * 2.0 * x * y,
        ]);
        let pixel = Vec2::new(self.fx * bent.x + self.cx, self.fy * bent.y + self.cy);
        Some((pixel, CameraJacobian { point: in_pixels * normalised_by_point, intrinsics }))
    }

    /// The same lens for a picture resized by `factor`, pixel centres kept at integers.
    pub fn resized(&self, factor: f64) -> Self {
        let size = |n: u32| (f64::from(n) * factor).round() as u32;
        let centre = |c: f64| (c + 0.5) * factor - 0.5;
        Self {
            width: size(self.width),
            height: size(self.height),
            fx: self.fx * factor,
            fy: self.fy * factor,
            cx: centre(self.cx),
            cy: centre(self.cy),
            ..*self
        }
    }
}

/// Where `holds` begins to hold, between a number where it does not and one where it does; to the last digit but one.
fn bisect(mut low: f64, mut high: f64, holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if holds(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    // The side where it does not hold yet is before a fold.
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    fn webcam() -> Camera {
        Camera { fy: 610.0, cx: 180.1, cy: 138.6, k1: -0.18, k2: 0.09, ..Camera::centred(352, 288, 615.0) }
    }

    /// All nine numbers differ from zero.
    fn full() -> Camera {
        Camera { k3: -0.03, p1: 2e-3, p2: -3e-3, ..webcam() }
    }

    #[test]
    fn undistortion_is_the_inverse_to_the_corner_of_the_picture() {
        for camera in [webcam(), full(), Camera { k1: 0.3, ..full() }] {
            for (u, v) in [(0.0, 0.0), (351.0, 287.0), (180.1, 138.6), (90.0, 200.0), (351.0, 0.0)] {
                let pixel = Vec2::new(u, v);
                assert!((camera.distort(&camera.try_normalise(&pixel).unwrap()) - pixel).norm() < 1e-9);
                assert_eq!(camera.try_normalise(&pixel).unwrap(), camera.normalise(&pixel));
            }
        }
    }

    #[test]
    fn distortion_is_that_of_brown_in_the_usual_order() {
        // Worked by hand: x = 0.3, y = -0.2, r² = 0.13.
        let camera = Camera { cx: 0.0, cy: 0.0, k1: -0.2, k2: 0.1, k3: 0.5, p1: 0.01, p2: -0.02, ..webcam() };
        let radial = 1.0 - 0.2 * 0.13 + 0.1 * 0.0169 + 0.5 * 0.002197;
        let x = 0.3 * radial + 2.0 * 0.01 * 0.3 * -0.2 - 0.02 * (0.13 + 2.0 * 0.09);
        let y = -0.2 * radial + 0.01 * (0.13 + 2.0 * 0.04) - 2.0 * 0.02 * 0.3 * -0.2;
        let pixel = camera.distort(&Vec2::new(0.3, -0.2));
        assert!((pixel - Vec2::new(615.0 * x, 610.0 * y)).norm() < 1e-10);
    }

    #[test]
    fn jacobian_agrees_with_differences() {
        let (camera, point, h) = (full(), Vec3::new(0.11, -0.08, 0.4), 1e-6);
        let (pixel, jacobian) = camera.project_with_jacobian(&point).unwrap();
        assert!((pixel - camera.project(&point).unwrap()).norm() < 1e-12);
        for k in 0..3 {
            let mut d = Vec3::zeros();
            d[k] = h;
            let numeric = (camera.project(&(point + d)).unwrap() - camera.project(&(point - d)).unwrap()) / (2.0 * h);
            assert!((numeric - jacobian.point.column(k)).norm() < 1e-4);
        }
        let nudged = |k: usize, h: f64| {
            let mut numbers = camera.intrinsics();
            numbers[k] += h;
            camera.with_intrinsics(numbers).project(&point).unwrap()
        };
        for k in 0..9 {
            let numeric = (nudged(k, h) - nudged(k, -h)) / (2.0 * h);
            assert!((numeric - jacobian.intrinsics.column(k)).norm() < 1e-6);
        }
    }

    #[test]
    fn nothing_is_seen_beyond_the_fold_of_a_lens() {
        // r (1 - 0.5 r²) grows up to r = √(2/3), where it is 0.544.
        let camera = Camera { k1: -0.5, ..Camera::centred(1000, 1000, 500.0) };
        let fold = (2.0f64 / 3.0).sqrt();
        assert!(camera.project(&Vec3::new(fold - 1e-6, 0.0, 1.0)).is_some());
        assert!(camera.project(&Vec3::new(fold + 1e-6, 0.0, 1.0)).is_none());
        let corner = Vec2::new(camera.cx + 300.0, camera.cy);
        assert!(camera.try_normalise(&corner).is_none());
        assert!((camera.normalise(&corner) - Vec2::new(fold, 0.0)).norm() < 1e-7);
        // Just inside, Newton's method overshoots.
        let inside = Vec2::new(camera.cx + 272.1, camera.cy);
        assert!((camera.distort(&camera.try_normalise(&inside).unwrap()) - inside).norm() < 1e-9);
    }

    #[test]
    fn a_lens_that_comes_back_after_its_fold_is_still_folded() {
        let camera = Camera { k1: -1.2, k2: 0.6, ..Camera::centred(1000, 1000, 500.0) };
        assert!(camera.slope(0.3) > 0.0 && camera.slope(0.6) < 0.0 && camera.slope(1.5) > 0.0);
        assert!(camera.project(&Vec3::new(1.5f64.sqrt(), 0.0, 1.0)).is_none());
        let third = Camera { k1: 0.0, k2: -2.0, k3: 1.0, ..camera };
        assert!(third.slope(0.5) < 0.0 && third.slope(2.0) > 0.0);
        assert!(third.project(&Vec3::new(2.0f64.sqrt(), 0.0, 1.0)).is_none());
        assert!(third.project(&Vec3::new(0.5, 0.0, 1.0)).is_some());
    }

    #[test]
    fn the_papers_lens_is_written_without_further_terms() {
        let text = serde_json::to_string(&webcam()).unwrap();
        assert!(!text.contains("k3") && !text.contains("p1") && !text.contains("p2"), "{text}");
        assert_eq!(serde_json::from_str::<Camera>(&text).unwrap(), webcam());
        let text = serde_json::to_string(&full()).unwrap();
        assert_eq!(serde_json::from_str::<Camera>(&text).unwrap(), full());
    }

    #[test]
    fn a_point_behind_the_camera_has_no_pixel() {
        assert!(webcam().project(&Vec3::new(0.0, 0.0, -1.0)).is_none());
    }

    #[test]
    fn impossible_cameras_are_refused() {
        let broken = Camera { fx: -3.0, ..webcam() };
        assert!(matches!(broken.validate(), Err(CameraError::Impossible { name: "fx", .. })));
        let broken = Camera { p2: f64::NAN, ..webcam() };
        assert!(matches!(broken.validate(), Err(CameraError::Impossible { name: "p2", .. })));
    }
}
