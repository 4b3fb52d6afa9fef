//! Pictures without distortion: which pinhole camera they have, and where each of their pixels comes from.
//!
//! # Entry points
//! - [`Camera::pinhole`]: the camera of the undistorted picture.
//! - [`Camera::undistortion_map`]: for each of its pixels the place in the distorted picture.

use crate::{Camera, Vec2};

/// Which pinhole camera an undistorted picture is given; it has the distorted picture's size in any case.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pinhole {
    /// The same focal lengths and principal point.
    #[default]
    SameFocal,
    /// The largest rectangle that the distorted picture fills, stretched to its size.
    NoEmptyPixels,
    /// The smallest rectangle that holds every pixel of the distorted picture, shrunk to its size.
    AllPixels,
}

/// Where the pixels of a picture come from.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelMap {
    /// Width of the new picture, pixels.
    pub width: u32,
    /// Height of the new picture, pixels.
    pub height: u32,
    /// Pixel of the old picture for each pixel of the new one, row by row: x, y. It may lie outside the old picture, and is
    /// NaN where the old camera's lens shows nothing.
    pub source: Vec<[f32; 2]>,
}

impl Camera {
    /// A camera without distortion that looks the same way.
    ///
    /// A lens that folds over inside the picture is taken to end at its fold.
    pub fn pinhole(&self, choice: Pinhole) -> Self {
        let same = Self { k1: 0.0, k2: 0.0, k3: 0.0, p1: 0.0, p2: 0.0, ..*self };
        let [left, right, top, bottom] = self.undistorted_border();
        let least = |side: &[Vec2], k: usize| side.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min);
        let most = |side: &[Vec2], k: usize| side.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max);
        let (low, high) = match choice {
            Pinhole::SameFocal => return same,
            Pinhole::NoEmptyPixels => {
                (Vec2::new(most(&left, 0), most(&top, 1)), Vec2::new(least(&right, 0), least(&bottom, 1)))
            }
            Pinhole::AllPixels => {
                let all = [left, right, top, bottom].concat();
                (Vec2::new(least(&all, 0), least(&all, 1)), Vec2::new(most(&all, 0), most(&all, 1)))
            }
        };
        let size = Vec2::new(f64::from(self.width) - 1.0, f64::from(self.height) - 1.0);
        let focal = size.component_div(&(high - low));
        Self { fx: focal.x, fy: focal.y, cx: -low.x * focal.x, cy: -low.y * focal.y, ..same }
    }

    /// Normalised coordinates of the pixels at the left, right, top and bottom border.
    fn undistorted_border(&self) -> [Vec<Vec2>; 4] {
        let (right, bottom) = (f64::from(self.width) - 1.0, f64::from(self.height) - 1.0);
        let column = |x: f64| (0..self.height).map(|y| self.normalise(&Vec2::new(x, f64::from(y)))).collect();
        let row = |y: f64| (0..self.width).map(|x| self.normalise(&Vec2::new(f64::from(x), y))).collect();
        [column(0.0), column(right), row(0.0), row(bottom)]
    }

    /// Where the pixels of the picture that `to` would take come from in this camera's picture.
    pub fn undistortion_map(&self, to: &Self) -> PixelMap {
        let nothing = [f32::NAN; 2];
        let source = |x: u32, y: u32| {
            let seen = to.try_normalise(&Vec2::new(f64::from(x), f64::from(y)));
            let from = seen.and_then(|n| self.project(&n.push(1.0)));
            from.map_or(nothing, |p| [p.x as f32, p.y as f32])
        };
        let source = (0..to.height).flat_map(|y| (0..to.width).map(move |x| source(x, y))).collect();
        PixelMap { width: to.width, height: to.height, source }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lens(k1: f64) -> Camera {
        Camera { k1, k2: 0.03, p1: 1e-3, cx: 170.0, ..Camera::centred(352, 288, 300.0) }
    }

    fn outside(camera: &Camera, map: &PixelMap) -> usize {
        let inside = |p: &[f32; 2]| {
            (-1e-3..=camera.width as f32 - 1.0 + 1e-3).contains(&p[0])
                && (-1e-3..=camera.height as f32 - 1.0 + 1e-3).contains(&p[1])
        };
        map.source.iter().filter(|p| !inside(p)).count()
    }

    #[test]
    fn the_map_leads_to_where_the_lens_shows_a_pixels_ray() {
        let (camera, pinhole) = (lens(-0.2), lens(-0.2).pinhole(Pinhole::SameFocal));
        let map = camera.undistortion_map(&pinhole);
        assert_eq!((map.width, map.height, map.source.len()), (352, 288, 352 * 288));
        let ray = pinhole.ray(&Vec2::new(40.0, 250.0));
        let [x, y] = map.source[250 * 352 + 40];
        assert!((camera.project(&ray).unwrap() - Vec2::new(f64::from(x), f64::from(y))).norm() < 1e-4);
    }

    #[test]
    fn no_pixel_of_the_inner_rectangle_is_empty() {
        for k1 in [-0.2, 0.15] {
            let camera = lens(k1);
            let map = camera.undistortion_map(&camera.pinhole(Pinhole::NoEmptyPixels));
            assert_eq!(outside(&camera, &map), 0);
        }
    }

    #[test]
    fn the_outer_rectangle_holds_the_whole_picture() {
        for k1 in [-0.2, 0.15] {
            let camera = lens(k1);
            let pinhole = camera.pinhole(Pinhole::AllPixels);
            for (x, y) in [(0.0, 0.0), (351.0, 0.0), (0.0, 287.0), (351.0, 287.0), (175.0, 0.0), (0.0, 140.0)] {
                let place = pinhole.distort(&camera.normalise(&Vec2::new(x, y)));
                assert!(place.x > -1e-6 && place.y > -1e-6 && place.x < 351.0 + 1e-6 && place.y < 287.0 + 1e-6);
            }
            assert!(outside(&camera, &camera.undistortion_map(&pinhole)) > 0);
        }
    }

    #[test]
    fn what_lies_beyond_the_fold_is_nan() {
        let camera = Camera { k1: -0.5, ..Camera::centred(200, 200, 100.0) };
        let map = camera.undistortion_map(&camera.pinhole(Pinhole::SameFocal));
        assert!(map.source[0][0].is_nan() && map.source[100 * 200 + 100][0].is_finite());
    }
}
