//! One picture from its file.

use super::{foreign, whole};
use crate::FacewrightError;
use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, RgbImage};
use std::path::Path;

/// Diagonal of a 36 × 24 mm film frame, to which "35 mm equivalent" focal lengths refer.
const FILM_DIAGONAL_MM: f64 = 43.267;

/// Pixels of the largest picture that is read: more than any camera's sensor has …
const MOST_PIXELS: u64 = 1 << 28;
/// … and of one that may be of any few bytes, as a plain one is.
const PLAIN_PIXELS: u64 = 1 << 24;
/// Pixels of a larger one for each byte of its file: a PNG holds at most 1032 bytes in one, of 8 pixels each; a JPEG takes a bit for 64.
const PIXELS_PER_BYTE: u64 = 8 * 1032;

/// What a picture's header tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Header {
    /// Width and height as they are stored.
    pub(super) stored: (u32, u32),
    /// How it is turned upright.
    pub(super) orientation: Orientation,
}

impl Header {
    /// Reads it.
    pub(super) fn read(path: &Path) -> Result<Self, FacewrightError> {
        let refused = |e: &ImageError| undecodable(path, e);
        let reader = ImageReader::open(path).and_then(ImageReader::with_guessed_format);
        let mut decoder = reader.map_err(|e| unreadable(path, &e))?.into_decoder().map_err(|e| refused(&e))?;
        let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
        let stored = decoder.dimensions();
        check_size(path, stored)?;
        Ok(Self { stored, orientation })
    }

    /// Width and height after a turn.
    pub(super) fn size(&self, turn: Orientation) -> (u32, u32) {
        use Orientation::{Rotate90, Rotate90FlipH, Rotate270, Rotate270FlipH};
        let (width, height) = self.stored;
        let is_turned = matches!(turn, Rotate90 | Rotate270 | Rotate90FlipH | Rotate270FlipH);
        if is_turned { (height, width) } else { (width, height) }
    }
}

/// Refuses a picture that says to be larger than it can be, before memory is asked for.
fn check_size(path: &Path, (width, height): (u32, u32)) -> Result<(), FacewrightError> {
    let pixels = u64::from(width) * u64::from(height);
    let bytes = std::fs::metadata(path).map_err(|e| unreadable(path, &e))?.len();
    if pixels > PLAIN_PIXELS.max(bytes.saturating_mul(PIXELS_PER_BYTE)) {
        let reason = format!(
            "it has {bytes} bytes for {width}x{height} pixels, as no photograph has: copy it again from where it comes from, or leave it out"
        );
        return Err(unreadable(path, &reason));
    }
    if pixels > MOST_PIXELS {
        let most = MOST_PIXELS / 1_000_000;
        let reason =
            format!("it is of {width}x{height} pixels, and at most {most} million are read here: scale it down");
        return Err(unreadable(path, &reason));
    }
    Ok(())
}

/// Decodes a picture of any depth to 8-bit RGB, turned as it says itself or as is said here.
pub(super) fn load_picture(path: &Path, turn: Option<Orientation>) -> Result<RgbImage, FacewrightError> {
    let reader = ImageReader::open(path).and_then(ImageReader::with_guessed_format);
    let reader = reader.map_err(|e| unreadable(path, &e))?;
    let is_jpeg = reader.format() == Some(ImageFormat::Jpeg);
    let decode = || -> Result<DynamicImage, ImageError> {
        let mut decoder = reader.into_decoder()?;
        let own = decoder.orientation()?;
        let mut picture = DynamicImage::from_decoder(decoder)?;
        if is_jpeg {
            whole::check(path, &picture)?;
        }
        picture.apply_orientation(turn.unwrap_or(own));
        Ok(picture)
    };
    decode().map(DynamicImage::into_rgb8).map_err(|e| undecodable(path, &e))
}

/// Focal length in pixels from the "35 mm equivalent" that cameras and phones write.
pub(super) fn exif_focal(path: &Path, (width, height): (u32, u32)) -> Option<f64> {
    let file = std::fs::File::open(path).ok()?;
    let exif = exif::Reader::new().read_from_container(&mut std::io::BufReader::new(file)).ok()?;
    let field = exif.get_field(exif::Tag::FocalLengthIn35mmFilm, exif::In::PRIMARY)?;
    let millimetres = f64::from(field.value.get_uint(0)?);
    let diagonal = f64::from(width).hypot(f64::from(height));
    (millimetres > 0.0).then(|| millimetres * diagonal / FILM_DIAGONAL_MM)
}

pub(super) fn unreadable(path: &Path, reason: &dyn std::fmt::Display) -> FacewrightError {
    FacewrightError::Read { path: path.to_owned(), reason: reason.to_string() }
}

/// What to say of a file that the decoder refused.
fn undecodable(path: &Path, error: &ImageError) -> FacewrightError {
    if let Some(reason) = foreign::by_content(path) {
        return unreadable(path, &reason);
    }
    match error {
        _ if !foreign::begins_as_picture(path) => {
            unreadable(path, &"it is no picture that is read here: save it as JPEG or PNG, or leave it out")
        }
        ImageError::Decoding(_) | ImageError::IoError(_) => {
            unreadable(path, &"it is damaged or cut off: copy it again from where it comes from, or leave it out")
        }
        _ => unreadable(path, error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_damaged_picture_of_any_kind_is_refused_with_what_to_do() {
        let folder = tempfile::tempdir().unwrap();
        let picture =
            RgbImage::from_fn(96, 64, |x, y| image::Rgb([(x * 5 % 251) as u8, (y * 3) as u8, (x * y % 97) as u8]));
        for name in ["a.jpg", "a.png", "a.tif", "a.bmp", "a.webp"] {
            let path = folder.path().join(name);
            picture.save(&path).unwrap();
            assert_eq!(load_picture(&path, None).unwrap().dimensions(), (96, 64));
            let bytes = std::fs::read(&path).unwrap();
            for part in [bytes.len() / 2, bytes.len() * 9 / 10] {
                std::fs::write(&path, &bytes[..part]).unwrap();
                let said = load_picture(&path, None).map(|_| name).unwrap_err().to_string();
                assert!(said.contains(name) && said.contains("copy it again"), "{said}");
            }
        }
    }

    #[test]
    fn exif_tells_the_focal_length_by_the_diagonal_and_zero_is_unknown() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.jpg");
        RgbImage::new(40, 30).save(&path).unwrap();
        assert_eq!(exif_focal(&path, (40, 30)), None);
        let jpeg = std::fs::read(&path).unwrap();
        let told = |millimetres: u8| {
            let exif = [
                &b"\xff\xe1\0\x34Exif\0\0II*\0\x08\0\0\0\x01\0\x69\x87\x04\0\x01\0\0\0\x1a\0\0\0\0\0\0\0"[..],
                &[b"\x01\0\x05\xa4\x03\0\x01\0\0\0", &[millimetres, 0, 0, 0][..], &[0; 4]].concat(),
            ];
            std::fs::write(&path, [&jpeg[..2], &exif.concat(), &jpeg[2..]].concat()).unwrap();
            exif_focal(&path, (40, 30))
        };
        // The diagonal is 50 pixels, that of film 43.267 mm.
        assert!((told(26).unwrap() - 26.0 * 50.0 / 43.267).abs() < 1e-9);
        assert_eq!(told(0), None);
    }

    #[test]
    fn a_picture_that_says_to_be_larger_than_its_bytes_can_hold_is_refused_unread() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bmp");
        RgbImage::new(4, 4).save(&path).unwrap();
        assert_eq!(Header::read(&path).unwrap().stored, (4, 4));
        let mut bytes = std::fs::read(&path).unwrap();
        bytes[18..22].copy_from_slice(&40_000_u32.to_le_bytes());
        bytes[22..26].copy_from_slice(&30_000_u32.to_le_bytes());
        std::fs::write(&path, &bytes).unwrap();
        let said = Header::read(&path).unwrap_err().to_string();
        assert!(said.contains("bytes for 40000x30000 pixels") && said.contains("copy it again"), "{said}");
        bytes.resize(200_000, 0);
        std::fs::write(&path, &bytes).unwrap();
        let said = Header::read(&path).unwrap_err().to_string();
        assert!(said.contains("at most 268 million") && said.contains("scale it down"), "{said}");
    }

    #[test]
    fn what_is_no_picture_is_said_in_words() {
        let folder = tempfile::tempdir().unwrap();
        for (name, bytes, words) in
            [("a.jpg", &b""[..], "it is empty"), ("b.png", b"<html>", "web page"), ("c.jpg", b"hello", "no picture")]
        {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            let said = Header::read(&path).unwrap_err().to_string();
            assert!(said.contains(words) && said.contains("leave it out"), "{said}");
        }
    }
}
