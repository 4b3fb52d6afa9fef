//! Tracks from a `tracks.json`, an artist's own or edited ones, in the place of those that a reconstruction would make.

use super::{FaceTrack, Surface, TrackedFrame, Tracks, View};
use geometry::{Camera, Vec2, Vec3};

/// The tracks as they concern the chosen frames: `chosen[k]` is the place of `frames[k]` in the sequence. A track is cast
/// onto the head, as it is known so far, in the frame that looks at it most directly.
pub fn given(
    tracks: &Tracks,
    chosen: &[usize],
    frames: &[TrackedFrame],
    camera: &Camera,
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    min_frames: usize,
) -> Vec<FaceTrack> {
    let surface = Surface::new(positions, triangles);
    let views: Vec<View> = frames.iter().map(|f| View::new(&surface, camera, f.cam_from_head)).collect();
    let place = |frame: usize| chosen.iter().position(|&index| index == frame);
    let of_point = |track: &super::PointTrack| {
        let seen = track.observations.iter().filter_map(|o| Some((place(o.frame)?, o.pixel, o.sigma_px)));
        let observations: Vec<(usize, Vec2, f64)> = seen.collect();
        let cast = |&(k, pixel, _): &(usize, Vec2, f64)| {
            let point = views[k].cast(&pixel)?;
            Some((views[k].facing(&point)?, surface.place(&point)))
        };
        let best = observations.iter().filter_map(cast).max_by(|a, b| a.0.total_cmp(&b.0));
        let (_, point) = best.filter(|_| observations.len() >= min_frames)?;
        Some(FaceTrack { point, observations })
    };
    tracks.tracks.iter().filter_map(of_point).collect()
}
