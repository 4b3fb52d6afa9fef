//! Which frames carry the structure: enough to see the head from all its sides, spread over its motion.

use super::PointTrack;
use geometry::Transform;

/// A frame counts as this much of a turn even if nothing turns, radians: time passes, expressions change.
const STILL_RAD: f64 = 0.004;
/// A larger turn from one frame to the next is a wrong pose, radians.
const JUMP_RAD: f64 = 0.2;

/// At most `wanted` frames, spread evenly over the turning of the head: of each stretch the frame with the most sightings.
///
/// Where no poses are known the stretches are of the same length in time.
pub(super) fn key_frames(
    tracks: &[PointTrack],
    frames: usize,
    poses: Option<&[Option<Transform>]>,
    wanted: usize,
) -> Vec<bool> {
    if frames <= wanted {
        return vec![true; frames];
    }
    let mut sightings = vec![0_usize; frames];
    tracks.iter().flat_map(|track| &track.observations).for_each(|o| sightings[o.frame] += 1);
    let way = way(frames, poses);
    let stretch = |frame: usize| ((way[frame] / way[frames - 1] * wanted as f64) as usize).min(wanted - 1);
    let mut best: Vec<Option<usize>> = vec![None; wanted];
    for frame in (0..frames).filter(|&frame| sightings[frame] > 0) {
        let place = &mut best[stretch(frame)];
        if place.is_none_or(|held| sightings[frame] > sightings[held]) {
            *place = Some(frame);
        }
    }
    let mut key = vec![false; frames];
    best.into_iter().flatten().for_each(|frame| key[frame] = true);
    key
}

/// How far the head has turned up to each frame, with time.
fn way(frames: usize, poses: Option<&[Option<Transform>]>) -> Vec<f64> {
    let mut before: Option<Transform> = None;
    let mut gone = 0.0;
    (0..frames)
        .map(|frame| {
            if let Some(pose) = poses.and_then(|poses| poses[frame]) {
                gone += before.map_or(0.0, |before| before.angle_to(&pose)).min(JUMP_RAD);
                before = Some(pose);
            }
            gone += STILL_RAD;
            gone - STILL_RAD
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::Sighting;
    use super::*;
    use geometry::{Vec2, Vec3};
    use nalgebra::Rotation3;

    fn track(frames: impl Iterator<Item = usize>) -> PointTrack {
        PointTrack {
            observations: frames.map(|frame| Sighting { frame, pixel: Vec2::zeros(), sigma_px: 1.0 }).collect(),
        }
    }

    fn chosen(key: &[bool]) -> Vec<usize> {
        (0..key.len()).filter(|&frame| key[frame]).collect()
    }

    #[test]
    fn a_short_sequence_is_all_key_frames() {
        assert_eq!(chosen(&key_frames(&[track(0..5)], 5, None, 8)).len(), 5);
    }

    #[test]
    fn without_poses_they_are_spread_over_time_and_see_something() {
        let key = chosen(&key_frames(&[track(0..100), track((0..100).filter(|f| f % 10 == 3))], 120, None, 12));
        assert_eq!(key, [3, 13, 23, 33, 43, 53, 63, 73, 83, 93]);
    }

    #[test]
    fn a_long_rest_gets_fewer_than_the_turn() {
        let yaw = |frame: usize| if frame < 300 { 0.0 } else { 0.02 * (frame - 300) as f64 };
        let pose = |frame| Some(Transform::new(Rotation3::new(Vec3::new(0.0, yaw(frame), 0.0)), Vec3::z()));
        let poses: Vec<_> = (0..360).map(pose).collect();
        let key = chosen(&key_frames(&[track(0..360)], 360, Some(&poses), 40));
        let turning = key.iter().filter(|&&frame| frame >= 300).count();
        assert!((36..=40).contains(&key.len()) && turning >= 18, "{} of {} while it turns", turning, key.len());
    }
}
