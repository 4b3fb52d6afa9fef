//! Pixels in, observations out: no scene, no files.
//!
//! # Entry points
//! - [`pyramid`]: what the others compute on, built once per frame.
//! - [`board`]: the inner corners of a checkerboard, for calibration.
//! - [`noise`]: the standard deviation of a picture's noise.
//! - [`corners`]: pixels worth tracking, spread over the face.
//! - [`track`]: the same points in another frame (pyramidal Lucas–Kanade).
//! - [`correct`]: finds matches that contradict their neighbours, and searches for them again.
//! - [`landmarks`]: 468 points of a face, and its irises.
//!
//! # Conventions
//! Pictures are `image::GrayImage` and `image::RgbImage`; positions are pixels, x right, y down, pixel centres at
//! integers. Lens distortion is up to the caller: everything here happens in the picture as filmed.
#![forbid(unsafe_code)]

pub mod board;
pub mod corners;
pub mod correct;
pub mod landmarks;
pub mod noise;
pub mod pyramid;
pub mod track;
