//! Points of the face, found again in other frames.
//!
//! - [`track`]: whole sequences, as `tracks.json` ([`Tracks`]); `chain` is the paper's way, `findings` what becomes of points, `relay` what
//!   bridges expressions.
//! - [`Anchors`]: the points of one frame in others, predicted by the head's [`Surface`].

mod chain;
mod edited;
mod findings;
mod matches;
pub(crate) mod pair;
mod region;
mod relay;
mod search;
mod sequence;
mod surface;
mod tracks;
mod valid;

pub use pair::{MatchOptions, MatchedPair, Matches, match_pair};
pub use search::{Anchors, Scene, Search, SearchOptions, Seed, Sighting, octave, seeds};
pub(crate) use sequence::{Corners, track_head};
pub use sequence::{TrackClipOptions, track};
pub use surface::{Surface, View};
pub use tracks::{DisabledPoint, FrameTracks, PointGap, PointObservation, PointTrack, Region, Tracks};
