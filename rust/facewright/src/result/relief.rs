//! What the skin has between its vertices, as pictures over the skin's texture coordinates.

use crate::FacewrightError;
use crate::files::unwritable;
use dense::Maps;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::path::Path;

/// Heights from black to white at least, metres: of a finer scale steps would be finer than anything that can be measured.
const LEAST: f64 = 0.001;

/// Heights over the smooth surface that a subdivided head tends to, as far as they were measured, and the slopes of the same.
#[derive(Clone, Debug, PartialEq)]
pub struct Relief {
    /// Side of both pictures, pixels.
    pub size: u32,
    /// Heights; 32768 is none.
    pub displacement: Vec<u16>,
    /// Heights from 0 to 65535, metres.
    pub displacement_m: f64,
    /// Normals in tangent space as glTF has them: RGB from -1 to 1, green along v upwards.
    pub normals: Vec<u8>,
}

impl Relief {
    pub(crate) fn of(maps: &Maps) -> Self {
        let highest = maps.heights.iter().map(|height| f64::from(height.abs())).fold(0.0, f64::max);
        let displacement_m = (2.0 * highest).max(LEAST);
        let level =
            |height: &f32| (32768.0 + f64::from(*height) / displacement_m * 65535.0).round().clamp(0.0, 65535.0);
        let byte = |x: &f32| ((f64::from(*x) + 1.0) * 127.5).round() as u8;
        Self {
            size: maps.size as u32,
            displacement: maps.heights.iter().map(|height| level(height) as u16).collect(),
            displacement_m,
            normals: maps.normals.iter().flatten().map(byte).collect(),
        }
    }

    /// `displacement.png`: grey, 16 bits.
    pub(crate) fn displacement_png(&self) -> Result<Vec<u8>, FacewrightError> {
        let bytes: Vec<u8> = self.displacement.iter().flat_map(|level| level.to_ne_bytes()).collect();
        self.png(&bytes, ExtendedColorType::L16)
    }

    pub(crate) fn normal_png(&self) -> Result<Vec<u8>, FacewrightError> {
        self.png(&self.normals, ExtendedColorType::Rgb8)
    }

    fn png(&self, bytes: &[u8], colour: ExtendedColorType) -> Result<Vec<u8>, FacewrightError> {
        let mut file = Vec::new();
        let written = PngEncoder::new(&mut file).write_image(bytes, self.size, self.size, colour);
        written.map_err(|e| unwritable(Path::new("displacement.png"), &e))?;
        Ok(file)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn maps(heights: [f32; 4]) -> Maps {
        Maps {
            size: 2,
            heights: heights.to_vec(),
            normals: vec![[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.0, -0.6, 0.8], [0.0, 0.0, 1.0]],
        }
    }

    #[test]
    fn heights_are_read_back_from_the_file_by_their_scale() {
        let relief = Relief::of(&maps([0.0, 0.0008, -0.0004, 1e-5]));
        let read = image::load_from_memory(&relief.displacement_png().unwrap()).unwrap().to_luma16();
        // Rounding to the nearest level errs by half of one, and a little more in the last digits.
        let step = relief.displacement_m / 65535.0;
        let height = |x: u32, y: u32| (f64::from(read.get_pixel(x, y)[0]) - 32768.0) * step;
        for (found, truth) in
            [(height(0, 0), 0.0), (height(1, 0), 0.0008), (height(0, 1), -0.0004), (height(1, 1), 1e-5)]
        {
            assert!((found - truth).abs() < 0.501 * step, "{found} {truth}");
        }
    }

    #[test]
    fn normals_are_those_of_a_picture_and_flat_skin_is_lilac() {
        let relief = Relief::of(&maps([0.0; 4]));
        let read = image::load_from_memory(&relief.normal_png().unwrap()).unwrap().to_rgb8();
        assert_eq!(read.get_pixel(0, 0).0, [128, 128, 255]);
        assert_eq!((read.get_pixel(1, 0)[0], read.get_pixel(0, 1)[1]), (204, 51));
        assert_eq!(relief.displacement_m, LEAST);
    }
}
