//! The frames between those that a head was measured in: their poses, by points of that head.
//!
//! Landmarks tell a pose to a degree or two and jitter. Patches of the measured frames, sought where the measured head is
//! expected, tell it as well as theirs were.

use crate::FacewrightError;
use crate::faces::TrackedSkin;
use crate::motion::{LANDMARK_SIGMA_RAD, threshold_px};
use crate::track::follow::references;
use crate::track::search::{Anchors, Scene, SearchOptions, seeds};
use crate::track::surface::{Surface, View};
use crate::track::{FollowOptions, TrackedFrame};
use geometry::{Camera, Transform, Vec2, Vec3};
use motion::resect::{ResectOptions, resect};

/// Corners taken of a measured frame: a pose has six numbers.
const CORNERS: usize = 120;
/// Measured frames whose points are sought in a frame between.
const NEAREST: usize = 2;
/// A frame turned further from a measured one is not searched, degrees.
const FARTHEST_TURN_DEG: f64 = 24.0;
/// Fewest points that make a pose.
const FEWEST_POINTS: usize = 12;
/// A point that the expression takes further from its place than this tells nothing of the pose, metres.
const MOVED: f64 = 0.0015;

/// The pose of a frame by its points.
#[derive(Clone, Copy, Debug)]
pub struct PosedFrame {
    /// The pose.
    pub cam_from_head: Transform,
    /// Root mean square distance of the points that agree, pixels.
    pub rms_px: f64,
}

/// Measured frames of one camera with points that can be sought in others.
pub struct Measured<'a> {
    camera: &'a Camera,
    triangles: &'a [[u32; 3]],
    options: SearchOptions,
    anchors: Vec<Anchors<'a>>,
}

/// Which of the measured frames lend their points: the nearest to each of several turns.
pub fn lenders<'a>(frames: &'a [TrackedFrame<'a>], camera: &'a Camera, surface: &'a Surface<'a>) -> Vec<Scene<'a>> {
    let scene = |&i: &usize| Scene { skin: frames[i].skin, view: View::new(surface, camera, frames[i].cam_from_head) };
    references(frames, &FollowOptions::default()).iter().map(scene).collect()
}

impl<'a> Measured<'a> {
    /// Takes corners of the frames that lend them.
    pub fn take(
        lenders: &'a [Scene<'a>],
        camera: &'a Camera,
        triangles: &'a [[u32; 3]],
    ) -> Result<Self, FacewrightError> {
        let options = SearchOptions::default();
        let take = |scene: &'a Scene<'a>| {
            let corners = options.corners(scene, CORNERS);
            Anchors::take(scene, seeds(scene, &scene.skin.mask, &corners)?, &options)
        };
        let anchors = lenders.iter().map(take).collect::<Result<_, FacewrightError>>()?;
        Ok(Self { camera, triangles, options, anchors })
    }

    /// The pose of a frame that shows the skin at `positions`, about where it is `expected`; `None` where too few points are
    /// found again, or too few of them agree.
    pub fn pose(
        &self,
        skin: &TrackedSkin,
        positions: &[Vec3],
        expected: &Transform,
    ) -> Result<Option<PosedFrame>, FacewrightError> {
        let surface = Surface::new(positions, self.triangles);
        let scene = Scene { skin, view: View::new(&surface, self.camera, *expected) };
        let (mut places, mut seen) = (Vec::new(), Vec::new());
        for anchors in self.nearest(expected) {
            let found = anchors.search(&scene, &self.options)?;
            for (seed, sighting) in anchors.seeds.iter().zip(&found.sightings) {
                let place = anchors.scene.view.surface.place(&seed.point);
                let stays = (surface.place(&seed.point) - place).norm() < MOVED;
                if let Some(sighting) = sighting.filter(|s| stays && s.outcome.is_usable()) {
                    places.push(place);
                    seen.push(self.camera.normalise(&sighting.pixel));
                }
            }
        }
        Ok(self.resect(&places, &seen, expected))
    }

    /// The measured frames that are turned least from a pose.
    fn nearest(&self, expected: &Transform) -> impl Iterator<Item = &Anchors<'a>> {
        let turn = |anchors: &Anchors| anchors.scene.view.cam_from_head.angle_to(expected).to_degrees();
        let mut near: Vec<&Anchors> = self.anchors.iter().filter(|anchors| turn(anchors) < FARTHEST_TURN_DEG).collect();
        near.sort_by(|a, b| turn(a).total_cmp(&turn(b)));
        near.into_iter().take(NEAREST)
    }

    fn resect(&self, places: &[Vec3], seen: &[Vec2], expected: &Transform) -> Option<PosedFrame> {
        let options = ResectOptions {
            threshold: threshold_px(&[*expected], self.camera) / self.camera.fx,
            min_inliers: FEWEST_POINTS,
            initial_sigma_rad: Some(LANDMARK_SIGMA_RAD),
            ..ResectOptions::default()
        };
        let found = resect(places, seen, Some(*expected), &options).ok()?;
        Some(PosedFrame { cam_from_head: found.cam_from_x, rms_px: found.rms * self.camera.fx })
    }
}
