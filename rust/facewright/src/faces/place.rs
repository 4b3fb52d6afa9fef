//! Frames that nobody looked at, placed by points: patches of the frames looked at before and after, sought where the head is
//! expected between them.
//!
//! Landmarks tell a pose to a degree or two, jitter, and cost more than anything else; patches of neighbouring frames tell it as
//! well as the neighbours' landmarks do together.

use super::{KnownFrame, KnownHead, LANDMARK_SIGMA_RAD};
use crate::frames::Octave;
use crate::patches::{Anchors, Scene, SearchOptions, Surface, TrackedSkin, View, seeds, threshold_px};
use crate::{FacewrightError, FrameSet};
use geometry::{Camera, Transform, Vec2, Vec3};
use head::GenericHead;
use motion::resect::{ResectOptions, resect};
use vision::landmarks::Face;

/// Corners taken of a frame that was looked at: a pose has six numbers.
const CORNERS: usize = 60;
/// Fewest points that make a pose.
const FEWEST_POINTS: usize = 12;
/// A point that the expression takes further from its place than this tells nothing of the pose, metres.
const MOVED: f64 = 0.0015;

/// What placing takes.
pub(crate) struct Placing<'a> {
    pub frames: &'a FrameSet,
    pub head: &'a GenericHead,
    pub known: &'a KnownHead,
    /// The octave that is tracked in …
    pub octave: Octave,
    /// … and its lens.
    pub camera: Camera,
    /// The head's skin as far as a camera may see it.
    pub triangles: &'a [[u32; 3]],
}

/// A frame that was looked at.
struct End<'a> {
    known: &'a KnownFrame,
    skin: TrackedSkin,
    positions: Vec<Vec3>,
}

impl<'a> Placing<'a> {
    /// The head in the frames between two that were looked at and show the faces; `None` for a frame in which too few points are
    /// found again, or too few of them agree.
    pub fn between(&self, ends: [usize; 2], faces: [&Face; 2]) -> Result<Vec<Option<KnownFrame>>, FacewrightError> {
        let nothing = || Ok(vec![None; ends[1] - ends[0] - 1]);
        let (Some(a), Some(b)) = (self.end(ends[0], faces[0])?, self.end(ends[1], faces[1])?) else { return nothing() };
        let options = SearchOptions::default();
        let surfaces = [&a, &b].map(|end| Surface::new(&end.positions, self.triangles));
        let [view_a, view_b] = [0, 1].map(|k| View::new(&surfaces[k], &self.camera, [&a, &b][k].known.cam_from_head));
        let scenes = [Scene { skin: &a.skin, view: view_a }, Scene { skin: &b.skin, view: view_b }];
        let anchors = [take(&scenes[0], &options)?, take(&scenes[1], &options)?];
        let place = |frame: usize| {
            let share = (frame - ends[0]) as f64 / (ends[1] - ends[0]) as f64;
            self.place(frame, &KnownFrame::between(a.known, b.known, share), &anchors, &options)
        };
        (ends[0] + 1..ends[1]).map(place).collect()
    }

    fn end(&self, frame: usize, face: &Face) -> Result<Option<End<'a>>, FacewrightError> {
        let Some(known) = &self.known.frames[frame] else { return Ok(None) };
        let positions = self.head.with_expression(&self.known.positions, &known.expression);
        let skin = TrackedSkin::of(self.frames.pyramid(frame, self.octave)?, &self.octave.face(face));
        Ok(Some(End { known, skin, positions }))
    }

    /// The head in a frame, about where it is expected.
    fn place(
        &self,
        frame: usize,
        expected: &KnownFrame,
        anchors: &[Anchors; 2],
        options: &SearchOptions,
    ) -> Result<Option<KnownFrame>, FacewrightError> {
        let skin = TrackedSkin::sought(self.frames.pyramid(frame, self.octave)?, anchors[0].scene.skin.noise);
        let positions = self.head.with_expression(&self.known.positions, &expected.expression);
        let surface = Surface::new(&positions, self.triangles);
        let view = View::new(&surface, &self.camera, expected.cam_from_head);
        let scene = Scene { skin: &skin, view };
        let (mut places, mut seen) = (Vec::new(), Vec::new());
        for anchors in anchors {
            let found = anchors.search(&scene, options)?;
            for (seed, sighting) in anchors.seeds.iter().zip(&found.sightings) {
                let place = anchors.scene.view.surface.place(&seed.point);
                let stays = (surface.place(&seed.point) - place).norm() < MOVED;
                if let Some(sighting) = sighting.filter(|s| stays && s.outcome.is_usable()) {
                    places.push(place);
                    seen.push(self.camera.normalise(&sighting.pixel));
                }
            }
        }
        let pose = self.resect(&places, &seen, &expected.cam_from_head);
        Ok(pose.map(|cam_from_head| KnownFrame { cam_from_head, expression: expected.expression.clone() }))
    }

    fn resect(&self, places: &[Vec3], seen: &[Vec2], expected: &Transform) -> Option<Transform> {
        let camera = &self.camera;
        let options = ResectOptions {
            threshold: threshold_px(&[*expected], camera) / camera.fx,
            min_inliers: FEWEST_POINTS,
            initial_sigma_rad: Some(LANDMARK_SIGMA_RAD),
            ..ResectOptions::default()
        };
        Some(resect(places, seen, Some(*expected), &options).ok()?.cam_from_x)
    }
}

fn take<'a>(scene: &'a Scene<'a>, options: &SearchOptions) -> Result<Anchors<'a>, FacewrightError> {
    let corners = options.corners(scene, CORNERS);
    Anchors::take(scene, seeds(scene, &scene.skin.mask, &corners)?, options)
}
