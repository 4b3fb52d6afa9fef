//! Pinhole camera with two radial distortion terms (paper, section 2.2).

use crate::{Vec2, Vec3};
use nalgebra::{Matrix2, Matrix2x3, SMatrix};
use serde::{Deserialize, Serialize};

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

/// A pinhole camera with radial distortion.
///
/// With `x = X/Z, y = Y/Z, r² = x² + y²` of a point in the camera frame, the pixel is
/// `u = fx x (1 + k1 r² + k2 r⁴) + cx` and the same for `v`; pixel centres are at integers.
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
}

/// Derivatives of a pixel: by the point in the camera frame and by `[fx, fy, cx, cy, k1, k2]`.
pub struct CameraJacobian {
    /// Pixels per metre, 2×3.
    pub point: Matrix2x3<f64>,
    /// Pixels per unit of each intrinsic parameter, 2×6.
    pub intrinsics: SMatrix<f64, 2, 6>,
}

impl Camera {
    /// An undistorted camera with square pixels and a centred principal point; `focal` in pixels.
    pub fn centred(width: u32, height: u32, focal: f64) -> Self {
        let (cx, cy) = ((f64::from(width) - 1.0) / 2.0, (f64::from(height) - 1.0) / 2.0);
        Self { width, height, fx: focal, fy: focal, cx, cy, k1: 0.0, k2: 0.0 }
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
        for (name, value) in [("cx", self.cx), ("cy", self.cy), ("k1", self.k1), ("k2", self.k2)] {
            if !value.is_finite() {
                return Err(CameraError::Impossible { name, value });
            }
        }
        Ok(())
    }

    /// The factor `1 + k1 r² + k2 r⁴` at an undistorted radius squared.
    fn radial(&self, r2: f64) -> f64 {
        1.0 + r2 * (self.k1 + r2 * self.k2)
    }

    /// The pixel of a point in the camera frame; `None` behind the camera, or so far aside that the distortion folds
    /// the picture over.
    pub fn project(&self, point_in_cam: &Vec3) -> Option<Vec2> {
        if point_in_cam.z <= 1e-9 {
            return None;
        }
        let normalised = Vec2::new(point_in_cam.x, point_in_cam.y) / point_in_cam.z;
        let r2 = normalised.norm_squared();
        (1.0 + r2 * (3.0 * self.k1 + 5.0 * self.k2 * r2) > 0.0).then(|| self.distort(&normalised))
    }

    /// The pixel of undistorted normalised coordinates.
    pub fn distort(&self, normalised: &Vec2) -> Vec2 {
        let d = normalised * self.radial(normalised.norm_squared());
        Vec2::new(self.fx * d.x + self.cx, self.fy * d.y + self.cy)
    }

    /// The undistorted normalised coordinates of a pixel (Newton's method on the radius).
    pub fn normalise(&self, pixel: &Vec2) -> Vec2 {
        let distorted = Vec2::new((pixel.x - self.cx) / self.fx, (pixel.y - self.cy) / self.fy);
        let target = distorted.norm();
        if target < 1e-12 || (self.k1 == 0.0 && self.k2 == 0.0) {
            return distorted;
        }
        let mut r = target;
        for _ in 0..20 {
            let r2 = r * r;
            let slope = 1.0 + r2 * (3.0 * self.k1 + 5.0 * self.k2 * r2);
            let step = (r * self.radial(r2) - target) / slope.max(0.1);
            r -= step;
            if step.abs() < 1e-14 {
                break;
            }
        }
        distorted * (r / target)
    }

    /// The unit direction, in the camera frame, of the ray through a pixel.
    pub fn ray(&self, pixel: &Vec2) -> Vec3 {
        let n = self.normalise(pixel);
        Vec3::new(n.x, n.y, 1.0).normalize()
    }

    /// The pixel of a point in the camera frame with its derivatives; `None` as for [`Camera::project`].
    pub fn project_with_jacobian(&self, point_in_cam: &Vec3) -> Option<(Vec2, CameraJacobian)> {
        let pixel = self.project(point_in_cam)?;
        let (iz, x, y) = (1.0 / point_in_cam.z, point_in_cam.x / point_in_cam.z, point_in_cam.y / point_in_cam.z);
        let r2 = x * x + y * y;
        let radial = self.radial(r2);
        let slope = 2.0 * (self.k1 + 2.0 * self.k2 * r2);
        let by_normalised = Matrix2::new(
            self.fx * (radial + slope * x * x),
            self.fx * slope * x * y,
            self.fy * slope * x * y,
            self.fy * (radial + slope * y * y),
        );
        let normalised_by_point = Matrix2x3::new(iz, 0.0, -x * iz, 0.0, iz, -y * iz);
        #[rustfmt::skip]
        let intrinsics = SMatrix::<f64, 2, 6>::new(
            radial * x, 0.0, 1.0, 0.0, self.fx * x * r2, self.fx * x * r2 * r2,
            0.0, radial * y, 0.0, 1.0, self.fy * y * r2, self.fy * y * r2 * r2,
        );
        Some((pixel, CameraJacobian { point: by_normalised * normalised_by_point, intrinsics }))
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

#[cfg(test)]
mod tests {
    use super::*;

    fn webcam() -> Camera {
        Camera { width: 352, height: 288, fx: 615.0, fy: 610.0, cx: 180.1, cy: 138.6, k1: -0.18, k2: 0.09 }
    }

    #[test]
    fn undistortion_is_the_inverse_to_the_corner_of_the_picture() {
        let camera = webcam();
        for pixel in [Vec2::new(0.0, 0.0), Vec2::new(351.0, 287.0), Vec2::new(180.1, 138.6), Vec2::new(90.0, 200.0)] {
            assert!((camera.distort(&camera.normalise(&pixel)) - pixel).norm() < 1e-9);
        }
    }

    #[test]
    fn jacobian_agrees_with_differences() {
        let (camera, point, h) = (webcam(), Vec3::new(0.11, -0.08, 0.7), 1e-6);
        let (_, jacobian) = camera.project_with_jacobian(&point).unwrap();
        for k in 0..3 {
            let mut d = Vec3::zeros();
            d[k] = h;
            let numeric = (camera.project(&(point + d)).unwrap() - camera.project(&(point - d)).unwrap()) / (2.0 * h);
            assert!((numeric - jacobian.point.column(k)).norm() < 1e-4);
        }
        let nudged = |k: usize, h: f64| {
            let mut c = camera;
            *[&mut c.fx, &mut c.fy, &mut c.cx, &mut c.cy, &mut c.k1, &mut c.k2][k] += h;
            c.project(&point).unwrap()
        };
        for k in 0..6 {
            let numeric = (nudged(k, h) - nudged(k, -h)) / (2.0 * h);
            assert!((numeric - jacobian.intrinsics.column(k)).norm() < 1e-6);
        }
    }

    #[test]
    fn a_point_behind_the_camera_has_no_pixel() {
        assert!(webcam().project(&Vec3::new(0.0, 0.0, -1.0)).is_none());
    }

    #[test]
    fn impossible_cameras_are_refused() {
        let broken = Camera { fx: -3.0, ..webcam() };
        assert!(matches!(broken.validate(), Err(CameraError::Impossible { name: "fx", .. })));
    }
}
