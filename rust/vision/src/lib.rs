//! Pixels in, observations out: no scene, no files.
//!
//! # Entry points
//! - [`pyramid`]: what the others compute on, built once per frame.
//! - [`board`]: the inner corners of a checkerboard, for calibration.
//! - [`noise`]: how much of a picture is none of its texture.
//! - [`corners`]: pixels worth tracking, spread over the face.
//! - [`track`]: the same points in another frame (pyramidal Lucas–Kanade).
//! - [`correct`]: matches that contradict their neighbours are found and searched again.
//! - [`landmarks`]: 468 points of a face, and its irises.
//!
//! # Conventions
//! Pictures are `image::GrayImage` and `image::RgbImage`; positions are pixels, x right, y down, pixel centres at
//! integers. Lens distortion is the caller's affair: everything here happens in the picture as filmed.
#![forbid(unsafe_code)]

pub mod board;
pub mod corners;
pub mod correct;
pub mod landmarks;
pub mod noise;
pub mod pyramid;
pub mod track;
