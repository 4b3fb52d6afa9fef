//! From frames of a turning head to a head that can be animated.
//!
//! # Entry points
//! - [`FrameSet::open`], [`Assets::load`], [`reconstruct`]: the whole path; [`Reconstruction::write`] leaves its files.
//! - [`reconstruct_on_rig`]: the same from several cameras whose places are known, films or one photograph each.
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
mod calibrate;
mod camera;
mod clock;
mod error;
mod error_group;
mod faces;
mod files;
mod formats;
mod frames;
mod given;
mod head;
mod method;
mod motion;
mod on_rig;
pub mod pictures;
pub mod program;
mod reconstruct;
mod result;
mod size;
mod texture;
mod track;

pub use self::calibrate::{
    Bend, BoardImage, BoardOptions, CalibrateOptions, CalibratedCamera, CalibratedRig, Grid, Keep, MountedCamera,
    RigInput, SeenCorner, UndistortOptions, calibrate, calibrate_rig, undistort,
};
pub use self::motion::{
    FrameMotion, HeadMotion, MotionOptions, PointMotion, RigTracks, Roughness, solve_motion, solve_motion_on_rig,
};
pub use assets::Assets;
pub use camera::{CameraFile, CameraSource, SourcedCamera};
pub use error::FacewrightError;
pub use error_group::ErrorGroup;
pub use faces::{FaceFrame, Faces, Look, find_faces};
pub use files::{check_folder, write_drawing, write_json, write_text};
pub use formats::Schema;
pub use frames::{Frame, FrameSet};
pub use given::Given;
pub use method::Method;
pub use on_rig::{RigFrames, reconstruct_on_rig};
pub use reconstruct::{ReconstructOptions, generic_head, reconstruct};
pub use result::{
    FitReport, FrameReport, Reconstruction, Report, ReportCamera, Scale, TextureReport, overlay, overlay_on_rig,
};
pub use size::{KnownLength, SizeOptions};
pub use track::{
    FrameTracks, MatchOptions, MatchedPair, Matches, PointGap, PointObservation, PointTrack, Region, TrackClipOptions,
    Tracks, match_pair, track,
};
