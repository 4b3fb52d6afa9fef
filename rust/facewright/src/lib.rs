//! From frames of a turning head to a head that can be animated.
//!
//! # Entry points
//! - [`FrameSet::open`], [`Assets::load`], [`reconstruct()`]: the whole pipeline; [`Reconstruction::write`] writes its files.
//! - [`reconstruct_on_rig`]: the same from several cameras whose poses are known, with a clip or one photograph of each.
//! - [`calibrate()`], [`pictures::board`], [`match_pair`], [`find_faces`], [`survey()`], [`track()`], [`solve_motion`], [`overlay()`]: the other commands.
//! - [`pictures`] draws calibrations, matches and boards, which [`write_drawing`] writes; [`program`] is the command line.
//!
//! # Order of work
//! faces → track → motion → shape → rest → features → eyes → keys → texture → result: `rust/README.md` says what each does and where.
//!
//! # Example
//! ```no_run
//! use facewright::{Assets, FrameSet, Given, ReconstructOptions, reconstruct};
//! use geometry::Progress;
//! use std::path::Path;
//!
//! # fn main() -> Result<(), facewright::FacewrightError> {
//! let progress = Progress::new();
//! let frames = FrameSet::open(&["clip".into()], &progress)?;
//! let assets = Assets::load(&Assets::default_folder())?;
//! let head = reconstruct(&frames, &assets, &Given::default(), &ReconstructOptions::default(), &progress)?;
//! head.write(Path::new("out"))?;
//! # Ok(())
//! # }
//! ```
//!
//! # Conventions
//! Those of [`geometry`]. Options in, report out; nothing is written before everything has succeeded.
#![forbid(unsafe_code)]

mod assets;
mod board_error;
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
mod judge;
mod method;
mod motion;
mod on_rig;
mod patches;
pub mod pictures;
pub mod program;
mod reason;
mod reconstruct;
mod result;
mod size;
mod survey;
mod texture;
mod track;

pub use self::calibrate::{
    Bend, BoardImage, BoardOptions, CalibrateOptions, CalibratedCamera, CalibratedRig, CameraFile, Grid, Keep,
    MountedCamera, RigInput, SeenCorner, UndistortOptions, calibrate, calibrate_rig, undistort,
};
pub use self::motion::{
    FrameMotion, HeadMotion, MotionOptions, PointMotion, RigTracks, Roughness, solve_motion, solve_motion_on_rig,
};
pub use assets::Assets;
pub use camera::{CameraSource, SourcedCamera};
pub use error::FacewrightError;
pub use error_group::ErrorGroup;
pub use faces::{
    Appearance, FaceFrame, FaceOptions, Faces, Followed, Look, Pixel, check_face, find_faces, find_faces_of,
};
pub use files::{check_folder, write_drawing, write_json, write_text};
pub use formats::Schema;
pub use frames::{Frame, FrameSet, RigFrames, pictures_in, video_size};
pub use given::Given;
pub use head::SurfaceTruth;
pub use method::Method;
pub use on_rig::reconstruct_on_rig;
pub use reason::ReasonKind;
pub use reconstruct::{ReconstructOptions, generic_head, reconstruct, reconstruct_steps};
pub use result::{
    Bounds, DenseReport, FitReport, FrameReport, Measure, Quality, Reconstruction, Relief, Report, ReportCamera, Scale,
    TextureReport, Verdict, overlay, overlay_on_rig,
};
pub use size::{KnownLength, SizeOptions};
pub use survey::{Finding, FindingKind, Survey, SurveyedFace, SurveyedFrame, survey};
pub use track::{
    DisabledPoint, FrameTracks, MatchOptions, MatchedPair, Matches, PointGap, PointObservation, PointTrack, Region,
    TRACK_STEPS, TrackClipOptions, Tracks, match_pair, track,
};
