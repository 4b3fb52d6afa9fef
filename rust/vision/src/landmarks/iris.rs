//! The iris and the lids of each eye.
//!
//! The net (Ablavatski et al. 2020, "Real-time Pupil Tracking from Monocular Video for Digital Puppetry") knows right
//! eyes only; left eyes are shown to it in a mirror.

use super::LandmarkError;
use super::crop::{Region, crop, mirrored};
use super::mesh::{NET_INPUT, unit_from_net};
use super::net::{Net, Threads};
use geometry::face_mesh::EYE_CORNERS;
use geometry::{Vec2, Vec3};
use image::RgbImage;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Points along the lids.
const CONTOUR: usize = 16;
/// Edge of the region in terms of the eye's width.
const REGION_PER_EYE: f64 = 2.3;
/// An eye turned away is foreshortened, but no narrower than this in terms of the other one.
const NARROWEST: f64 = 0.6;
/// Open area of an eye, in squares of its width, below which the iris is a guess.
const CLOSED: f64 = 0.10;

/// An eye's iris and lids.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Iris {
    /// Centre of the iris, pixels.
    #[serde(with = "super::rounded::one")]
    pub centre: Vec2,
    /// Radius of the iris, pixels: its longer half-axis, as the iris is round.
    pub radius: f64,
    /// The edge of the lids, 16 pixels points: outer corner, lower lid, inner corner, upper lid, in the order of
    /// [`EYE_CONTOURS`](geometry::face_mesh::EYE_CONTOURS).
    #[serde(with = "super::rounded")]
    pub eye_contour: Vec<Vec2>,
    /// Area between the lids, in squares of the eye's width: about 0.2 open, 0.05 closed.
    pub openness: f64,
    /// Whether the eye is open enough for the iris to be seen, and it lies between the lids.
    pub visible: bool,
}

/// The iris net.
pub struct IrisNet(Net<2>);

impl IrisNet {
    /// Loads the net.
    pub fn load(folder: &Path, threads: &Threads) -> Result<Self, LandmarkError> {
        Ok(Self(Net::load(folder, "iris_landmark", 64, threads)?))
    }

    /// Both irises, `[subject's left, subject's right]`, of a face with these 468 points.
    pub fn both(&self, image: &RgbImage, points: &[Vec3]) -> Result<[Iris; 2], LandmarkError> {
        let [left, right] = regions(points);
        let (left, right) = rayon::join(|| self.one(image, &left, true), || self.one(image, &right, false));
        Ok([left?, right?])
    }

    fn one(&self, image: &RgbImage, region: &Region, mirror: bool) -> Result<Iris, LandmarkError> {
        let (side, (border, range)) = (self.0.side(), NET_INPUT);
        let mut planes = crop(image, region, side, border, range);
        if mirror {
            planes = mirrored(&planes, side);
        }
        let [contour, iris] = self.0.run(&planes)?;
        self.0.expect_length(&contour, 3 * 71)?;
        self.0.expect_length(&iris, 3 * 5)?;
        let place = |p: &[f32]| {
            let unit = unit_from_net(p[0], p[1], side);
            region.point(&if mirror { Vec2::new(1.0 - unit.x, unit.y) } else { unit })
        };
        let lids: Vec<Vec2> = contour.chunks_exact(3).take(CONTOUR).map(place).collect();
        let iris: Vec<Vec2> = iris.chunks_exact(3).map(place).collect();
        Ok(describe(&lids, &iris))
    }
}

/// Squares around the `[left, right]` eye, turned along it.
fn regions(points: &[Vec3]) -> [Region; 2] {
    let corners = EYE_CORNERS.map(|ends| ends.map(|i| points[i].xy()));
    let widths = corners.map(|[a, b]| (b - a).norm());
    let least = NARROWEST * widths[0].max(widths[1]);
    std::array::from_fn(|eye| {
        let [a, b] = corners[eye];
        let along = b - a;
        Region { centre: (a + b) / 2.0, side: REGION_PER_EYE * widths[eye].max(least), angle: along.y.atan2(along.x) }
    })
}

/// The iris from the net's points: lids corner to corner below, then above from the outer corner; iris centre, then its
/// four extremes in turn.
fn describe(lids: &[Vec2], iris: &[Vec2]) -> Iris {
    let (below, above) = lids.split_at(9);
    let eye_contour: Vec<Vec2> = below.iter().chain(above.iter().rev()).copied().collect();
    let width = (lids[8] - lids[0]).norm();
    let openness = if width > 0.0 { area(&eye_contour) / (width * width) } else { 0.0 };
    let radius = (iris[1] - iris[3]).norm().max((iris[2] - iris[4]).norm()) / 2.0;
    let visible = openness > CLOSED && contains(&eye_contour, &iris[0]);
    Iris { centre: iris[0], radius, eye_contour, openness, visible }
}

/// The area inside a closed polygon.
fn area(polygon: &[Vec2]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().zip(next).map(|(a, b)| a.perp(b)).sum::<f64>().abs() / 2.0
}

/// Whether a point lies inside a closed polygon (crossing number).
fn contains(polygon: &[Vec2], point: &Vec2) -> bool {
    let next = polygon.iter().cycle().skip(1);
    let crossings = polygon.iter().zip(next).filter(|(a, b)| {
        (a.y > point.y) != (b.y > point.y) && point.x < a.x + (point.y - a.y) / (b.y - a.y) * (b.x - a.x)
    });
    crossings.count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lids of an eye 30 pixels wide and `open` pixels high, in the net's order.
    fn lids(open: f64) -> Vec<Vec2> {
        let at = |k: usize, sign: f64| {
            let t = k as f64 / 8.0;
            Vec2::new(30.0 * t, sign * open / 2.0 * (std::f64::consts::PI * t).sin())
        };
        (0..9).map(|k| at(k, 1.0)).chain((1..8).map(|k| at(k, -1.0))).collect()
    }

    fn iris_at(centre: Vec2) -> Vec<Vec2> {
        let around = [(0.0, 0.0), (-4.5, 0.0), (0.0, -5.0), (4.5, 0.0), (0.0, 5.0)];
        around.iter().map(|&(x, y)| centre + Vec2::new(x, y)).collect()
    }

    #[test]
    fn an_open_eye_shows_its_iris_and_a_closed_one_does_not() {
        let open = describe(&lids(10.0), &iris_at(Vec2::new(15.0, 0.0)));
        assert!(open.visible && (open.openness - 10.0 * 2.0 / std::f64::consts::PI / 30.0).abs() < 0.01);
        assert_eq!(open.radius, 5.0);
        assert!(!describe(&lids(2.0), &iris_at(Vec2::new(15.0, 0.0))).visible);
        assert!(!describe(&lids(10.0), &iris_at(Vec2::new(15.0, 9.0))).visible);
    }

    #[test]
    fn the_contour_runs_once_around_the_eye() {
        let contour = describe(&lids(10.0), &iris_at(Vec2::zeros())).eye_contour;
        let longest = (0..16).map(|k| (contour[k] - contour[(k + 1) % 16]).norm()).fold(0.0, f64::max);
        assert!(contour.len() == 16 && longest < 6.0);
    }
}
