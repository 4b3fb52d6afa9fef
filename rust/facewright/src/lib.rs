//! From frames of a turning head to a head that can be animated.
//!
//! # Entry points
//! - [`FrameSet::open`], [`Assets::load`], [`reconstruct`]: the whole path; [`Reconstruction::write`] leaves its files.
//! - [`calibrate`], [`board`], [`match_pair`], [`track`], [`solve_motion`], [`overlay`]: the other
//!   commands of the `facewright` program.
//! - [`calibration_picture`] draws a calibration, [`match_picture`] matches; they and [`board`] make a [`drawing`] in
//!   millimetres, which is written as SVG, PDF or PNG.
//!
//! # Order of work
//! `frames` → `observe` → `faces` (landmark fit) → `clip` (choice of frames) → `track` → `solve` (motion, bundle) →
//! `shape` (class, free deformation, eyes) → keys → `skin` (textures) → `result`. `paper` takes the paper's steps instead.
//!
//! # Conventions
//! Those of [`geometry`]. Options in, report out; nothing is written before everything has succeeded.
#![forbid(unsafe_code)]

mod assets;
mod between;
pub mod board;
mod calibration;
pub mod calibration_picture;
mod camera;
mod clip;
mod clock;
pub mod drawing;
mod error;
mod faces;
mod frames;
mod glb;
pub mod match_picture;
mod matching;
mod motion;
mod observe;
mod overlay;
mod paper;
mod reconstruct;
mod report;
mod result;
mod select;
mod shape;
mod skin;
mod solve;
mod track;
mod undistort;
mod unseen;

pub use self::motion::{
    FrameMotion, HeadMotion, KnownLength, MotionOptions, PointMotion, RigTracks, Roughness, solve_motion,
    solve_motion_on_rig,
};
pub use assets::Assets;
pub use calibration::{
    Bend, BoardImage, CalibrateOptions, CalibratedCamera, CalibratedRig, MountedCamera, RigInput, SeenCorner,
    calibrate, calibrate_rig,
};
pub use error::FacewrightError;
pub use frames::{Frame, FrameSet};
pub use head;
pub use matching::{MatchOptions, MatchedPair, Matches, match_pair};
pub use overlay::overlay;
pub use reconstruct::{ReconstructOptions, generic_head, reconstruct};
pub use report::{CameraSource, FitReport, FrameReport, Method, Report, Scale, SourcedCamera, TextureReport};
pub use result::{Reconstruction, check_folder, write_json, write_text};
pub use track::{FrameTracks, PointObservation, PointTrack, Region, TrackClipOptions, Tracks, track};
pub use undistort::undistort;
