//! Whether a JPEG holds all of its picture: decoders fill up what is missing, and say nothing.
//!
//! A file may go on after its picture (phones put a film there) or lack the end marker, and be whole. What tells is whether the
//! picture depends on what comes after the data: only where some are missing does it.

use image::error::{DecodingError, ImageFormatHint};
use image::{DynamicImage, GenericImageView, ImageError, ImageFormat, ImageResult};
use std::path::Path;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::options::DecoderOptions;

/// Rows and columns of one block.
const BLOCK: u32 = 8;
/// Two continuations that mean something else to every code.
const CONTINUED: [[u8; 4]; 2] = [[0x00; 4], [0xb5, 0x6a, 0xd4, 0xa9]];
/// So often: more than any block takes.
const CONTINUATION: usize = 256;
/// The end marker.
const END: [u8; 2] = [0xff, 0xd9];
/// A file that was made in its full length before its data came is zeros where they did not; picture data have no such run.
const NOTHING: usize = 32;

/// Refuses a JPEG of which a part is missing; `picture` is what was decoded, as it is stored.
pub(super) fn check(path: &Path, picture: &DynamicImage) -> ImageResult<()> {
    let bytes = std::fs::read(path)?;
    let (data, ends) = scans(&bytes);
    // What is filled up is flat to the last block; that is looked at first, as it costs nothing.
    if ends && !last_block_is_flat(picture) {
        return Ok(());
    }
    if has_broken_code(data) || depends_on_more(data) {
        let jpeg = ImageFormatHint::Exact(ImageFormat::Jpeg);
        return Err(ImageError::Decoding(DecodingError::new(jpeg, "a part of the picture is missing")));
    }
    Ok(())
}

/// The bytes up to the end of the last scan, and whether an end marker follows.
fn scans(bytes: &[u8]) -> (&[u8], bool) {
    let mut at = 2;
    while let Some(&[prefix, marker]) = bytes.get(at..at + 2) {
        match marker {
            0xd9 if prefix == 0xff => return (&bytes[..at], true),
            // A segment, with its length.
            0xc0..=0xcf | 0xda..=0xfe if prefix == 0xff => {
                let length = bytes.get(at + 2..at + 4).map_or(2, |l| usize::from(l[0]) << 8 | usize::from(l[1]));
                at += 2 + length;
            }
            // In a scan, or between segments.
            _ => at += 1,
        }
    }
    let zeros = bytes.iter().rev().take_while(|byte| **byte == 0).count();
    (if zeros > NOTHING { &bytes[..bytes.len() - zeros] } else { bytes }, false)
}

fn last_block_is_flat(picture: &DynamicImage) -> bool {
    let (width, height) = picture.dimensions();
    let last = picture.get_pixel(width - 1, height - 1);
    let rest = |size: u32| size.saturating_sub((size - 1) % BLOCK + 1)..size;
    rest(height).all(|y| rest(width).all(|x| picture.get_pixel(x, y) == last))
}

/// Whether the data hold what stands for nothing.
fn has_broken_code(data: &[u8]) -> bool {
    let options = DecoderOptions::default().set_strict_mode(true).set_max_width(usize::MAX).set_max_height(usize::MAX);
    let outcome = JpegDecoder::new_with_options(ZCursor::new(ended(data, &[])), options).decode();
    // Every decoder reads some of what the standard forbids.
    outcome.is_err_and(|error| !error.to_string().contains("strict-mode"))
}

fn ended(data: &[u8], more: &[u8]) -> Vec<u8> {
    [data, more, &END].concat()
}

/// Whether the picture is another when its data go on in another way.
fn depends_on_more(data: &[u8]) -> bool {
    let decoded = CONTINUED.map(|pattern| {
        let longer = ended(data, &pattern.repeat(CONTINUATION));
        image::load_from_memory_with_format(&longer, ImageFormat::Jpeg).ok().map(DynamicImage::into_bytes)
    });
    decoded[0] != decoded[1]
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::codecs::jpeg::JpegEncoder;
    use image::{Rgb, RgbImage};

    fn jpeg() -> Vec<u8> {
        let picture = RgbImage::from_fn(96, 64, |x, y| Rgb([(x * 5 % 251) as u8, (y * 3) as u8, (x * y % 97) as u8]));
        let mut bytes = Vec::new();
        picture.write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, 80)).unwrap();
        bytes
    }

    fn is_whole(bytes: &[u8]) -> bool {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.jpg");
        std::fs::write(&path, bytes).unwrap();
        image::load_from_memory(bytes).and_then(|picture| check(&path, &picture)).is_ok()
    }

    #[test]
    fn a_whole_picture_may_lack_its_end_or_go_on_after_it() {
        let bytes = jpeg();
        assert!(is_whole(&bytes) && is_whole(&bytes[..bytes.len() - 2]));
        assert!(is_whole(&[&bytes[..], &jpeg()[..300], &[0xff; 9]].concat()));
        let dark = RgbImage::new(64, 64);
        let mut flat = Vec::new();
        dark.write_with_encoder(JpegEncoder::new_with_quality(&mut flat, 80)).unwrap();
        assert!(is_whole(&flat), "a flat corner alone is no damage");
    }

    #[test]
    fn a_picture_that_is_cut_off_anywhere_is_none() {
        let bytes = jpeg();
        let start = bytes.windows(2).position(|two| two == [0xff, 0xda]).unwrap() + 14;
        for cut in (start..bytes.len() - 8).step_by(37) {
            assert!(!is_whole(&bytes[..cut]), "cut off after {cut} of {} bytes", bytes.len());
            let padded = [&bytes[..cut], &vec![0; bytes.len() - cut + NOTHING][..]].concat();
            assert!(!is_whole(&padded), "zeros after {cut} of {} bytes", bytes.len());
        }
    }
}
