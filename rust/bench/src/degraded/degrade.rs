//! What can be wrong with a film.

use super::reflection;
use crate::scenes::clip::Clip;
use geometry::Transform;
use image::codecs::jpeg::JpegEncoder;
use image::{Rgb, RgbImage};
use rayon::prelude::*;
use std::path::Path;
use synthetic::Random;

/// Largest jump of a frame to each side, pixels.
const JUMP: i64 = 8;
/// Frames between sudden changes of the exposure.
const STEP: usize = 7;
/// Frames of one slow change of the exposure and back.
const PERIOD: f64 = 20.0;
/// Part by which the exposure changes.
const EXPOSURE: f64 = 0.4;
/// Standard deviation of the noise, grey levels.
const NOISE: f64 = 6.0;
/// Quality of the compression.
const QUALITY: u8 = 30;

/// Ways to make a film worse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Degradation {
    None,
    MotionBlur,
    SlowExposure,
    SuddenExposure,
    Compression,
    Interlaced,
    Jumps,
    Reflections,
    Noise,
}

/// A frame as it will be saved.
pub enum Picture {
    Pixels(RgbImage),
    /// The bytes of a JPEG file.
    Jpeg(Vec<u8>),
}

impl Picture {
    pub fn save(&self, folder: &Path, name: &str) -> anyhow::Result<()> {
        match self {
            Self::Pixels(pixels) => pixels.save(folder.join(name).with_extension("png"))?,
            Self::Jpeg(bytes) => std::fs::write(folder.join(name).with_extension("jpg"), bytes)?,
        }
        Ok(())
    }
}

/// A film made worse, and what is true in it.
pub struct Made {
    pub pictures: Vec<Picture>,
    pub cam_from_head: Vec<Transform>,
    /// How far each frame was moved, pixels.
    pub shifts: Vec<[f64; 2]>,
}

impl Degradation {
    pub const ALL: [Self; 9] = [
        Self::None,
        Self::MotionBlur,
        Self::SlowExposure,
        Self::SuddenExposure,
        Self::Compression,
        Self::Interlaced,
        Self::Jumps,
        Self::Reflections,
        Self::Noise,
    ];

    /// For a folder's name.
    pub fn word(self) -> &'static str {
        match self {
            Self::None => "original",
            Self::MotionBlur => "motion-blur",
            Self::SlowExposure => "slow-exposure",
            Self::SuddenExposure => "sudden-exposure",
            Self::Compression => "jpeg",
            Self::Interlaced => "interlaced",
            Self::Jumps => "jumps",
            Self::Reflections => "reflections",
            Self::Noise => "noise",
        }
    }

    /// For the table.
    pub fn what(self) -> &'static str {
        match self {
            Self::None => "as filmed",
            Self::MotionBlur => "blurred across, 5 px, every third frame 9 px",
            Self::SlowExposure => "levels × 0.6 to 1.4, slowly",
            Self::SuddenExposure => "levels × 0.6, 1, 1.4 in steps",
            Self::Compression => "JPEG quality 30",
            Self::Interlaced => "interlaced",
            Self::Jumps => "jumps of up to 8 px",
            Self::Reflections => "reflections of glasses",
            Self::Noise => "noise of 6 levels",
        }
    }

    /// The film so made worse.
    pub fn apply(self, clip: &Clip, frames: &[RgbImage]) -> Made {
        let poses: Vec<Transform> = clip.frames.iter().map(|f| f.cam_from_head).collect();
        let shifts = if self == Self::Jumps { jumps(frames.len()) } else { vec![[0; 2]; frames.len()] };
        let picture = |i: usize| {
            let frame = &frames[i];
            Picture::Pixels(match self {
                Self::None => frame.clone(),
                Self::MotionBlur => blurred(frame, if i.is_multiple_of(3) { 9 } else { 5 }),
                Self::SlowExposure => brighter(frame, slow_gain(i)),
                Self::SuddenExposure => brighter(frame, sudden_gain(i)),
                Self::Compression => return Picture::Jpeg(compressed(frame)),
                Self::Interlaced => woven(frame, &frames[(i + 1).min(frames.len() - 1)]),
                Self::Jumps => moved(frame, shifts[i]),
                Self::Reflections => reflection::over(frame, &clip.camera, &poses[i], &clip.nose_tip.into()),
                Self::Noise => noisy(frame, i as u64),
            })
        };
        let pictures = (0..frames.len()).into_par_iter().map(picture).collect();
        let cam_from_head = if self == Self::Interlaced { between(&poses) } else { poses };
        Made { pictures, cam_from_head, shifts: shifts.iter().map(|s| s.map(|v| v as f64)).collect() }
    }
}

/// The mean of `length` pixels across.
fn blurred(frame: &RgbImage, length: i64) -> RgbImage {
    RgbImage::from_fn(frame.width(), frame.height(), |x, y| {
        let mut sum = [0.0; 3];
        for k in -length / 2..=length / 2 {
            let pixel = nearest(frame, i64::from(x) + k, i64::from(y));
            sum.iter_mut().zip(pixel.0).for_each(|(sum, level)| *sum += f64::from(level));
        }
        Rgb(sum.map(|sum| (sum / length as f64).round() as u8))
    })
}

/// The pixel, or the nearest to it at the edge.
fn nearest(frame: &RgbImage, x: i64, y: i64) -> Rgb<u8> {
    let within = |v: i64, size: u32| v.clamp(0, i64::from(size) - 1) as u32;
    *frame.get_pixel(within(x, frame.width()), within(y, frame.height()))
}

fn slow_gain(frame: usize) -> f64 {
    1.0 + EXPOSURE * (std::f64::consts::TAU * frame as f64 / PERIOD).sin()
}

fn sudden_gain(frame: usize) -> f64 {
    [1.0, 1.0 + EXPOSURE, 1.0 - EXPOSURE][frame / STEP % 3]
}

/// Levels times a gain; a camera's curve makes less of the same change of light.
fn brighter(frame: &RgbImage, gain: f64) -> RgbImage {
    let mut frame = frame.clone();
    frame.iter_mut().for_each(|level| *level = (f64::from(*level) * gain).round().min(255.0) as u8);
    frame
}

fn compressed(frame: &RgbImage) -> Vec<u8> {
    let mut bytes = Vec::new();
    // Writing to memory cannot fail, and a frame has a size that JPEG can have.
    let _ = JpegEncoder::new_with_quality(&mut bytes, QUALITY).encode_image(frame);
    bytes
}

/// Even lines of one frame, odd ones of the next.
fn woven(frame: &RgbImage, next: &RgbImage) -> RgbImage {
    RgbImage::from_fn(frame.width(), frame.height(), |x, y| *[frame, next][y as usize % 2].get_pixel(x, y))
}

/// Poses between those of each frame and the next: what both fields of a woven frame show on the whole.
fn between(poses: &[Transform]) -> Vec<Transform> {
    let half = |i: usize| {
        let (a, b) = (&poses[i], &poses[(i + 1).min(poses.len() - 1)]);
        let turn = (b.rotation * a.rotation.inverse()).scaled_axis() / 2.0;
        Transform::new(nalgebra::Rotation3::new(turn) * a.rotation, (a.translation + b.translation) / 2.0)
    };
    (0..poses.len()).map(half).collect()
}

fn jumps(count: usize) -> Vec<[i64; 2]> {
    let mut random = Random::new(8);
    let mut jump = || random.between(-JUMP as f64 - 0.5, JUMP as f64 + 0.5).round().clamp(-JUMP as f64, JUMP as f64);
    (0..count).map(|_| [jump() as i64, jump() as i64]).collect()
}

/// A frame moved to the right and down, its edge repeated.
fn moved(frame: &RgbImage, [right, down]: [i64; 2]) -> RgbImage {
    let pixel = |x, y| nearest(frame, i64::from(x) - right, i64::from(y) - down);
    RgbImage::from_fn(frame.width(), frame.height(), pixel)
}

fn noisy(frame: &RgbImage, seed: u64) -> RgbImage {
    let (mut frame, mut random) = (frame.clone(), Random::new(1000 + seed));
    frame.iter_mut().for_each(|level| {
        *level = (f64::from(*level) + NOISE * random.normal()).round().clamp(0.0, 255.0) as u8;
    });
    frame
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp() -> RgbImage {
        RgbImage::from_fn(40, 30, |x, y| Rgb([(4 * x) as u8, (5 * y) as u8, 77]))
    }

    #[test]
    fn a_frame_moves_by_what_is_said() {
        let moved = moved(&ramp(), [3, -2]);
        assert_eq!(moved.get_pixel(20, 10), ramp().get_pixel(17, 12));
        assert_eq!(moved.get_pixel(0, 29), ramp().get_pixel(0, 29));
        let jumps = jumps(400);
        assert!(jumps.iter().flatten().all(|j| j.abs() <= JUMP));
        assert!(jumps.iter().flatten().any(|j| *j == JUMP) && jumps.iter().flatten().any(|j| *j == -JUMP));
    }

    #[test]
    fn blur_leaves_ramps_and_spreads_dots() {
        assert_eq!(blurred(&ramp(), 9).get_pixel(20, 10), ramp().get_pixel(20, 10));
        let mut dot = RgbImage::new(40, 30);
        dot.put_pixel(20, 10, Rgb([90; 3]));
        let blurred = blurred(&dot, 9);
        let lit: Vec<u8> = (0..40).map(|x| blurred.get_pixel(x, 10).0[0]).collect();
        assert_eq!(lit.iter().filter(|l| **l == 10).count(), 9);
        assert!(lit[16] == 10 && lit[24] == 10 && blurred.get_pixel(20, 11).0[0] == 0);
    }

    #[test]
    fn the_exposure_changes_by_two_fifths() {
        let gains: Vec<f64> = (0..20).map(slow_gain).collect();
        assert!((gains[5] - 1.4).abs() < 1e-12 && (gains[15] - 0.6).abs() < 1e-12);
        assert_eq!([0, 6, 7, 14, 21].map(sudden_gain), [1.0, 1.0, 1.4, 0.6, 1.0]);
        assert_eq!(brighter(&ramp(), 1.4).get_pixel(39, 10).0, [218, 70, 108]);
    }

    #[test]
    fn fields_come_from_two_moments() {
        let woven = woven(&ramp(), &RgbImage::new(40, 30));
        assert_eq!((woven.get_pixel(9, 4), woven.get_pixel(9, 5).0), (ramp().get_pixel(9, 4), [0; 3]));
        let turn =
            |angle: f64| Transform::new(nalgebra::Rotation3::new(geometry::Vec3::y() * angle), geometry::Vec3::zeros());
        let between = between(&[turn(0.1), turn(0.3), turn(0.3)]);
        assert!(between[0].angle_to(&turn(0.2)) < 1e-12 && between[2].angle_to(&turn(0.3)) < 1e-12);
    }
}
