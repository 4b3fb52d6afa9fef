//! Observations in, cameras and points out: no pixels, no files.
//!
//! # Entry points
//! - [`calibrate`]: the camera from views of a board, or several cameras and their poses.
//! - [`two_view`]: the motion between two frames, robustly or as in the paper.
//! - [`triangulate`]: a point from its rays.
//! - [`resect`]: the pose of a frame from points whose position is known.
//! - [`bundle`]: all poses and points at once.
//! - [`sequence`]: all of it, from tracks to poses and points; [`rig`]: the same for several cameras whose poses are known.
//!
//! # Conventions
//! Metres, radians, pixels; transforms are `b_from_a`; "normalised" coordinates are undistorted `X/Z, Y/Z`. A head that
//! turns in front of a still camera is treated as a still head in front of a moving camera: poses are `cam_from_head`. Matches on the
//! background, which stands still, contradict that and are rejected like any other wrong match.
//!
//! Source: paper, sections 2.2 and 2.5.
#![forbid(unsafe_code)]

pub mod bundle;
pub mod calibrate;
mod error;
mod polynomial;
mod random;
pub mod resect;
pub mod rig;
pub mod sequence;
pub mod triangulate;
pub mod two_view;

pub use error::MotionError;
