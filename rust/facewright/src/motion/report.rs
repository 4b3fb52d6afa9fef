//! What is said of a motion: its points, its size, and what the artist should know.

use super::frames::frames;
use super::head_motion::{FrameMotion, HeadMotion, PointMotion, Roughness};
use super::rigid::{Judged, place};
use super::scale::{Size, by_landmarks, by_lengths};
use super::{MotionOptions, Problem};
use crate::camera::{contradicted_exif, is_usual_focal, part_of_picture};
use crate::clock::Clock;
use crate::faces::median;
use crate::reason::{brief, tally};
use crate::{CameraSource, FacewrightError, Method, Schema, SourcedCamera, Tracks};
use geometry::{Mat3, Transform, Vec3};
use motion::sequence::Sequence;
use nalgebra::UnitQuaternion;
use std::collections::BTreeMap;

/// More frames with the same reason than this are not named one by one.
const NAMED: usize = 5;
/// Least part of the frames with points that a motion must explain.
const LEAST_USED: f64 = 0.2;
/// A focal length less certain than this is warned of, as part of it.
const VAGUE_FOCAL: f64 = 0.1;

/// Puts the result together: points, size (that of the options unless it is `known`), frames, and what to say of them.
pub(super) fn report(
    tracks: &Tracks,
    problem: &Problem,
    mut motion: Sequence,
    judged: &[Judged],
    (options, known): (&MotionOptions, Option<Size>),
    mut clock: Clock,
) -> Result<HeadMotion, FacewrightError> {
    let points = points(tracks, problem, &motion, judged);
    let frames = frames(tracks, &motion, &middle(&points), problem.options.threshold_px);
    check_enough(tracks, &frames)?;
    let poses: Vec<Option<Transform>> = frames.iter().map(|frame| frame.cam_from_head).collect();
    let size = match known {
        Some(size) => size,
        None if options.size.lengths.is_empty() => {
            by_landmarks(tracks, &poses, &motion.camera, options.size.interocular())?
        }
        None => by_lengths(&points, &options.size.lengths)?,
    };
    let focal_sigma_px = motion.focal_sigma_px.take();
    clock.lap("report");
    let mut motion = HeadMotion {
        schema: Schema,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        method: Method::Default,
        warnings: warnings(tracks, &frames, problem, &motion, focal_sigma_px),
        roughness: roughness(&frames, &middle(&points)),
        camera: SourcedCamera { camera: motion.camera, source: problem.camera.source },
        focal_sigma_px,
        frames,
        points,
        scale: size.scale.clone(),
        reprojection_rms_px: motion.report.rms_px,
        rigid_agreement: agreement(tracks, &motion),
        timings_s: clock.finish(),
    };
    motion.resize(size.factor, size.scale);
    Ok(motion)
}

/// Part of the observations that the motion explains.
fn agreement(tracks: &Tracks, motion: &Sequence) -> f64 {
    let all: usize = tracks.tracks.iter().map(|track| track.observations.len()).sum();
    motion.observations.len() as f64 / all.max(1) as f64
}

/// Refuses a motion that explains hardly any frame: a few wrong tracks always agree by chance.
fn check_enough(tracks: &Tracks, frames: &[FrameMotion]) -> Result<(), FacewrightError> {
    let mut shows_points = vec![false; frames.len()];
    tracks.tracks.iter().flat_map(|track| &track.observations).for_each(|o| shows_points[o.frame] = true);
    let tracked = shows_points.iter().filter(|shows| **shows).count();
    let usable = frames.iter().filter(|frame| frame.used).count();
    if usable >= 2 && usable as f64 >= LEAST_USED * tracked as f64 {
        return Ok(());
    }
    let reasons = tally(frames.iter().filter(|frame| !frame.used).map(|frame| brief(frame.reason_kind, &frame.reason)));
    Err(FacewrightError::TooFewUsable { usable, frames: frames.len(), reasons })
}

fn points(tracks: &Tracks, problem: &Problem, motion: &Sequence, judged: &[Judged]) -> Vec<PointMotion> {
    let covariances = covariances(motion, problem.fewest_frames);
    let point = |(k, track): (usize, &crate::PointTrack)| {
        let fit = motion.report.points[k];
        let rigid = motion.points[k]
            .filter(|_| judged[k] == Judged::Rigid && fit.observations > 1 && motion.report.point_sigma[k].is_finite());
        if let Some(position) = rigid {
            return Some(PointMotion {
                id: track.id,
                position: position.into(),
                sigma_mm: 1000.0 * motion.report.point_sigma[k],
                covariance_mm2: covariances[k],
                frames: fit.observations,
                reprojection_rms_px: fit.rms_px,
                region: track.region,
                moves: false,
            });
        }
        (judged[k] == Judged::Moves)
            .then(|| moving(track, &problem.tracks[k], motion, problem.options.threshold_px))
            .flatten()
    };
    tracks.tracks.iter().enumerate().filter_map(point).collect()
}

/// Covariance of each point that enough frames tell, the poses being where they are, mm² along the head's axes. The
/// tracker's own deviations know nothing of what changes between frames: they are scaled to what the bundle found.
fn covariances(motion: &Sequence, fewest_frames: usize) -> Vec<Option<[f64; 6]>> {
    let mut information = vec![(Mat3::zeros(), 0_usize); motion.points.len()];
    for o in &motion.observations {
        let (Ok(pose), Some(point)) = (&motion.poses[o.frame], &motion.points[o.point]) else { continue };
        let Some((_, jacobian)) = motion.camera.project_with_jacobian(&pose.apply(point)) else { continue };
        let by_point = jacobian.point * pose.rotation.matrix() / o.sigma_px;
        let (sum, count) = &mut information[o.point];
        *sum += by_point.transpose() * by_point;
        *count += 1;
    }
    let covariance = |(sum, count): &(Mat3, usize)| {
        let found = sum.try_inverse().filter(|_| *count >= fewest_frames)? * (1e6 * motion.report.excess);
        Some([found[(0, 0)], found[(0, 1)], found[(0, 2)], found[(1, 1)], found[(1, 2)], found[(2, 2)]])
    };
    information.iter().map(covariance).collect()
}

/// A point that moves against the head: its usual place, as far as it has one.
fn moving(
    track: &crate::PointTrack,
    seen: &motion::sequence::PointTrack,
    motion: &Sequence,
    threshold_px: f64,
) -> Option<PointMotion> {
    let placed = place(seen, motion, threshold_px)?;
    let rms = (placed.distances.iter().map(|d| d * d).sum::<f64>() / placed.distances.len() as f64).sqrt();
    let before_all_cameras = rms.is_finite();
    before_all_cameras.then(|| PointMotion {
        id: track.id,
        position: placed.point.into(),
        sigma_mm: 1000.0 * rms * placed.depth / motion.camera.fx,
        covariance_mm2: None,
        frames: placed.near,
        reprojection_rms_px: rms,
        region: track.region,
        moves: true,
    })
}

/// The middle of the points that move with the head.
fn middle(points: &[PointMotion]) -> Vec3 {
    let rigid: Vec<Vec3> = points.iter().filter(|p| !p.moves).map(PointMotion::position).collect();
    rigid.iter().sum::<Vec3>() / rigid.len().max(1) as f64
}

fn roughness(frames: &[FrameMotion], middle: &Vec3) -> Roughness {
    let (mut turns, mut shifts) = (Vec::new(), Vec::new());
    for three in frames.windows(3) {
        let [Some(a), Some(b), Some(c)] = [0, 1, 2].map(|k| three[k].cam_from_head) else { continue };
        let turn = |from: &Transform, to: &Transform| {
            UnitQuaternion::from_rotation_matrix(&(to.rotation * from.rotation.inverse())).scaled_axis()
        };
        turns.push((turn(&b, &c) - turn(&a, &b)).norm().to_degrees());
        shifts.push(1000.0 * (c.apply(middle) - 2.0 * b.apply(middle) + a.apply(middle)).norm());
    }
    Roughness { rotation_deg: median(turns.into_iter()), translation_mm: median(shifts.into_iter()) }
}

fn warnings(
    tracks: &Tracks,
    frames: &[FrameMotion],
    problem: &Problem,
    motion: &Sequence,
    focal_sigma_px: Option<f64>,
) -> Vec<String> {
    let mut warnings = tracks.warnings.clone();
    warnings.extend(without_pose(frames));
    if let Some(sigma) = focal_sigma_px {
        let refined = SourcedCamera { camera: motion.camera, source: problem.camera.source };
        warnings.extend(vague_focal(&refined, sigma));
        warnings.extend(contradicted_exif(&tracks.camera, motion.camera.fx, sigma));
    }
    warnings.extend(part_of_picture(&motion.camera).filter(|_| motion.is_lens_free));
    if !motion.anchored {
        warnings
            .push("the tracks contradict the landmarks' poses: the head's own directions and size are guessed".into());
    }
    warnings
}

/// What is said of a focal length that the points tell only roughly, or not at all.
fn vague_focal(refined: &SourcedCamera, sigma: f64) -> Option<String> {
    let focal = refined.camera.fx;
    let is_vague = refined.source != CameraSource::Board && sigma > VAGUE_FOCAL * focal;
    is_vague.then(|| match is_usual_focal(refined, sigma / focal) {
        true => format!(
            "the head's turn does not tell the focal length: {focal:.0} ± {sigma:.0} px is mostly what cameras usually have, and the head's depth is \
             uncertain with it: turn further, calibrate with a board, or take photographs whose EXIF tells the focal length"
        ),
        false => format!(
            "the focal length, {focal:.0} ± {sigma:.0} px, is poorly determined and the head's depth with it: \
             turn further, come nearer, or calibrate with a board"
        ),
    })
}

/// Frames without a pose, those together whose reasons are of one kind.
fn without_pose(frames: &[FrameMotion]) -> Vec<String> {
    let mut alike: BTreeMap<&str, Vec<&FrameMotion>> = BTreeMap::new();
    for frame in frames.iter().filter(|frame| !frame.used) {
        alike.entry(brief(frame.reason_kind, &frame.reason)).or_default().push(frame);
    }
    let told = |frames: &Vec<&FrameMotion>| {
        let names: Vec<&str> = frames.iter().map(|frame| frame.name.as_str()).collect();
        let which = match names.len() {
            1..=NAMED => names.join(", "),
            count => format!("{count} frames, {} among them,", names[0]),
        };
        format!("{which} without a pose: {}", frames[0].reason)
    };
    alike.values().map(told).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ReasonKind;
    use geometry::Camera;

    fn unposed(name: &str, reason: &str, reason_kind: Option<ReasonKind>) -> FrameMotion {
        FrameMotion {
            name: name.to_owned(),
            used: false,
            reason: reason.to_owned(),
            reason_kind,
            cam_from_head: None,
            rotation_sigma_deg: None,
            translation_sigma_mm: None,
            reprojection_rms_px: None,
            points: 0,
        }
    }

    #[test]
    fn a_focal_length_that_the_turn_does_not_tell_is_said_to_be_that_of_cameras() {
        use CameraSource::{Board, Estimated, Exif};
        for (source, sigma, words) in [
            (Estimated, 90.0, ""),
            (Estimated, 110.0, "1000 ± 110 px, is poorly determined"),
            (Estimated, 247.0, "1000 ± 247 px, is poorly determined"),
            // The points alone then tell it to 35 %, as what cameras have does.
            (Estimated, 248.0, "1000 ± 248 px is mostly what cameras usually have"),
            (Exif, 40.0, ""),
            (Exif, 200.0, "is poorly determined"),
            (Board, 200.0, ""),
        ] {
            let refined = SourcedCamera { camera: Camera::centred(900, 600, 1000.0), source };
            let said = vague_focal(&refined, sigma).unwrap_or_default();
            assert!(said.contains(words) && said.is_empty() == words.is_empty(), "{source:?} {sigma}: {said}");
            let remedies = ["turn further", "a board", "EXIF"].map(|remedy| said.contains(remedy));
            assert!(!said.contains("cameras usually") || remedies == [true; 3], "{said}");
        }
    }

    #[test]
    fn frames_without_a_pose_are_told_of_together_where_their_reasons_are_of_one_kind() {
        let frames = [
            unposed("a", "10 % as sharp as others", Some(ReasonKind::Blurred)),
            unposed("b", "it is only 1/3 as sharp", Some(ReasonKind::Blurred)),
            unposed("c", "no face", None),
        ];
        let told = ["a, b without a pose: 10 % as sharp as others", "c without a pose: no face"];
        assert_eq!(without_pose(&frames), told);
    }
}
