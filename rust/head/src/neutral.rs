//! The face at rest, from a film in which it may never rest.
//!
//! What all frames share of the expressions is part of the shape as filmed: a person who talks or grins all along is measured with that
//! mouth. The frames in which least is going on tell what the rest is, also where the identity class took a grin for a wide mouth:
//! there the keys at rest are negative.
//!
//! # Entry point
//! [`Rest::of`]

use crate::GenericHead;
use crate::fit::LandmarkFit;
use geometry::{Vec3, median, smooth_step};

/// Keys that are at rest together, by the beginnings of their names.
const GROUPS: [&[&str]; 3] =
    [&["jaw", "mouth", "cheekPuff", "cheekSquint", "noseSneer"], &["brow"], &["eyeBlink", "eyeWide", "eyeSquint"]];
/// Answers to `jawOpen` and says nothing by itself.
const ANSWER: &str = "mouthClose";
/// The calmest part of the frames is at rest …
const CALM: f64 = 0.15;
/// … but at least so many frames: one alone may be the net's mistake.
const LEAST_CALM: usize = 3;
/// The landmarks of a face that keeps still wander by up to 3 mm between frames (median to calmest frames; 0.9 to 2.9 mm in films of
/// people told to keep still): only what is beyond that is an expression. From twice that on it is nothing else. Metres.
const WANDERS: (f64, f64) = (0.003, 0.006);
/// A person whose face is never calmer than this has not shown the rest: the rest of the key is taken away.
const STRONGEST: f64 = 0.25;

/// The face at rest against the face as filmed.
#[derive(Clone, Debug, PartialEq)]
pub struct Rest {
    /// What the rest adds to what the frames share, a weight for each of the head's keys; zeros for a film of a calm face.
    pub change: Vec<f64>,
    /// Whether the mouth moved while it was filmed: 0 for one that kept still, up to 1.
    pub mouth_moved: f64,
}

impl Rest {
    /// Of a clip's landmarks.
    pub fn of(head: &GenericHead, fit: &LandmarkFit) -> Self {
        let shared = &fit.shared_expression;
        let frames: Vec<Vec<f64>> =
            fit.frames.iter().flatten().filter(|f| f.trusted).map(|f| sum(shared, &f.expression)).collect();
        let mut change = vec![0.0; head.keys.len()];
        let mut moved = [0.0; GROUPS.len()];
        if frames.len() > LEAST_CALM {
            moved = GROUPS.map(|group| calm_down(head, shared, &frames, group, &mut change));
        }
        Self { change, mouth_moved: moved[0] }
    }

    /// All vertices of a head as filmed, `scale` times as large as the class: at rest.
    pub fn apply(&self, head: &GenericHead, positions: &[Vec3], scale: f64) -> Vec<Vec3> {
        let scaled: Vec<f64> = self.change.iter().map(|c| c * scale).collect();
        head.with_expression(positions, &scaled)
    }

    /// A frame's own expression, which adds to what all share, as one that adds to the rest.
    pub fn from_rest(&self, own: &[f64]) -> Vec<f64> {
        own.iter().zip(&self.change).map(|(own, change)| own - change).collect()
    }
}

/// The change of one group's keys, and whether the group moved.
fn calm_down(head: &GenericHead, shared: &[f64], frames: &[Vec<f64>], group: &[&str], change: &mut [f64]) -> f64 {
    let keys: Vec<usize> =
        (0..head.keys.len()).filter(|&k| group.iter().any(|g| head.keys[k].name.starts_with(g))).collect();
    let reach: Vec<f64> = keys.iter().map(|&k| reach(head, k)).collect();
    let activity = |f: &Vec<f64>| keys.iter().zip(&reach).map(|(&k, reach)| f[k] * reach).sum::<f64>();
    let mut order: Vec<(f64, usize)> = frames.iter().map(activity).zip(0..).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let calm = &order[..((CALM * frames.len() as f64) as usize).max(LEAST_CALM)];
    let middle = |k: usize, of: &mut dyn Iterator<Item = usize>| median(of.map(|f| frames[f][k])).unwrap_or(shared[k]);
    let mut step = vec![0.0; head.keys.len()];
    for &k in &keys {
        step[k] = middle(k, &mut calm.iter().map(|c| c.1)) - middle(k, &mut (0..frames.len()));
    }
    let moved = head.landmark_offsets(&step).iter().map(|d| d.norm()).fold(0.0, f64::max);
    let share = smooth_step(WANDERS.0, WANDERS.1, moved);
    for &k in &keys {
        let rest = middle(k, &mut calm.iter().map(|c| c.1)) * share + shared[k] * (1.0 - share);
        change[k] = rest.min(STRONGEST) - shared[k];
    }
    share
}

/// How far a key moves the landmarks that it moves, metres, root mean square; 0 for what only answers another key.
fn reach(head: &GenericHead, key: usize) -> f64 {
    if head.keys[key].name == ANSWER {
        return 0.0;
    }
    let mut weights = vec![0.0; head.keys.len()];
    weights[key] = 1.0;
    let moved: Vec<f64> =
        head.landmark_offsets(&weights).iter().map(|d| d.norm_squared()).filter(|d| *d > 4e-8).collect();
    (moved.iter().sum::<f64>() / moved.len().max(1) as f64).sqrt()
}

fn sum(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::FittedFrame;
    use crate::fit::testing::toy_head;
    use geometry::Transform;

    /// A film in which `jawOpen` goes through these weights, and what the fit makes of it: the median is shared.
    fn film(jaw: &[f64]) -> LandmarkFit {
        let shared = median(jaw.iter().copied()).unwrap();
        let frame = |jaw: &f64| {
            let (pose, expression) = (Transform::identity(), vec![jaw - shared, 0.0, 0.0]);
            Some(FittedFrame { pose, expression, rms_px: 0.5, trusted: true })
        };
        LandmarkFit {
            camera: crate::fit::testing::camera(),
            coefficients: Vec::new(),
            shared_expression: vec![shared, 0.0, 0.0],
            frames: jaw.iter().map(frame).collect(),
            scale: 1.0,
            positions: Vec::new(),
            slips: Vec::new(),
            landmark_errors_px: Vec::new(),
        }
    }

    fn jaw_at_rest(jaw: &[f64]) -> f64 {
        let fit = film(jaw);
        fit.shared_expression[0] + Rest::of(&toy_head(), &fit).change[0]
    }

    #[test]
    fn who_keeps_still_is_at_rest_as_filmed() {
        let wandering: Vec<f64> = (0..60).map(|k| 0.08 + 0.03 * f64::from(k).sin()).collect();
        let rest = Rest::of(&toy_head(), &film(&wandering));
        assert_eq!((rest.change[0], rest.mouth_moved), (0.0, 0.0));
        assert_eq!(rest.from_rest(&[0.1, 0.2, 0.3]), [0.1, 0.2, 0.3]);
    }

    #[test]
    fn who_talks_all_along_is_at_rest_as_in_the_pauses() {
        let talking: Vec<f64> =
            (0..60).map(|k| if k % 6 == 0 { 0.05 } else { 0.6 + 0.3 * f64::from(k).sin() }).collect();
        assert!((jaw_at_rest(&talking) - 0.05).abs() < 0.02, "{}", jaw_at_rest(&talking));
        let fit = film(&talking);
        let rest = Rest::of(&toy_head(), &fit);
        assert_eq!(rest.mouth_moved, 1.0);
        // The same frame from the rest and from what is shared.
        let from_rest = rest.from_rest(&[0.2, 0.0, 0.0])[0] + jaw_at_rest(&talking);
        assert!((from_rest - (0.2 + fit.shared_expression[0])).abs() < 1e-12);
    }

    #[test]
    fn a_mouth_that_the_class_took_for_the_persons_own_is_undone() {
        // The identity grins; frames without a grin are negative.
        let grinning: Vec<f64> = (0..60).map(|k| if k % 5 == 0 { -0.5 } else { 0.1 }).collect();
        assert!((jaw_at_rest(&grinning) + 0.5).abs() < 0.02, "{}", jaw_at_rest(&grinning));
    }

    #[test]
    fn who_never_closes_the_mouth_has_it_closed_at_rest() {
        let open: Vec<f64> = (0..60).map(|k| 0.8 + 0.02 * f64::from(k).sin()).collect();
        assert!(jaw_at_rest(&open) <= STRONGEST + 1e-12);
    }

    #[test]
    fn one_wrong_frame_and_a_few_frames_say_nothing() {
        let mut calm: Vec<f64> = (0..60).map(|k| 0.08 + 0.02 * f64::from(k).sin()).collect();
        calm[17] = -2.0;
        assert_eq!(Rest::of(&toy_head(), &film(&calm)).change[0], 0.0);
        assert_eq!(Rest::of(&toy_head(), &film(&[0.0, 0.5, 0.6])).change[0], 0.0);
    }
}
