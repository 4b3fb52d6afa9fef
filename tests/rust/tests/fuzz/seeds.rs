//! Whole files, which mutations begin with.

use end_to_end::clip;
use image::{ImageFormat, RgbImage};
use std::io::Cursor;

/// Formats of pictures that are read.
const FORMATS: [ImageFormat; 5] =
    [ImageFormat::Jpeg, ImageFormat::Png, ImageFormat::Tiff, ImageFormat::Bmp, ImageFormat::WebP];

/// A file of `tests/data/fuzz`: what the program made of the synthetic person's film, cut down.
pub fn file(name: &str) -> Vec<u8> {
    std::fs::read(clip().with_file_name("fuzz").join(name)).unwrap()
}

/// A small picture in each format, and one that a camera might have made.
pub fn pictures() -> Vec<Vec<u8>> {
    let mut all: Vec<Vec<u8>> = FORMATS.iter().map(|format| encoded(*format)).collect();
    all.push([&all[0][..2], &exif(), &all[0][2..]].concat());
    all
}

/// A small PNG.
pub fn png() -> Vec<u8> {
    encoded(ImageFormat::Png)
}

/// The JSON in `head.glb`.
pub fn head_json() -> Vec<u8> {
    let glb = file("head.glb");
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    glb[20..20 + length].to_vec()
}

/// The part of `head.glb` that holds its vertices and pictures.
pub fn head_blob() -> Vec<u8> {
    let glb = file("head.glb");
    glb[20 + head_json().len() + 8..].to_vec()
}

fn encoded(format: ImageFormat) -> Vec<u8> {
    let picture = RgbImage::from_fn(40, 30, |x, y| image::Rgb([(x * 6) as u8, (y * 8) as u8, (x * y % 97) as u8]));
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

/// The segment of a JPEG that says how it is turned, and its focal length.
fn exif() -> Vec<u8> {
    let entry =
        |tag: u16, value: u16| [&tag.to_be_bytes()[..], &[0, 3, 0, 0, 0, 1], &value.to_be_bytes(), &[0; 2]].concat();
    let pointer = [&[0x87, 0x69, 0, 4, 0, 0, 0, 1][..], &38_u32.to_be_bytes()].concat();
    let first = [&[0, 2][..], &entry(0x0112, 6), &pointer, &[0; 4]].concat();
    let second = [&[0, 1][..], &entry(0xa405, 28), &[0; 4]].concat();
    let tiff = [b"MM\0\x2a\0\0\0\x08", &first[..], &second].concat();
    let length = (2 + 6 + tiff.len()) as u16;
    [&[0xff, 0xe1][..], &length.to_be_bytes(), b"Exif\0\0", &tiff].concat()
}
