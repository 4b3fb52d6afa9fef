//! Pictures whose truth is known: the project's own clip, and pictures that are computed.

pub mod board;
pub mod clip;
pub mod head;
pub mod seen;

use image::{GrayImage, Luma};
use synthetic::Random;

/// A picture of grey levels with the noise of a sensor.
fn noisy(width: u32, grey: &[f64], sigma: f64, random: &mut Random) -> GrayImage {
    let height = grey.len() as u32 / width.max(1);
    GrayImage::from_fn(width, height, |x, y| {
        let level = grey[(y * width + x) as usize] + sigma * random.normal();
        Luma([level.round().clamp(0.0, 255.0) as u8])
    })
}
