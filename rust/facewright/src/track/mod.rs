//! Points of the face, found again in other frames.
//!
//! - [`track`]: whole sequences, as `tracks.json` ([`Tracks`]); `chain` is the paper's way, `findings` what becomes of points, `relay` what
//!   bridges expressions.
//! - [`follow`]: the chosen frames of a reconstruction; [`given`]: an artist's tracks instead.
//! - [`Measured`]: poses of the frames between those, by points of the head that they gave.
//! - [`Anchors`]: the points of one frame in others, predicted by the head's [`Surface`].

mod chain;
mod edited;
mod findings;
pub(crate) mod follow;
mod given;
pub(crate) mod pair;
mod region;
mod relay;
pub(crate) mod search;
mod sequence;
pub(crate) mod surface;
mod tracks;
mod valid;

pub use follow::{FaceTrack, FollowOptions, TrackedFrame, follow};
pub use given::given;
pub use pair::{MatchOptions, MatchedPair, Matches, match_pair};
pub use search::{Anchors, Scene, Search, SearchOptions, Seed, Sighting, seeds};
pub use sequence::{TrackClipOptions, track};
pub use surface::{Surface, View};
pub use tracks::{FrameTracks, PointGap, PointObservation, PointTrack, Region, Tracks};
