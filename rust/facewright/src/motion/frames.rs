//! What is said of each frame: its pose and how certain that is, or why it has none.

use super::head_motion::FrameMotion;
use crate::reason::{FrameReason, Told};
use crate::{FrameTracks, Tracks};
use geometry::{Mat3, Transform, Vec3, skew};
use motion::bundle::Observation;
use motion::sequence::Sequence;
use nalgebra::{Matrix2x3, Matrix6, Rotation3, SMatrix};

/// A frame in which fewer of the points that it shows agree with its pose has none: it is covered, blurred or grimaces.
const LEAST_SHARE: f64 = 0.3;
/// So is one whose pose the landmarks contradict by more than this, degrees …
const CONTRADICTION_DEG: f64 = 10.0;
/// … unless so many of its points, and so large a part of them, say otherwise.
const CLEAR_MAJORITY: (usize, f64) = (40, 0.8);
/// Steps of the mean of rotations, and the angle below which they weigh alike, radians.
const MEAN_STEPS: usize = 8;
const LEAST_ANGLE: f64 = 0.01;
/// Fewer points than this make a pose doubtful.
const FEW_POINTS: usize = 20;

/// Every frame; `middle` is that of the head's points.
pub(super) fn frames(tracks: &Tracks, motion: &Sequence, middle: &Vec3, threshold_px: f64) -> Vec<FrameMotion> {
    let mut agree = vec![Vec::new(); tracks.frames.len()];
    motion.observations.iter().for_each(|o| agree[o.frame].push(*o));
    let near = near(tracks, motion, threshold_px);
    let off = off_landmarks_deg(tracks, motion);
    let frame = |(k, tracked): (usize, &FrameTracks)| {
        let pose = verdict(k, tracked, motion, near[k], off[k]);
        let used = pose.is_ok();
        let (pose, told) = pose.map_or_else(|told| (None, told), |(pose, told)| (Some(pose), told));
        let sigma = pose.and_then(|pose| deviations(&pose, motion, &agree[k], middle));
        FrameMotion {
            name: tracked.name.clone(),
            used,
            reason: told.reason,
            reason_kind: told.kind,
            cam_from_head: pose,
            rotation_sigma_deg: sigma.map(|(turn, _)| turn.to_degrees()),
            translation_sigma_mm: sigma.map(|(_, shift)| 1000.0 * shift),
            reprojection_rms_px: pose.map(|_| motion.report.frames[k].rms_px),
            points: if used { agree[k].len() } else { 0 },
        }
    };
    tracks.frames.iter().enumerate().map(frame).collect()
}

/// Of each frame how many of the head's points are where its pose takes them, and how many it shows.
fn near(tracks: &Tracks, motion: &Sequence, threshold_px: f64) -> Vec<[usize; 2]> {
    let mut near = vec![[0; 2]; tracks.frames.len()];
    for (track, point) in tracks.tracks.iter().zip(&motion.points) {
        let Some(point) = point else { continue };
        for seen in &track.observations {
            let at = motion.poses[seen.frame].as_ref().ok().and_then(|pose| motion.camera.project(&pose.apply(point)));
            let is_near = at.is_some_and(|at| (at - seen.pixel).norm() < threshold_px);
            let [agree, shown] = near[seen.frame];
            near[seen.frame] = [agree + usize::from(is_near), shown + 1];
        }
    }
    near
}

/// How far each pose is from the landmarks', whose head may be turned against the motion's, degrees; 0 where either is
/// missing.
fn off_landmarks_deg(tracks: &Tracks, motion: &Sequence) -> Vec<f64> {
    let turn = |(frame, pose): (&FrameTracks, &Result<Transform, _>)| {
        Some(frame.cam_from_head?.rotation.inverse() * pose.as_ref().ok()?.rotation)
    };
    let turns: Vec<Option<Rotation3<f64>>> = tracks.frames.iter().zip(&motion.poses).map(turn).collect();
    let known: Vec<Rotation3<f64>> = turns.iter().flatten().copied().collect();
    let usual = middle_of_rotations(&known);
    turns.iter().map(|turn| turn.map_or(0.0, |turn| turn.angle_to(&usual).to_degrees())).collect()
}

/// The rotation with nearly the least sum of angles to all: the mean, weighed anew a few times.
fn middle_of_rotations(rotations: &[Rotation3<f64>]) -> Rotation3<f64> {
    let mut middle = rotations.first().copied().unwrap_or_else(Rotation3::identity);
    for _ in 0..MEAN_STEPS {
        let weight = |rotation: &Rotation3<f64>| 1.0 / rotation.angle_to(&middle).max(LEAST_ANGLE);
        let sum: Mat3 = rotations.iter().map(|rotation| rotation.matrix() * weight(rotation)).sum();
        middle = Transform::from_matrix(&sum, Vec3::zeros()).rotation;
    }
    middle
}

/// The pose and what it rests on, or why there is none; `agree` of the points that the frame has shown do.
fn verdict(
    frame: usize,
    tracked: &FrameTracks,
    motion: &Sequence,
    [agree, shown]: [usize; 2],
    off_deg: f64,
) -> Result<(Transform, Told), Told> {
    let tracker_says = || Told { reason: tracked.reason.clone(), kind: tracked.reason_kind };
    let is_clear = agree >= CLEAR_MAJORITY.0 && agree as f64 >= CLEAR_MAJORITY.1 * shown as f64;
    match &motion.poses[frame] {
        Ok(_) if off_deg > CONTRADICTION_DEG && !is_clear => Err(FrameReason::Contradicted(off_deg).told()),
        Ok(_) if (agree as f64) < LEAST_SHARE * shown as f64 => Err(FrameReason::FewAgree { agree, shown }.told()),
        Ok(pose) if agree < FEW_POINTS => Ok((*pose, FrameReason::FewPoints(agree).told())),
        Ok(pose) => Ok((*pose, tracker_says())),
        // What the tracker said of the frame says more than that it has no points.
        Err(_) if !tracked.used => Err(tracker_says()),
        Err(error) => Err(FrameReason::Unplaced(error.clone()).told()),
    }
}

/// Standard deviations of a frame's rotation about the head's middle, radians, and of that middle's position, metres, each
/// the root of the sum over the axes: by the noise that the frame's own points show, the points being where they are.
fn deviations(pose: &Transform, motion: &Sequence, agree: &[Observation], middle: &Vec3) -> Option<(f64, f64)> {
    let (mut information, mut chi2) = (Matrix6::zeros(), 0.0);
    for o in agree {
        let arm = pose.rotation * (motion.points[o.point]? - middle);
        let (pixel, jacobian) = motion.camera.project_with_jacobian(&(pose.apply(middle) + arm))?;
        let by_shift: Matrix2x3<f64> = jacobian.point / o.sigma_px;
        let mut by_pose = SMatrix::<f64, 2, 6>::zeros();
        by_pose.fixed_columns_mut::<3>(0).copy_from(&(-by_shift * skew(&arm)));
        by_pose.fixed_columns_mut::<3>(3).copy_from(&by_shift);
        information += by_pose.transpose() * by_pose;
        chi2 += (pixel - o.pixel).norm_squared() / (o.sigma_px * o.sigma_px);
    }
    let freedom = (2.0 * agree.len() as f64 - 6.0).max(1.0);
    let covariance = information.try_inverse()? * (chi2 / freedom).max(1.0);
    let spread = |first: usize| (first..first + 3).map(|k| covariance[(k, k)]).sum::<f64>().sqrt();
    Some((spread(0), spread(3))).filter(|(turn, shift)| turn.is_finite() && shift.is_finite())
}
