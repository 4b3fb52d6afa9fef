//! How far a picture is halved before it is tracked in.
//!
//! A patch of a face is a part of it, whatever its size in pixels: that of a large face holds no more at full size than at half, where
//! compression and soft lenses leave it texture beside its noise, and costs four times as much.

use geometry::{Camera, Vec2};
use image::GrayImage;
use std::sync::Arc;
use vision::landmarks::Face;
use vision::pyramid::Pyramid;

/// Levels of the pyramids that are tracked in.
const LEVELS: usize = 4;

/// So many halvings. A place in the halved picture is the place in the picture divided by `2^n`, as in [`Pyramid`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Octave(u32);

impl Octave {
    /// The first in which something of a size, pixels, is not larger than this.
    pub fn bringing(size_px: f64, to_at_most_px: f64) -> Self {
        let halvings = (size_px / to_at_most_px).log2().ceil();
        // The cast saturates; what is not a number is not halved. Nothing is brought below a pixel of 8K.
        Self((halvings.max(0.0) as u32).min(6))
    }

    /// Pixels of the picture per pixel of the octave.
    pub fn factor(self) -> f64 {
        f64::from(1_u32 << self.0)
    }

    /// A place of the picture in the octave.
    pub fn inside(self, pixel: &Vec2) -> Vec2 {
        pixel / self.factor()
    }

    /// A place of the octave in the picture.
    pub fn outside(self, pixel: &Vec2) -> Vec2 {
        pixel * self.factor()
    }

    /// The lens for the halved picture.
    pub fn camera(self, camera: &Camera) -> Camera {
        let size = |full: u32| (0..self.0).fold(full, |size, _| size.div_ceil(2));
        let scale = 1.0 / self.factor();
        Camera {
            width: size(camera.width),
            height: size(camera.height),
            fx: camera.fx * scale,
            fy: camera.fy * scale,
            cx: camera.cx * scale,
            cy: camera.cy * scale,
            ..*camera
        }
    }

    /// The landmarks of a face in the halved picture.
    pub fn face(self, face: &Face) -> Face {
        let scale = 1.0 / self.factor();
        let mut face = face.clone();
        face.points.iter_mut().for_each(|point| *point *= scale);
        face.flip_disagreement_px *= scale;
        for iris in &mut face.irises {
            iris.centre *= scale;
            iris.radius *= scale;
            iris.eye_contour.iter_mut().for_each(|point| *point *= scale);
        }
        face
    }

    /// The pyramid above the halved picture.
    pub fn pyramid(self, grey: GrayImage) -> Pyramid {
        let picture = match self.0 {
            0 => grey,
            n => Pyramid::sharing(Arc::new(grey), n as usize + 1).coarsest().picture(),
        };
        Pyramid::sharing(Arc::new(picture), LEVELS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::Vec3;
    use image::Luma;

    #[test]
    fn a_size_is_halved_until_it_fits() {
        let halvings = |size| Octave::bringing(size, 31.0).0;
        assert_eq!([10.0, 31.0, 31.1, 62.0, 63.0, 125.0].map(halvings), [0, 0, 1, 1, 2, 3]);
        assert_eq!([f64::NAN, -1.0, f64::INFINITY].map(halvings), [0, 0, 6]);
    }

    #[test]
    fn lens_and_pyramid_agree_on_places() {
        let octave = Octave(2);
        let camera = Camera { cx: 201.3, k1: -0.1, ..Camera::centred(401, 299, 500.0) };
        let small = octave.camera(&camera);
        let point = Vec3::new(0.05, -0.03, 0.6);
        let (whole, halved) = (camera.project(&point).unwrap(), small.project(&point).unwrap());
        assert!((octave.outside(&halved) - whole).norm() < 1e-9);
        assert!((octave.inside(&whole) - halved).norm() < 1e-9);
        // A ramp has the grey level of the place.
        let ramp = GrayImage::from_fn(401, 299, |x, _| Luma([(x / 2) as u8]));
        let pyramid = octave.pyramid(ramp);
        assert_eq!(pyramid.picture().dimensions(), (small.width, small.height));
        assert!(pyramid.picture().get_pixel(50, 30)[0].abs_diff(100) <= 1);
    }
}
