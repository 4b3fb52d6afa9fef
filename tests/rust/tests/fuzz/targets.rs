//! What is done with a broken file, as the commands do it.

use crate::seeds;
use facewright::{
    CalibratedRig, CameraFile, Faces, FrameSet, HeadMotion, Matches, MotionOptions, Report, Tracks, overlay,
    solve_motion,
};
use geometry::{Progress, Vec2};
use image::RgbImage;
use serde::Serialize;
use std::fmt::Debug;
use std::path::Path;

/// Takes any bytes.
pub type Target = fn(&[u8]);

/// Reads a text, and what was read once more: what is accepted can be written.
fn again<T: Serialize + Debug, E: Debug>(bytes: &[u8], parse: fn(&str) -> Result<T, E>) -> Option<T> {
    let read = parse(&String::from_utf8_lossy(bytes)).ok()?;
    let written = serde_json::to_string(&read).unwrap();
    parse(&written).unwrap();
    Some(read)
}

pub fn camera(bytes: &[u8]) {
    let Some(file) = again(bytes, CameraFile::parse) else { return };
    let camera = file.sourced().camera;
    let corner = Vec2::new(f64::from(camera.width), f64::from(camera.height));
    for pixel in [Vec2::zeros(), corner / 3.0, corner] {
        std::hint::black_box(camera.try_normalise(&pixel));
    }
}

pub fn faces(bytes: &[u8]) {
    again(bytes, Faces::parse);
}

pub fn tracks(bytes: &[u8]) {
    if let Some(tracks) = again(bytes, Tracks::parse) {
        let motion = solve_motion(&tracks, None, &MotionOptions::default(), &Progress::new());
        motion.iter().for_each(|motion| drop(serde_json::to_string(motion).unwrap()));
    }
}

pub fn motion(bytes: &[u8]) {
    again(bytes, HeadMotion::parse);
}

pub fn matches(bytes: &[u8]) {
    again(bytes, Matches::parse);
}

pub fn rig(bytes: &[u8]) {
    again(bytes, CalibratedRig::parse);
}

pub fn report(bytes: &[u8]) {
    again(bytes, Report::parse);
    draw(bytes, &seeds::file("head.glb"));
}

pub fn head(bytes: &[u8]) {
    draw(&seeds::file("report.json"), bytes);
}

/// The JSON of a head, in a file that is whole but for it.
pub fn head_of_json(json: &[u8]) {
    let json = [json, &b"    "[json.len() % 4..]].concat();
    let blob = seeds::head_blob();
    let length = |bytes: &[u8]| (bytes.len() as u32).to_le_bytes();
    let chunks = [&length(&json)[..], b"JSON", &json, &length(&blob), b"BIN\0", &blob].concat();
    let total = (12 + chunks.len() as u32).to_le_bytes();
    head(&[b"glTF", &2_u32.to_le_bytes()[..], &total, &chunks].concat());
}

/// Draws a head over the one frame of a film, where its report knows it.
fn draw(report: &[u8], head: &[u8]) {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("report.json"), report).unwrap();
    std::fs::write(at("head.glb"), head).unwrap();
    std::fs::create_dir(at("film")).unwrap();
    RgbImage::new(40, 30).save(at("film/frame_00.png")).unwrap();
    let frames = FrameSet::open(&[at("film")], &Progress::new()).unwrap();
    drop(overlay(folder.path(), &frames, &at("drawn"), &Progress::new()));
}

/// Opens a picture by what it is, whatever its name says.
pub fn picture(bytes: &[u8]) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frame.jpg");
    std::fs::write(&path, bytes).unwrap();
    load(&path);
}

fn load(path: &Path) {
    if let Ok(frames) = FrameSet::open(&[path.to_owned()], &Progress::new()) {
        drop(frames.load(0));
    }
}

/// A PNG whose checksums are made right again: wrong ones would hide everything else.
pub fn mended_png(bytes: &[u8]) {
    let mut mended = bytes.to_vec();
    let mut at = 8;
    while let Some(length) = mended.get(at..at + 4).map(|l| u32::from_be_bytes([l[0], l[1], l[2], l[3]]) as usize) {
        let (first, end) = (at + 4, at + 8 + length);
        let Some(data) = mended.get(first..end) else { break };
        let sum = checksum(data).to_be_bytes();
        let Some(place) = mended.get_mut(end..end + 4) else { break };
        place.copy_from_slice(&sum);
        at = end + 4;
    }
    picture(&mended);
}

/// CRC-32 as PNG has it.
fn checksum(data: &[u8]) -> u32 {
    let step = |sum: u32| if sum & 1 == 1 { 0xedb8_8320 ^ (sum >> 1) } else { sum >> 1 };
    !data.iter().fold(!0, |sum, byte| (0..8).fold(sum ^ u32::from(*byte), |sum, _| step(sum)))
}
