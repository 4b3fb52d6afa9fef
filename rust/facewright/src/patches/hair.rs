//! Hair that falls over the forehead, told from its skin by two clusters of colours.
//!
//! The face's oval ends at the skull's usual hair line, not at the person's: a fringe lies on it, and its points would be taken for the
//! forehead's surface. Hair is what lies above the oval and still belongs to the person; skin is the middle of the face. Each is a normal
//! distribution of colours, and a pixel of the forehead is hair where that of hair is the likelier one.

use geometry::Vec2;
use geometry::face_mesh::{BROWS_UPPER, FACE_OVAL};
use image::{GrayImage, RgbImage};
use nalgebra::{Matrix3, Vector3};
use vision::landmarks::{Face, MaskOptions, PersonMask, face_mask};

/// Where the oval has its top, and the chin.
const TOP: usize = 0;
const CHIN: usize = 18;
/// Hair is looked for so far above the oval's top, in heights of the oval.
const ABOVE: [f64; 2] = [0.10, 0.45];
/// The oval is drawn in by this part for colours of skin that hair and beard do not reach.
const SHRINK: f64 = 0.25;
/// The forehead begins so far above the brows, in heights of the oval: brows have hair too, and good points.
const ABOVE_BROWS: f64 = 0.03;
/// Colours are means of squares of this size, in heights of the oval: strands, not pixels.
const SQUARE: f64 = 0.016;
/// Samples of a cluster along each axis of what it is taken from.
const SAMPLES: usize = 48;
/// Fewest samples that make a cluster.
const FEWEST: usize = 50;
/// Least variance of a colour, squared grey levels.
const LEAST_VARIANCE: f64 = 16.0;
/// Clusters nearer than this (Bhattacharyya's distance; 4 % of either are taken for the other at most) are not told apart: the person is
/// bald, or covered, or the hair has the colour of the skin.
const APART: f64 = 2.0;

/// Colours of one kind.
struct Cluster {
    mean: Vector3<f64>,
    covariance: Matrix3<f64>,
    precision: Matrix3<f64>,
    log_volume: f64,
}

impl Cluster {
    fn of(colours: &[Vector3<f64>]) -> Option<Self> {
        let count = colours.len() as f64;
        if colours.len() < FEWEST {
            return None;
        }
        let mean = colours.iter().sum::<Vector3<f64>>() / count;
        let spread = colours.iter().map(|c| (c - mean) * (c - mean).transpose()).sum::<Matrix3<f64>>() / count;
        let covariance = spread + Matrix3::identity() * LEAST_VARIANCE;
        let precision = covariance.try_inverse()?;
        Some(Self { mean, covariance, precision, log_volume: covariance.determinant().ln() })
    }

    /// Twice the negative logarithm of the likelihood of a colour, but for a constant.
    fn unlikely(&self, colour: &Vector3<f64>) -> f64 {
        let off = colour - self.mean;
        off.dot(&(self.precision * off)) + self.log_volume
    }

    /// Bhattacharyya's distance.
    fn distance(&self, other: &Self) -> f64 {
        let (off, both) = (self.mean - other.mean, (self.covariance + other.covariance) / 2.0);
        let spread = both.try_inverse().map_or(0.0, |inverse| off.dot(&(inverse * off)));
        spread / 8.0 + (both.determinant().ln() - (self.log_volume + other.log_volume) / 2.0) / 2.0
    }
}

/// A head's own axes in a picture: where the oval's chin and top are.
struct Upright {
    chin: Vec2,
    up: Vec2,
}

impl Upright {
    fn of(face: &Face) -> Self {
        let [top, chin] = [TOP, CHIN].map(|k| face.points[FACE_OVAL[k]].xy());
        Self { chin, up: top - chin }
    }

    /// Height of a pixel: 0 at the chin, 1 at the oval's top.
    fn height(&self, pixel: &Vec2) -> f64 {
        self.up.dot(&(pixel - self.chin)) / self.up.norm_squared().max(1.0)
    }

    /// Pixels spread over the face's width between two heights.
    fn pixels(&self, [low, high]: [f64; 2]) -> impl Iterator<Item = Vec2> {
        let part = |k: usize| (k as f64 + 0.5) / SAMPLES as f64;
        let across = Vec2::new(-self.up.y, self.up.x);
        let pixel = move |i: usize| {
            let (column, row) = (part(i % SAMPLES), part(i / SAMPLES));
            self.chin + self.up * (low + (high - low) * row) + across * (column - 0.5)
        };
        (0..SAMPLES * SAMPLES).map(pixel)
    }
}

/// Hair and skin of a person in one frame.
pub struct Hair<'a> {
    picture: &'a RgbImage,
    upright: Upright,
    hair: Cluster,
    skin: Cluster,
    /// Height from which on a pixel is the forehead's.
    forehead: f64,
    /// Pixels on each side of the middle one of a square.
    reach: i64,
}

impl<'a> Hair<'a> {
    /// Where hair and skin can be told apart.
    pub fn of(picture: &'a RgbImage, face: &Face, person: &PersonMask) -> Option<Self> {
        let upright = Upright::of(face);
        let reach = (SQUARE * upright.up.norm() / 2.0).round() as i64;
        let options = MaskOptions { shrink: SHRINK, ..MaskOptions::default() };
        let oval = face_mask(face, picture.width(), picture.height(), &options);
        let cluster = |heights: [f64; 2], is_of_it: &dyn Fn(&Vec2) -> bool| {
            let pixels = upright.pixels(heights).filter(is_of_it);
            Cluster::of(&pixels.filter_map(|pixel| mean(picture, &pixel, reach)).collect::<Vec<_>>())
        };
        let hair = cluster([1.0 + ABOVE[0], 1.0 + ABOVE[1]], &|pixel| {
            person.distance(pixel).is_some_and(|distance| distance > person.rim())
        })?;
        let skin = cluster([0.0, 1.0], &|pixel| value(&oval, pixel).is_some_and(|value| value != 0))?;
        let brows = BROWS_UPPER.iter().flatten().map(|&i| upright.height(&face.points[i].xy())).fold(0.0, f64::max);
        let is_told = hair.distance(&skin) > APART;
        is_told.then_some(Self { picture, upright, hair, skin, forehead: brows + ABOVE_BROWS, reach })
    }

    /// Whether a pixel of the frame shows hair before or above the forehead.
    fn is_hair(&self, pixel: &Vec2) -> bool {
        self.upright.height(pixel) > self.forehead
            && mean(self.picture, pixel, self.reach)
                .is_some_and(|colour| self.hair.unlikely(&colour) < self.skin.unlikely(&colour))
    }

    /// Clears what of a mask is hair, and `margin` pixels of the mask around it. `pixel` is the frame's pixel of one of the mask.
    pub fn clear(&self, mask: &mut GrayImage, margin: i64, pixel: impl Fn(&Vec2) -> Vec2) {
        let at = |x: u32, y: u32| pixel(&Vec2::new(f64::from(x), f64::from(y)));
        let found = mask.enumerate_pixels().filter(|(x, y, shown)| shown.0[0] != 0 && self.is_hair(&at(*x, *y)));
        let hair: Vec<(i64, i64)> = found.map(|(x, y, _)| (i64::from(x), i64::from(y))).collect();
        let (width, height) = (i64::from(mask.width()), i64::from(mask.height()));
        for (x, y) in hair {
            for row in (y - margin).max(0)..=(y + margin).min(height - 1) {
                for column in (x - margin).max(0)..=(x + margin).min(width - 1) {
                    mask.get_pixel_mut(column as u32, row as u32).0[0] = 0;
                }
            }
        }
    }
}

fn value(mask: &GrayImage, pixel: &Vec2) -> Option<u8> {
    let inside = pixel.x >= 0.0 && pixel.y >= 0.0;
    inside.then(|| mask.get_pixel_checked(pixel.x.round() as u32, pixel.y.round() as u32)).flatten().map(|p| p.0[0])
}

/// The mean colour of the square around a pixel, as far as it is in the picture; `None` where the pixel is not.
fn mean(picture: &RgbImage, pixel: &Vec2, reach: i64) -> Option<Vector3<f64>> {
    let (x, y) = (pixel.x.round() as i64, pixel.y.round() as i64);
    let (width, height) = (i64::from(picture.width()), i64::from(picture.height()));
    if x < 0 || y < 0 || x >= width || y >= height {
        return None;
    }
    let (mut sum, mut count) = (Vector3::zeros(), 0.0);
    for row in (y - reach).max(0)..=(y + reach).min(height - 1) {
        for column in (x - reach).max(0)..=(x + reach).min(width - 1) {
            sum += Vector3::from(picture.get_pixel(column as u32, row as u32).0.map(f64::from));
            count += 1.0;
        }
    }
    Some(sum / count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Luma, Rgb};

    fn cluster(mean: [f64; 3], spread: f64) -> Cluster {
        let colours: Vec<Vector3<f64>> = (0..64)
            .map(|i| {
                Vector3::from(mean) + Vector3::new(i % 4, i / 4 % 4, i / 16).map(|k| (f64::from(k) - 1.5) * spread)
            })
            .collect();
        Cluster::of(&colours).unwrap()
    }

    /// Skin with a fringe whose lower edge is at row 40, and stripes of brows at row 70; the oval from row 20 to row 120.
    fn forehead(picture: &RgbImage) -> Hair<'_> {
        Hair {
            picture,
            upright: Upright { chin: Vec2::new(60.0, 120.0), up: Vec2::new(0.0, -100.0) },
            hair: cluster([40.0, 30.0, 25.0], 8.0),
            skin: cluster([200.0, 150.0, 120.0], 12.0),
            forehead: 0.6,
            reach: 0,
        }
    }

    #[test]
    fn a_fringe_is_cleared_with_its_edge_and_brows_stay() {
        let picture = RgbImage::from_fn(120, 140, |_, y| match y {
            0..40 | 68..72 => Rgb([45, 33, 28]),
            _ => Rgb([190, 140, 115]),
        });
        let mut mask = GrayImage::from_pixel(60, 70, Luma([255]));
        // A mask of the halved picture.
        forehead(&picture).clear(&mut mask, 2, |pixel| pixel * 2.0);
        let at = |y: u32| mask.get_pixel(30, y).0[0];
        assert_eq!([at(3), at(19), at(21), at(22), at(35), at(60)], [0, 0, 0, 255, 255, 255]);
    }

    #[test]
    fn hair_of_the_colour_of_skin_is_not_told_from_it() {
        let skin = cluster([200.0, 150.0, 120.0], 12.0);
        assert!(cluster([190.0, 150.0, 118.0], 12.0).distance(&skin) < APART);
        assert!(cluster([40.0, 30.0, 25.0], 8.0).distance(&skin) > APART);
        assert!(skin.distance(&skin).abs() < 1e-9);
    }

    #[test]
    fn samples_lie_between_their_heights() {
        let upright = Upright { chin: Vec2::new(10.0, 50.0), up: Vec2::new(30.0, -40.0) };
        assert!(upright.pixels([0.2, 0.7]).all(|pixel| (0.2..0.7).contains(&upright.height(&pixel))));
    }

    #[test]
    fn a_square_ends_at_the_border_of_the_picture() {
        let picture = RgbImage::from_fn(4, 4, |x, _| Rgb([(10 * x) as u8; 3]));
        assert_eq!(mean(&picture, &Vec2::new(0.2, 0.0), 1), Some(Vector3::repeat(5.0)));
        assert_eq!(mean(&picture, &Vec2::new(-0.6, 0.0), 1), None);
    }
}
