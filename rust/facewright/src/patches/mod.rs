//! Patches of the skin: corners of one frame, and where a head that is known puts them in another.
//!
//! - [`TrackedSkin`]: a frame's pyramid, and the skin in it that corners are chosen on.
//! - [`Hair`]: hair over the forehead, which is no skin.
//! - [`Surface`] and [`View`]: the head in a frame: where a pixel meets it, and how a patch is warped from one view to another.
//! - [`Anchors`]: the corners of one frame, sought in others; `faces` places heads by them, `track` makes tracks of them.

mod hair;
mod search;
mod skin;
mod surface;

pub use hair::Hair;
pub use search::{Anchors, FINEST_PX, REFERENCE_PX, Scene, Search, SearchOptions, Seed, Sighting, octave, seeds};
pub use skin::TrackedSkin;
pub use surface::{SkinPoint, Surface, View};

use geometry::{Camera, Transform, median};

/// Distance of a right observation from its point at most, by the tracker, pixels …
const TRACKER_PX: f64 = 1.0;
/// … and by what skin slides on the skull, metres.
const SKIN_M: f64 = 0.002;

/// Distance of a right observation from its point at most, pixels: tracker and skin together, the head being where it
/// usually is.
pub fn threshold_px(cam_from_head: &[Transform], camera: &Camera) -> f64 {
    let distance = median(cam_from_head.iter().map(|pose| pose.translation.z)).unwrap_or(f64::NAN);
    TRACKER_PX.hypot(SKIN_M * camera.fx / distance)
}
