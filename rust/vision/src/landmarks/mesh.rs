//! The 468 points of the face mesh inside a region known to hold a face.
//!
//! Kartynnik et al. 2019, "Real-time Facial Surface Geometry from Monocular Video on Mobile GPUs". The net leans to one
//! side by a few tenths of a crop pixel, so [`MeshNet::balanced`] averages it with its answer for the mirrored crop.

use super::LandmarkError;
use super::crop::{Border, Range, Region, crop, mirrored};
use super::detector::sigmoid;
use super::net::{Net, Threads};
use geometry::face_mesh::{LANDMARKS, MIRROR, OUTER_EYE_CORNERS};
use geometry::{Vec2, Vec3};
use image::RgbImage;
use std::path::Path;

/// What lies beyond the border, and how colours are scaled, for the mesh net and the iris net.
pub const NET_INPUT: (Border, Range) = (Border::Nearest, Range { black: 0.0, white: 1.0 });
/// Nets count crop pixels from the centre of the first one. (Over 71 pictures of several people an abscissa and its
/// mirrored one add up to 190.4 ± 0.1: nearer to 191, centres, than to 192, edges.)
const FIRST_PIXEL: f64 = 0.5;
/// Edge of the region in terms of the points' box.
const REGION_PER_BOX: f64 = 1.5;

/// The points one look at a crop gives.
pub struct MeshPass {
    /// 468 points: pixels, and the depth in the same scale, growing away from the camera.
    pub points: Vec<Vec3>,
    /// How sure the net is that the crop shows a face, 0 to 1.
    pub score: f64,
}

/// A point in a region's own coordinates, from a net's crop coordinates.
pub fn unit_from_net(x: f32, y: f32, side: usize) -> Vec2 {
    Vec2::new(f64::from(x) + FIRST_PIXEL, f64::from(y) + FIRST_PIXEL) / side as f64
}

/// The region around known points: turned so that the eyes are level, with a margin.
pub fn region_of(points: &[Vec3]) -> Region {
    let [left, right] = OUTER_EYE_CORNERS.map(|i| points[i].xy());
    let eyes = left - right;
    let upright = Region { centre: Vec2::zeros(), side: 1.0, angle: eyes.y.atan2(eyes.x) };
    let [x, y] = upright.axes();
    let mut low = Vec2::from_element(f64::INFINITY);
    let mut high = -low;
    for point in points {
        let turned = Vec2::new(x.dot(&point.xy()), y.dot(&point.xy()));
        low = low.inf(&turned);
        high = high.sup(&turned);
    }
    let middle = (low + high) / 2.0;
    Region { centre: x * middle.x + y * middle.y, side: REGION_PER_BOX * (high - low).max(), angle: upright.angle }
}

/// The face mesh net.
pub struct MeshNet(Net<2>);

impl MeshNet {
    /// Loads the net.
    pub fn load(folder: &Path, threads: &Threads) -> Result<Self, LandmarkError> {
        Ok(Self(Net::load(folder, "face_landmark", 192, threads)?))
    }

    fn crop(&self, image: &RgbImage, region: &Region) -> Vec<f32> {
        let (border, range) = NET_INPUT;
        crop(image, region, self.0.side(), border, range)
    }

    /// The points in the region's own coordinates (depth in the same scale) and the face score.
    fn answer(&self, planes: &[f32]) -> Result<(Vec<Vec3>, f64), LandmarkError> {
        let [numbers, flag] = self.0.run(planes)?;
        self.0.expect_length(&numbers, 3 * LANDMARKS)?;
        self.0.expect_length(&flag, 1)?;
        let side = self.0.side();
        let point = |p: &[f32]| {
            let unit = unit_from_net(p[0], p[1], side);
            Vec3::new(unit.x, unit.y, f64::from(p[2]) / side as f64)
        };
        Ok((numbers.chunks_exact(3).map(point).collect(), sigmoid(f64::from(flag[0]))))
    }

    /// One look, good enough to place the next region.
    pub fn quick(&self, image: &RgbImage, region: &Region) -> Result<MeshPass, LandmarkError> {
        let (units, score) = self.answer(&self.crop(image, region))?;
        Ok(MeshPass { points: units.iter().map(|unit| to_image(region, unit)).collect(), score })
    }

    /// The mean of a look and a look in the mirror, and the median distance between the two, pixels.
    pub fn balanced(&self, image: &RgbImage, region: &Region) -> Result<(MeshPass, f64), LandmarkError> {
        let planes = self.crop(image, region);
        let reversed = mirrored(&planes, self.0.side());
        let (straight, flipped) = rayon::join(|| self.answer(&planes), || self.answer(&reversed));
        let ((straight, score), (flipped, flipped_score)) = (straight?, flipped?);
        let unflipped = |i: usize| {
            let mirror = &flipped[MIRROR[i]];
            Vec3::new(1.0 - mirror.x, mirror.y, mirror.z)
        };
        let mut apart = Vec::with_capacity(LANDMARKS);
        let mut points = Vec::with_capacity(LANDMARKS);
        for (i, point) in straight.iter().enumerate() {
            let other = unflipped(i);
            apart.push((point - other).xy().norm() * region.side);
            points.push(to_image(region, &((point + other) / 2.0)));
        }
        apart.sort_by(f64::total_cmp);
        Ok((MeshPass { points, score: (score + flipped_score) / 2.0 }, apart[LANDMARKS / 2]))
    }
}

/// A point in picture coordinates from one in the region's own.
fn to_image(region: &Region, unit: &Vec3) -> Vec3 {
    let pixel = region.point(&unit.xy());
    Vec3::new(pixel.x, pixel.y, unit.z * region.side)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_region_of_a_tilted_face_is_tilted_and_holds_it() {
        let tilt = Region { centre: Vec2::new(300.0, 200.0), side: 100.0, angle: 0.5 };
        let mut points = vec![to_image(&tilt, &Vec3::new(0.5, 0.5, 0.0)); LANDMARKS];
        for (i, unit) in [(263, (0.75, 0.4)), (33, (0.25, 0.4)), (10, (0.5, 0.0)), (152, (0.5, 1.0))] {
            points[i] = to_image(&tilt, &Vec3::new(unit.0, unit.1, 0.0));
        }
        let region = region_of(&points);
        assert!((region.angle - 0.5).abs() < 1e-12);
        assert!((region.side - 150.0).abs() < 1e-9);
        assert!((region.centre - tilt.centre).norm() < 1e-9);
    }

    #[test]
    fn the_middle_of_the_net_is_the_middle_of_the_region() {
        assert!((unit_from_net(95.5, 95.5, 192) - Vec2::new(0.5, 0.5)).norm() < 1e-12);
    }
}
