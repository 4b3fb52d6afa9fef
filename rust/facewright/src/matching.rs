//! Corners of the face matched between two frames (paper, sections 2.3 and 2.4; and ours).

use crate::clip::{head_size, observation};
use crate::tracks::{FaceTrack, FollowOptions, TrackedFrame, follow_pair};
use crate::{Assets, CameraSource, FacewrightError, FrameSet, Method, SourcedCamera, camera::starting_camera};
use geometry::{Camera, Progress, Vec2};
use head::fit::{FitOptions, fit_landmarks};
use image::{GrayImage, imageops};
use motion::two_view::{TwoViewOptions, robust};
use serde::{Deserialize, Serialize};
use std::path::Path;
use vision::corners::{CornerOptions, Spread, detect};
use vision::correct::{LocalAdjustmentOptions, Match as PointMatch, local_adjustment};
use vision::landmarks::{MaskOptions, face_mask};
use vision::pyramid::Pyramid;
use vision::track::{Status, TrackOptions, track};

/// Corners of the paper's example.
const PAPER_CORNERS: usize = 66;

/// How two frames are matched.
#[derive(Clone, Copy, Debug)]
pub struct MatchOptions {
    /// Chain of steps.
    pub method: Method,
    /// Window of the tracker, pixels, odd.
    pub window: usize,
    /// Corners at most.
    pub corners: usize,
    /// A match must lie within this of its epipolar line, pixels.
    pub epipolar_px: f64,
}

impl Default for MatchOptions {
    fn default() -> Self {
        Self { method: Method::Default, window: 7, corners: PAPER_CORNERS, epipolar_px: 1.0 }
    }
}

/// A match: `ua, va, ub, vb` pixels, and 1 where it is kept.
pub type Match = (f64, f64, f64, f64, u8);

/// Matches of one pair of frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MatchedPair {
    /// Name of the first frame.
    pub a: String,
    /// Name of the second frame.
    pub b: String,
    /// The matches.
    pub points: Vec<Match>,
}

/// `matches.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Matches {
    /// The pairs.
    pub pairs: Vec<MatchedPair>,
}

/// Matches corners of the face between two frames.
pub fn match_pair(
    a: &Path,
    b: &Path,
    camera: Option<&SourcedCamera>,
    assets: &Assets,
    options: &MatchOptions,
    progress: &Progress,
) -> Result<Matches, FacewrightError> {
    let frames = FrameSet::open(&[a.to_owned(), b.to_owned()], progress)?;
    let camera = starting_camera(&frames, camera)?;
    let pair = Pair::look(&frames, assets)?;
    let points = match options.method {
        Method::Paper => paper_matches(&pair.pyramids, &pair.masks[0], options)?,
        Method::Default => pair.matches(assets, &camera, options, progress)?,
    };
    let kept = points.iter().filter(|p| p.4 == 1).count();
    if kept < 8 {
        return Err(FacewrightError::TooFewMatches { found: kept });
    }
    let [a, b] = [0, 1].map(|i| frames.frames[i].name.clone());
    Ok(Matches { pairs: vec![MatchedPair { a, b, points }] })
}

/// The paper's: corners by the smaller eigenvalue, pyramidal Lucas–Kanade, local adjustment of cross matches.
pub fn paper_matches(
    pyramids: &[Pyramid; 2],
    mask: &GrayImage,
    options: &MatchOptions,
) -> Result<Vec<Match>, FacewrightError> {
    let corner_options = CornerOptions {
        max_count: options.corners,
        window: options.window,
        spread: Spread::Strongest,
        min_distance: 5.0,
        ..CornerOptions::default()
    };
    let corners: Vec<Vec2> = detect(&pyramids[0], Some(mask), &corner_options)?.iter().map(|c| c.position).collect();
    let tracked = track(&pyramids[0], &pyramids[1], &corners, None, &TrackOptions::paper(options.window))?;
    let found: Vec<PointMatch> = corners
        .iter()
        .zip(&tracked)
        .filter(|(_, t)| t.status == Status::Found)
        .map(|(a, t)| PointMatch { a: *a, b: t.position })
        .collect();
    let adjustment = LocalAdjustmentOptions { window: options.window, ..LocalAdjustmentOptions::default() };
    let corrected = local_adjustment(&pyramids[0], &pyramids[1], &found, &adjustment)?;
    let judged = corrected.matches.iter().zip(&corrected.outcomes);
    Ok(judged.map(|(m, outcome)| (m.a.x, m.a.y, m.b.x, m.b.y, u8::from(outcome.is_usable()))).collect())
}

/// Two frames, looked at.
struct Pair {
    pyramids: [Pyramid; 2],
    masks: [GrayImage; 2],
    seen: Vec<head::fit::FrameObservation>,
}

impl Pair {
    fn look(frames: &FrameSet, assets: &Assets) -> Result<Self, FacewrightError> {
        let look = |i: usize| -> Result<_, FacewrightError> {
            let picture = frames.load(i)?;
            let face = assets.landmarker.find(&picture)?.ok_or(FacewrightError::NoFace { frames: 1 })?;
            let mask = face_mask(
                &face,
                picture.width(),
                picture.height(),
                &MaskOptions { shrink: 0.04, ..MaskOptions::default() },
            );
            Ok((Pyramid::new(&imageops::grayscale(&picture), 4), mask, observation(Some(&face))))
        };
        let ((pyramid_a, mask_a, seen_a), (pyramid_b, mask_b, seen_b)) = (look(0)?, look(1)?);
        Ok(Self { pyramids: [pyramid_a, pyramid_b], masks: [mask_a, mask_b], seen: vec![seen_a, seen_b] })
    }

    /// Ours: the head that both frames' landmarks give predicts where each corner goes and how its surroundings are
    /// warped; an essential matrix throws out what does not move with the head.
    fn matches(
        &self,
        assets: &Assets,
        camera: &SourcedCamera,
        options: &MatchOptions,
        progress: &Progress,
    ) -> Result<Vec<Match>, FacewrightError> {
        let fit_options = FitOptions {
            focal_sigma: if camera.source == CameraSource::Board { 0.0 } else { 1e-3 },
            size: head_size(None),
            ..FitOptions::default()
        };
        let head = &assets.head;
        let fit = fit_landmarks(head, &camera.camera, &self.seen, &fit_options, progress)?;
        let pose = |i: usize| fit.frames[i].as_ref().map(|f| f.pose).ok_or(FacewrightError::NoFace { frames: 1 });
        let frame = |i: usize| -> Result<TrackedFrame<'_>, FacewrightError> {
            Ok(TrackedFrame { pyramid: &self.pyramids[i], mask: &self.masks[i], cam_from_head: pose(i)? })
        };
        let follow_options = FollowOptions { corners: options.corners, ..FollowOptions::default() };
        let triangles = head.triangles(head.skin());
        let pair = [frame(0)?, frame(1)?];
        let tracks = follow_pair(&pair, &camera.camera, &fit.positions, &triangles, &follow_options)?;
        Ok(vote(&tracks, &camera.camera, options))
    }
}

/// Marks the matches that one motion of the head explains.
fn vote(tracks: &[FaceTrack], camera: &Camera, options: &MatchOptions) -> Vec<Match> {
    let found: Vec<(Vec2, Vec2)> =
        tracks.iter().filter_map(|t| Some((t.reference_pixel, t.observations.iter().find(|o| o.0 == 1)?.1))).collect();
    let normalised = |pixels: Vec<&Vec2>| pixels.into_iter().map(|p| camera.normalise(p)).collect::<Vec<_>>();
    let (a, b) = (normalised(found.iter().map(|m| &m.0).collect()), normalised(found.iter().map(|m| &m.1).collect()));
    let two_view = TwoViewOptions { threshold: options.epipolar_px / camera.fx, ..TwoViewOptions::default() };
    // Frames that are too alike for a motion have nothing against any match.
    let inliers = robust(&a, &b, &two_view).map_or_else(|_| vec![true; found.len()], |motion| motion.inliers);
    found.iter().zip(inliers).map(|((a, b), kept)| (a.x, a.y, b.x, b.y, u8::from(kept))).collect()
}
