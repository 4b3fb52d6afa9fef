//! Which frames shape and texture are taken from, and why not from the others; clips that show no depth.

use super::Clip;
use crate::FacewrightError;
use crate::reason::{FrameReason, tally};
use geometry::Transform;
use nalgebra::Rotation3;
use std::collections::BTreeMap;

/// Keys that tell whether a face is quiet.
const EXPRESSIONS: [&str; 6] = ["jawOpen", "mouthSmile", "mouthFunnel", "mouthPucker", "browInnerUp", "mouthStretch"];

/// The frames from which shape and texture are taken.
#[derive(Clone, Debug)]
pub struct Chosen {
    /// Per frame of the clip, why it is used (`Ok`) or not.
    pub verdicts: Vec<Result<FrameReason, FrameReason>>,
    /// The frames that are used, ascending.
    pub frames: Vec<usize>,
}

impl Chosen {
    /// Of the frames that were looked at and have a pose.
    ///
    /// # Errors
    /// [`FacewrightError::TooFewUsable`], [`FacewrightError::NoRotation`], [`FacewrightError::OnlyZoom`].
    pub fn of(clip: &Clip, poses: &[Option<Transform>]) -> Result<Self, FacewrightError> {
        let mut candidates = candidates(clip);
        candidates.iter_mut().zip(poses).for_each(|(candidate, pose)| {
            let seen_from = |cam_from_head: Transform| directed(clip, cam_from_head);
            *candidate = candidate.take().zip(*pose).map(|(c, pose)| Candidate { cam_from_head: seen_from(pose), ..c });
        });
        let mut verdicts = select(&candidates, &SelectOptions::default());
        let others = clip.faces.other_shots();
        for (frame, verdict) in verdicts.iter_mut().enumerate() {
            if others[frame] {
                *verdict = Err(FrameReason::OtherShot);
            } else if clip.faces.look(frame).is_none() && clip.known.frames[frame].is_some() {
                *verdict = Err(FrameReason::BetweenLooks);
            } else if candidates[frame].is_none() && clip.faces.face(frame).is_some() {
                *verdict = Err(FrameReason::NoPose);
            }
        }
        Self { frames: Vec::new(), verdicts }.checked(clip)
    }

    /// Leaves out further frames.
    pub fn without(mut self, reason: &FrameReason, is_out: impl Fn(usize) -> bool) -> Self {
        self.frames.retain(|&frame| !is_out(frame));
        for (_, verdict) in self.verdicts.iter_mut().enumerate().filter(|(frame, v)| v.is_ok() && is_out(*frame)) {
            *verdict = Err(reason.clone());
        }
        self
    }

    fn checked(mut self, clip: &Clip) -> Result<Self, FacewrightError> {
        self.frames = (0..self.verdicts.len()).filter(|&frame| self.verdicts[frame].is_ok()).collect();
        if self.frames.len() < 2 {
            let known = clip.known.frames.iter().flatten();
            let all: Vec<Transform> = known.map(|known| directed(clip, known.cam_from_head)).collect();
            if all.len() > 1 {
                check_turn(&all)?;
            }
            let reasons =
                tally(self.verdicts.iter().filter_map(|v| v.as_ref().err()).map(|reason| reason.kind().brief()));
            return Err(FacewrightError::TooFewUsable {
                usable: self.frames.len(),
                frames: self.verdicts.len(),
                reasons,
            });
        }
        let poses: Vec<Transform> = self.frames.iter().map(|&frame| directed(clip, clip.pose(frame))).collect();
        check_turn(&poses)?;
        Ok(self)
    }
}

/// A pose by which frames are compared. Cameras side by side see a head from different directions, however they are turned: the
/// pose is that of a camera at the same place which looks at the head. A single camera's poses stay.
fn directed(clip: &Clip, cam_from_head: Transform) -> Transform {
    if clip.frames.films().count() < 2 {
        return cam_from_head;
    }
    let towards = Rotation3::rotation_between(&cam_from_head.translation, &geometry::Vec3::z());
    Transform::new(towards.unwrap_or_else(Rotation3::identity), geometry::Vec3::zeros()) * cam_from_head
}

/// What frames are chosen by; `None` where there is no face, or nobody looked.
fn candidates(clip: &Clip) -> Vec<Option<Candidate>> {
    let (head, fit) = (clip.head, &clip.landmark_fit);
    let indices = |wanted: &[&str]| -> Vec<usize> {
        let matches = |name: &str| wanted.iter().any(|w| name.starts_with(w));
        (0..head.keys.len()).filter(|&i| matches(&head.keys[i].name)).collect()
    };
    let (expressions, blinks) = (indices(&EXPRESSIONS), indices(&["eyeBlink"]));
    let fitted = || fit.frames.iter().flatten();
    let usual: Vec<f64> = (0..head.keys.len()).map(|k| median(fitted().map(|f| f.expression[k]))).collect();
    let strongest = |expression: &[f64], from: &[f64], keys: &[usize]| {
        keys.iter().map(|&k| (expression[k] - from[k]).abs()).fold(0.0, f64::max)
    };
    let candidate = |(frame, fitted): (usize, &Option<head::fit::FittedFrame>)| {
        let (look, fitted) = (clip.faces.look(frame)?, fitted.as_ref()?);
        Some(Candidate {
            cam_from_head: fitted.pose,
            rms_px: fitted.rms_px,
            sharpness: look.sharpness,
            expression: strongest(&fitted.expression, &usual, &expressions),
            from_rest: strongest(&fitted.expression, &clip.rest.change, &expressions),
            blink: strongest(&fitted.expression, &usual, &blinks),
        })
    };
    fit.frames.iter().enumerate().map(candidate).collect()
}

/// What is known of a frame when frames are chosen.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Pose from the landmarks.
    pub cam_from_head: Transform,
    /// Distance of its landmarks from the fitted head, root mean square pixels over inner landmarks.
    pub rms_px: f64,
    /// As [`crate::faces::observe::Observation::sharpness`].
    pub sharpness: f64,
    /// Strength of its expression: largest fitted coefficient beyond the clip's own median.
    pub expression: f64,
    /// The same beyond the face at rest, which a clip of somebody who talks or grins seldom shows.
    pub from_rest: f64,
    /// Strength of `eyeBlink*`, the larger of both.
    pub blink: f64,
}

/// What makes a frame usable.
#[derive(Clone, Copy, Debug)]
pub struct SelectOptions {
    /// At most so many frames are used.
    pub max_frames: usize,
    /// Frames closer in direction than this are duplicates, degrees.
    pub min_turn_deg: f64,
    /// Least sharpness relative to the clip's median.
    pub min_sharpness: f64,
    /// Largest landmark residual relative to the clip's median.
    pub max_rms: f64,
    /// Strongest expression.
    pub max_expression: f64,
    /// Strongest blink.
    pub max_blink: f64,
}

impl Default for SelectOptions {
    fn default() -> Self {
        Self {
            max_frames: 36,
            min_turn_deg: 0.7,
            min_sharpness: 0.45,
            max_rms: 2.2,
            max_expression: 0.45,
            max_blink: 0.55,
        }
    }
}

/// Yaw and pitch of the head as the camera sees it, radians: positive yaw turns the nose to image right, positive pitch
/// lifts it.
pub fn yaw_pitch(cam_from_head: &Transform) -> (f64, f64) {
    let nose = cam_from_head.rotation * geometry::Vec3::z();
    (nose.x.atan2(-nose.z), (-nose.y).asin())
}

/// Chooses frames: `reasons[i]` is `Ok` for a used frame and says why otherwise. `None` candidates have no face.
///
/// Sharp frames with a quiet face are kept; of those that look alike the best; then, while there are too many, the one
/// whose neighbours in direction are nearest is left out.
pub fn select(candidates: &[Option<Candidate>], options: &SelectOptions) -> Vec<Result<FrameReason, FrameReason>> {
    let judged = judge_all(candidates, options);
    let mut order: Vec<usize> = (0..candidates.len()).filter(|&i| judged[i].is_ok()).collect();
    let quality = |i: usize| judged[i].as_ref().copied().unwrap_or(0.0);
    order.sort_by(|&a, &b| quality(b).total_cmp(&quality(a)).then(a.cmp(&b)));
    let direction = |i: usize| candidates[i].as_ref().map(|c| yaw_pitch(&c.cam_from_head)).unwrap_or_default();
    let turn = |a: usize, b: usize| {
        let ((yaw_a, pitch_a), (yaw_b, pitch_b)) = (direction(a), direction(b));
        (yaw_a - yaw_b).hypot(pitch_a - pitch_b).to_degrees()
    };
    let mut chosen: Vec<usize> = Vec::new();
    let mut duplicate_of = BTreeMap::new();
    for i in order {
        match chosen.iter().find(|&&j| turn(i, j) < options.min_turn_deg) {
            Some(&j) => drop(duplicate_of.insert(i, j)),
            None => chosen.push(i),
        }
    }
    while chosen.len() > options.max_frames {
        // The two nearest together: the ends of the turn have neighbours on one side only, and stay.
        let crowding = |i: usize| {
            let mut turns: Vec<f64> = chosen.iter().filter(|&&j| j != i).map(|&j| turn(i, j)).collect();
            turns.sort_by(f64::total_cmp);
            turns.iter().take(2).sum::<f64>()
        };
        let crowded = chosen.iter().copied().min_by(|&a, &b| crowding(a).total_cmp(&crowding(b)).then(b.cmp(&a)));
        chosen.retain(|&i| Some(i) != crowded);
    }
    let verdict = |(i, judged): (usize, Result<f64, FrameReason>)| {
        judged.and_then(|_| {
            if chosen.contains(&i) {
                Ok(FrameReason::Yaw(direction(i).0.to_degrees()))
            } else if duplicate_of.contains_key(&i) {
                Err(FrameReason::Alike)
            } else {
                Err(FrameReason::Enough)
            }
        })
    };
    judged.into_iter().enumerate().map(verdict).collect()
}

/// Of each frame a quality to rank by, or why it is of no use for shape and texture.
fn judge_all(candidates: &[Option<Candidate>], options: &SelectOptions) -> Vec<Result<f64, FrameReason>> {
    let known: Vec<&Candidate> = candidates.iter().flatten().collect();
    let sharpness = median(known.iter().map(|c| c.sharpness));
    let rms = median(known.iter().map(|c| c.rms_px));
    let judged =
        |c: &Option<Candidate>| c.as_ref().map_or(Err(FrameReason::NoFace), |c| judge(c, sharpness, rms, options));
    candidates.iter().map(judged).collect()
}

/// The same of every frame of a clip: frames of another shot are of no use.
pub fn qualities(clip: &Clip) -> Vec<Result<f64, FrameReason>> {
    let judged = judge_all(&candidates(clip), &SelectOptions::default()).into_iter();
    let of_frame = |(judged, other)| if other { Err(FrameReason::OtherShot) } else { judged };
    judged.zip(clip.faces.other_shots()).map(of_frame).collect()
}

/// A quality to rank by, or why the frame is of no use.
fn judge(c: &Candidate, sharpness: f64, rms: f64, options: &SelectOptions) -> Result<f64, FrameReason> {
    let relative = c.sharpness / sharpness.max(f64::MIN_POSITIVE);
    if relative < options.min_sharpness {
        return Err(FrameReason::Blurred(relative));
    }
    if c.rms_px > options.max_rms * rms {
        return Err(FrameReason::Covered(c.rms_px));
    }
    if c.blink > options.max_blink {
        return Err(FrameReason::EyesClosed);
    }
    if c.expression > options.max_expression {
        return Err(FrameReason::Expression(c.expression));
    }
    Ok(relative.min(1.5) - c.from_rest - c.blink - 0.3 * c.rms_px / rms.max(f64::MIN_POSITIVE))
}

/// Turned by less than this, a head shows no depth, degrees.
const LEAST_TURN_DEG: f64 = 6.0;
/// A head that turns so little while it comes nearer, or seems to, by this factor is zoomed at, or walks.
const ZOOM: f64 = 1.15;

/// Refuses poses that show no depth: the head neither turns, nor does a zoom help.
pub fn check_turn(poses: &[Transform]) -> Result<(), FacewrightError> {
    let pairs = poses.iter().enumerate().flat_map(|(k, a)| poses[k + 1..].iter().map(|b| a.angle_to(b)));
    let degrees = pairs.fold(0.0, f64::max).to_degrees();
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

/// Middle value; 0 for none.
pub fn median(values: impl Iterator<Item = f64>) -> f64 {
    geometry::median(values).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::Vec3;

    fn looking(yaw_deg: f64) -> Candidate {
        let facing = Rotation3::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI);
        let turn = Rotation3::from_axis_angle(&Vec3::y_axis(), yaw_deg.to_radians());
        let cam_from_head = Transform::new(facing * turn, Vec3::new(0.0, 0.0, 0.7));
        Candidate { cam_from_head, rms_px: 1.0, sharpness: 1.0, expression: 0.1, from_rest: 0.1, blink: 0.1 }
    }

    fn used(result: &[Result<FrameReason, FrameReason>]) -> Vec<usize> {
        (0..result.len()).filter(|&i| result[i].is_ok()).collect()
    }

    #[test]
    fn yaw_is_positive_to_image_right() {
        let (yaw, pitch) = yaw_pitch(&looking(20.0).cam_from_head);
        assert!((yaw.to_degrees() - 20.0).abs() < 1e-9 && pitch.abs() < 1e-9);
    }

    #[test]
    fn each_unfit_frame_gets_its_reason() {
        let mut clip: Vec<_> = (0..9).map(|i| Some(looking(f64::from(i) * 5.0 - 20.0))).collect();
        clip[1].as_mut().unwrap().sharpness = 0.2;
        clip[2].as_mut().unwrap().blink = 0.9;
        clip[3].as_mut().unwrap().rms_px = 4.0;
        clip[4] = None;
        clip[5].as_mut().unwrap().expression = 0.8;
        let result = select(&clip, &SelectOptions::default());
        assert_eq!(result[1], Err(FrameReason::Blurred(0.2)));
        assert_eq!(result[2], Err(FrameReason::EyesClosed));
        assert_eq!(result[3], Err(FrameReason::Covered(4.0)));
        assert_eq!((&result[4], &result[5]), (&Err(FrameReason::NoFace), &Err(FrameReason::Expression(0.8))));
        assert_eq!(used(&result), [0, 6, 7, 8]);
    }

    #[test]
    fn of_frames_that_look_alike_the_one_nearest_to_the_rest_is_taken() {
        let mut clip: Vec<_> = (0..9).map(|i| Some(looking(f64::from(i / 3) * 5.0))).collect();
        for calm in [1, 5, 6] {
            clip[calm].as_mut().unwrap().from_rest = 0.02;
        }
        assert_eq!(used(&select(&clip, &SelectOptions::default())), [1, 5, 6]);
    }

    #[test]
    fn a_long_rest_at_one_side_does_not_crowd_out_the_turn() {
        let mut clip: Vec<_> = (0..100).map(|i| Some(looking(f64::from(i) * 0.001))).collect();
        clip.extend((1..=30).map(|i| Some(looking(f64::from(i)))));
        let options = SelectOptions { max_frames: 10, ..SelectOptions::default() };
        let chosen = used(&select(&clip, &options));
        assert_eq!(chosen.len(), 10);
        assert!(chosen.iter().filter(|&&i| i < 100).count() <= 1);
        assert!(chosen.contains(&129), "the end of the turn is kept: {chosen:?}");
    }
}
