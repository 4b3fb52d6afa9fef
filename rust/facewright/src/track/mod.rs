//! Points of the face, found again in other frames.

mod follow;
mod search;
mod surface;

pub use follow::{FaceTrack, FollowOptions, TrackedFrame, follow};
pub use search::{Scene, Search, SearchOptions, Seed, Sighting, search, seeds};
pub use surface::{Surface, View};
