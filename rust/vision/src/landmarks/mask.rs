//! Where in the picture the face's skin is.

use super::Face;
use geometry::Vec2;
use geometry::face_mesh::{FACE_OVAL, MOUTH_OPENING};
use image::{GrayImage, Luma};

/// What belongs to the mask.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaskOptions {
    /// Leave out what lies between the lids.
    pub exclude_eyes: bool,
    /// Leave out what lies between the lips.
    pub exclude_mouth: bool,
    /// How far the outline moves towards the middle of the face, as a fraction of its distance from it. Negative
    /// widens.
    pub shrink: f64,
}

impl Default for MaskOptions {
    fn default() -> Self {
        Self { exclude_eyes: true, exclude_mouth: true, shrink: 0.0 }
    }
}

/// A picture of `width` × `height` that is 255 where the face's skin is and 0 elsewhere.
///
/// The outline is the face oval; it ends below the hair line and does not include ears and neck.
pub fn face_mask(face: &Face, width: u32, height: u32, options: &MaskOptions) -> GrayImage {
    let mut mask = GrayImage::new(width, height);
    fill_polygon(&mut mask, &oval(face, options.shrink), 255);
    if options.exclude_eyes {
        face.irises.iter().for_each(|iris| fill_polygon(&mut mask, &iris.eye_contour, 0));
    }
    if options.exclude_mouth {
        fill_polygon(&mut mask, &MOUTH_OPENING.map(|i| face.points[i].xy()), 0);
    }
    mask
}

/// The face oval, drawn in towards its middle.
fn oval(face: &Face, shrink: f64) -> Vec<Vec2> {
    let outline = FACE_OVAL.map(|i| face.points[i].xy());
    let middle = outline.iter().sum::<Vec2>() / outline.len() as f64;
    outline.iter().map(|point| point + (middle - point) * shrink).collect()
}

/// Sets the pixels whose centres a closed polygon winds around. (The oval of a face turned far aside crosses itself, so
/// crossings must not cancel.)
pub fn fill_polygon(mask: &mut GrayImage, polygon: &[Vec2], value: u8) {
    let (width, height) = (i64::from(mask.width()), i64::from(mask.height()));
    let top = polygon.iter().map(|p| p.y).fold(f64::INFINITY, f64::min).ceil().max(0.0) as i64;
    let bottom = polygon.iter().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max).floor() as i64;
    for y in top..=bottom.min(height - 1) {
        let crossings = crossings(polygon, y as f64);
        let mut winding = 0;
        for pair in crossings.windows(2) {
            winding += pair[0].1;
            if winding != 0 {
                let (from, to) = (pair[0].0.ceil().max(0.0) as i64, pair[1].0.floor() as i64);
                (from..=to.min(width - 1)).for_each(|x| mask.put_pixel(x as u32, y as u32, Luma([value])));
            }
        }
    }
}

/// Where a polygon crosses a row, left to right, and whether downwards (1) or upwards (−1).
fn crossings(polygon: &[Vec2], y: f64) -> Vec<(f64, i32)> {
    let next = polygon.iter().cycle().skip(1);
    let edges = polygon.iter().zip(next).filter(|(a, b)| (a.y > y) != (b.y > y));
    let mut found: Vec<(f64, i32)> =
        edges.map(|(a, b)| (a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x), if b.y > a.y { 1 } else { -1 })).collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(mask: &GrayImage) -> usize {
        mask.pixels().filter(|p| p.0[0] == 255).count()
    }

    #[test]
    fn a_polygon_holds_the_pixel_centres_inside_it() {
        let mut mask = GrayImage::new(20, 20);
        let square = [(2.5, 3.5), (12.5, 3.5), (12.5, 9.5), (2.5, 9.5)].map(|(x, y)| Vec2::new(x, y));
        fill_polygon(&mut mask, &square, 255);
        assert_eq!(count(&mask), 60);
        assert_eq!((mask.get_pixel(3, 4).0[0], mask.get_pixel(2, 4).0[0]), (255, 0));
    }

    #[test]
    fn a_polygon_that_crosses_itself_has_no_holes() {
        let star = (0..5).map(|k| f64::from(k) * 0.8 * std::f64::consts::PI);
        let star: Vec<Vec2> = star.map(|a| Vec2::new(50.0 + 40.0 * a.cos(), 50.0 + 40.0 * a.sin())).collect();
        let mut mask = GrayImage::new(100, 100);
        fill_polygon(&mut mask, &star, 255);
        assert_eq!(mask.get_pixel(50, 50).0[0], 255);
    }

    #[test]
    fn a_polygon_beyond_the_picture_is_clipped() {
        let mut mask = GrayImage::new(10, 10);
        let large = [(-50.0, -50.0), (60.0, -50.0), (60.0, 60.0), (-50.0, 60.0)].map(|(x, y)| Vec2::new(x, y));
        fill_polygon(&mut mask, &large, 255);
        assert_eq!(count(&mask), 100);
    }
}
