//! What holds the head frame and its scale, which no observation tells.
//!
//! Seven numbers of a bundle are free: turn, shift and scale of the head frame. Fixed frames and priors hold some or all
//! of them; [`hold`] holds the rest, without touching the shape: a frame's pose, and one coordinate of another's translation.

use super::{Bundle, BundleOptions};
use geometry::Vec3;

/// What is done about turn, shift and scale of the head frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Gauge {
    /// What neither fixed frames nor priors hold is held as [`Held`] tells; covariances are those in this frame.
    #[default]
    Held,
    /// What neither fixed frames nor priors hold drifts as little as the damping lets it; there are no covariances then.
    Free,
}

/// What is held beside fixed frames and priors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Held {
    /// A frame whose pose is held: the first that sees points, where no frame is fixed and there are no pose priors and
    /// fewer than three point priors.
    pub frame: Option<usize>,
    /// What holds the scale where there are no point priors and only one frame is fixed, held or has a prior.
    pub scale: Option<HeldScale>,
}

/// One coordinate of a frame's translation, held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HeldScale {
    /// The frame.
    pub frame: usize,
    /// Axis of `cam_from_head.translation`: of all frames and axes the one along which the fixed frame's camera is farthest
    /// from this frame's.
    pub axis: usize,
}

/// What has to be held beside fixed frames and priors; `seen` tells which frames see points that count.
pub(super) fn hold(bundle: &Bundle, options: &BundleOptions, seen: &[bool]) -> Held {
    let fixed = options.fixed_frames.iter().copied().filter(|&frame| seen[frame]);
    let known = options.pose_priors.iter().map(|prior| prior.frame).filter(|&frame| seen[frame]);
    let mut placed: Vec<usize> = fixed.chain(known).collect();
    placed.sort_unstable();
    placed.dedup();
    let needs_frame = placed.is_empty() && options.point_priors.len() < 3;
    let frame = seen.iter().position(|&seen| seen).filter(|_| needs_frame);
    placed.extend(frame);
    let scale = match placed[..] {
        [only] if options.point_priors.is_empty() => farthest(bundle, seen, only),
        _ => None,
    };
    Held { frame, scale }
}

/// The frame and axis along which a frame's camera is farthest.
fn farthest(bundle: &Bundle, seen: &[bool], from: usize) -> Option<HeldScale> {
    let centre = bundle.poses[from].inverse().translation;
    let mut best = (0.0, None);
    for (frame, pose) in bundle.poses.iter().enumerate().filter(|(frame, _)| seen[*frame] && *frame != from) {
        let offset: Vec3 = pose.apply(&centre);
        let axis = offset.iamax();
        if offset[axis].abs() > best.0 {
            best = (offset[axis].abs(), Some(HeldScale { frame, axis }));
        }
    }
    best.1
}
