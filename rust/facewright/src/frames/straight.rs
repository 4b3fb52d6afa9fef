//! Pictures as another camera at the same place would have taken them.

use geometry::PixelMap;
use image::{Rgb, RgbImage};

/// The values at a map's places, by cubic convolution (Keys 1981), which keeps what trackers and textures need; black where the map
/// leads out of the picture.
pub(crate) fn resampled(picture: &RgbImage, map: &PixelMap) -> RgbImage {
    let (width, height) = picture.dimensions();
    RgbImage::from_fn(map.width, map.height, |x, y| {
        let [u, v] = map.source[(y * map.width + x) as usize];
        let inside = u >= 0.0 && v >= 0.0 && u <= width as f32 - 1.0 && v <= height as f32 - 1.0;
        if inside { cubic(picture, u, v) } else { Rgb([0; 3]) }
    })
}

fn cubic(picture: &RgbImage, u: f32, v: f32) -> Rgb<u8> {
    let (x, y) = (u as i32, v as i32);
    let (along, down) = (weights(u - x as f32), weights(v - y as f32));
    let clamped = |at: i32, size: u32| at.clamp(0, size as i32 - 1) as u32;
    let mut sum = [0.0f32; 3];
    for (j, down) in (-1..).zip(down) {
        for (i, along) in (-1..).zip(along) {
            let pixel = picture.get_pixel(clamped(x + i, picture.width()), clamped(y + j, picture.height()));
            (0..3).for_each(|c| sum[c] += along * down * f32::from(pixel.0[c]));
        }
    }
    Rgb(sum.map(|value| value.round().clamp(0.0, 255.0) as u8))
}

/// Weights of the four pixels around a place that is `t` of the way from the second to the third.
fn weights(t: f32) -> [f32; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [-0.5 * t3 + t2 - 0.5 * t, 1.5 * t3 - 2.5 * t2 + 1.0, -1.5 * t3 + 2.0 * t2 + 0.5 * t, 0.5 * t3 - 0.5 * t2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_stay_and_slopes_are_kept_between_them() {
        let picture = RgbImage::from_fn(8, 8, |x, y| Rgb([(20 * x + 5 * y) as u8; 3]));
        let source = vec![[3.0, 4.0], [3.25, 4.0], [3.5, 4.4], [-0.1, 2.0], [f32::NAN, 0.0], [7.0, 7.0]];
        let found = resampled(&picture, &PixelMap { width: 6, height: 1, source });
        let values: Vec<u8> = found.pixels().map(|p| p.0[0]).collect();
        assert_eq!(values, [80, 85, 92, 0, 0, 175]);
    }
}
