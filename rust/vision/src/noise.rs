//! How noisy a picture is: what of its grey levels is no texture.
//!
//! # Entry points
//! [`noise`].
//!
//! # Source
//! Immerkær, "Fast noise variance estimation", 1996: the difference of two Laplacians sees neither slopes nor straight
//! edges; the median over the pixels leaves out what texture it sees.

use image::GrayImage;

/// Root of the summed squares of the mask `[1 −2 1]ᵀ [1 −2 1]`.
const MASK_NORM: f64 = 6.0;
/// Median of the absolute value of a standard normal deviate.
const MEDIAN_DEVIATE: f64 = 0.674_49;
/// Largest value of the mask's answer.
const LARGEST: usize = 8 * 255;

/// Standard deviation of the noise, grey levels, over the pixels where `mask` is not zero (all without one); `None` where
/// there are too few. Compression that smooths a picture smooths its noise too.
pub fn noise(picture: &GrayImage, mask: Option<&GrayImage>) -> Option<f64> {
    const FEWEST: usize = 64;
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    if width < 3 || height < 3 || mask.is_some_and(|m| m.dimensions() != picture.dimensions()) {
        return None;
    }
    let pixels = picture.as_raw();
    let mut histogram = vec![0_usize; LARGEST + 1];
    for y in 1..height - 1 {
        let [above, here, below] = [y - 1, y, y + 1].map(|y| &pixels[y * width..][..width]);
        let allowed = mask.map(|mask| &mask.as_raw()[y * width..][..width]);
        for x in (1..width - 1).filter(|&x| allowed.is_none_or(|row| row[x] != 0)) {
            let row = |row: &[u8]| i32::from(row[x - 1]) - 2 * i32::from(row[x]) + i32::from(row[x + 1]);
            histogram[(row(above) - 2 * row(here) + row(below)).unsigned_abs() as usize] += 1;
        }
    }
    let count: usize = histogram.iter().sum();
    (count >= FEWEST).then(|| middle(&histogram, count) / (MASK_NORM * MEDIAN_DEVIATE))
}

/// The median of whole numbers that stand for the interval around them.
fn middle(histogram: &[usize], count: usize) -> f64 {
    let (half, mut below) = (0.5 * count as f64, 0.0);
    for (value, &n) in histogram.iter().enumerate() {
        let n = n as f64;
        if below + n >= half {
            // Of absolute values, zero stands for half an interval.
            let (first, width) = if value == 0 { (0.0, 0.5) } else { (value as f64 - 0.5, 1.0) };
            return first + width * (half - below) / n;
        }
        below += n;
    }
    0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;
    use synthetic::Random;

    fn picture(sigma: f64) -> GrayImage {
        let mut random = Random::new(5);
        GrayImage::from_fn(120, 90, |x, y| {
            let texture = 120.0 + 0.8 * f64::from(x) - 0.3 * f64::from(y) + 40.0 * (0.11 * f64::from(x + y)).sin();
            Luma([(texture + sigma * random.normal()).round().clamp(0.0, 255.0) as u8])
        })
    }

    #[test]
    fn the_noise_is_found_beside_slopes_and_waves() {
        for sigma in [1.0, 2.0, 5.0] {
            let found = noise(&picture(sigma), None).unwrap();
            // Rounding to whole grey levels adds its own noise.
            let truth = f64::hypot(sigma, 12.0_f64.sqrt().recip());
            assert!((found / truth - 1.0).abs() < 0.1, "{found} instead of {truth}");
        }
        assert!(noise(&picture(0.0), None).unwrap() < 0.45);
    }

    #[test]
    fn only_the_mask_counts() {
        let mut split = picture(1.0);
        let loud = picture(8.0);
        let mask = GrayImage::from_fn(120, 90, |x, _| Luma([u8::from(x < 55)]));
        (60..120).for_each(|x| (0..90).for_each(|y| split.put_pixel(x, y, *loud.get_pixel(x, y))));
        assert!(noise(&split, Some(&mask)).unwrap() < 1.2);
    }

    #[test]
    fn too_few_pixels_tell_nothing() {
        assert!(noise(&GrayImage::new(2, 50), None).is_none());
        assert!(noise(&GrayImage::new(50, 50), Some(&GrayImage::new(50, 50))).is_none());
        assert!(noise(&GrayImage::new(50, 50), Some(&GrayImage::new(40, 50))).is_none());
        assert_eq!(noise(&GrayImage::new(50, 50), None), Some(0.25 / (6.0 * MEDIAN_DEVIATE)));
    }
}
