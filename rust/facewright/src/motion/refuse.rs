//! Clips that cannot be solved, each with its sentence.

use crate::{FacewrightError, Tracks};
use geometry::Transform;

/// Turned by less than this over the whole clip, a head shows no depth, degrees.
const LEAST_TURN_DEG: f64 = 6.0;
/// A head that turns so little while its picture grows by this factor is zoomed at, or walks.
const ZOOM: f64 = 1.15;

/// Refuses what shows no depth.
pub(super) fn refuse(tracks: &Tracks) -> Result<(), FacewrightError> {
    let poses: Vec<Transform> = tracks.frames.iter().filter_map(|frame| frame.cam_from_head).collect();
    if poses.is_empty() {
        return Err(FacewrightError::NoFace { frames: tracks.frames.len() });
    }
    if poses.len() < 2 {
        return Err(FacewrightError::OneFrame);
    }
    let degrees = widest_turn(&poses).to_degrees();
    if degrees >= LEAST_TURN_DEG {
        return Ok(());
    }
    let depths = poses.iter().map(|pose| pose.translation.z);
    let (near, far) = depths.fold((f64::MAX, f64::MIN), |(near, far), z| (near.min(z), far.max(z)));
    if far > ZOOM * near {
        Err(FacewrightError::OnlyZoom { growth: far / near, degrees })
    } else {
        Err(FacewrightError::NoRotation { degrees })
    }
}

/// Largest angle between two poses, radians. Poses far from the first are compared with all.
fn widest_turn(poses: &[Transform]) -> f64 {
    let farthest = |from: &Transform| {
        let angles = poses.iter().map(|pose| (pose.angle_to(from), pose));
        angles.max_by(|a, b| a.0.total_cmp(&b.0)).map_or((0.0, *from), |(angle, pose)| (angle, *pose))
    };
    // From the farthest one the farthest again: within half of the widest at the first step, nearly it at the second.
    let (_, end) = farthest(&poses[0]);
    farthest(&end).0
}
