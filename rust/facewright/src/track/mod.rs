//! Points of the face, found again in other frames.
//!
//! - [`track`]: whole sequences, as `tracks.json` ([`Tracks`]); `chain` is the paper's way, `findings` what becomes of points, `relay` what
//!   bridges expressions.
//! - [`match_pair`]: two frames.

mod chain;
mod edited;
mod findings;
mod matches;
pub(crate) mod pair;
mod region;
mod relay;
mod sequence;
mod tracks;
mod valid;

pub use pair::{MatchOptions, MatchedPair, Matches, match_pair};
pub(crate) use sequence::{Corners, track_head};
pub use sequence::{TRACK_STEPS, TrackClipOptions, track};
pub use tracks::{DisabledPoint, FrameTracks, PointGap, PointObservation, PointTrack, Region, Tracks};
