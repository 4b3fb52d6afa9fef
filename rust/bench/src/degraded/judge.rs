//! Tracks beside the true surface.

use super::Truth;
use super::tracks::{Track, Tracks};
use crate::clock::median;
use crate::scenes::clip::Clip;
use crate::scenes::seen::{Body, Seen};
use anyhow::ensure;
use geometry::{Camera, Transform, Vec2, Vec3};
use rayon::prelude::*;

/// Errors that are counted, pixels; an observation is right up to the second.
const BOUNDS_PX: [f64; 3] = [1.0, 1.5, 3.0];
/// Turns from the reference whose errors are told apart, degrees.
const TURNS_DEG: [(f64, f64); 4] = [(5.0, 7.0), (10.0, 12.0), (15.0, 17.0), (20.0, 23.0)];
/// A track stands still that stays within the first of these pixels while the truth moves by more than the second.
const STANDS_PX: (f64, f64) = (1.0, 4.0);
/// Width of a column.
const COLUMN: usize = 9;

/// How good the tracks of a film are.
#[derive(Debug)]
pub struct Verdict {
    frames: usize,
    used: usize,
    tracks: usize,
    /// Tracks per frame.
    live: f64,
    /// Of observations, references left out: within each of the bounds, percent.
    within: [f64; 3],
    /// Of the frames in which the truth shows a track's point: observed rightly, percent.
    found: f64,
    /// Tracks that stand still, or begin beside the head.
    standing: usize,
    /// Of observations, references left out, pixels.
    median: f64,
    /// The same at each of the turns.
    by_turn: [f64; 4],
}

impl Verdict {
    /// Two lines above the rows, whose first column has a width.
    pub fn headings(width: usize) -> [String; 2] {
        let turns = TURNS_DEG.map(|(low, high)| format!("{low:.0}-{high:.0}°"));
        let above = [
            "frames",
            "tracks",
            "per",
            "≤ 1 px",
            "≤ 1.5",
            "≤ 3 px",
            "found",
            "stand",
            "median",
            "median px",
            "at",
            "a",
            "turn",
        ];
        let below =
            ["used", "", "frame", "%", "px, %", "%", "%", "still", "px", &turns[0], &turns[1], &turns[2], &turns[3]];
        [above, below].map(|cells| format!("{:width$}{}", "", columns(cells.map(str::to_owned))))
    }

    /// A row but for its first column.
    pub fn row(&self) -> String {
        let [one, right, three] = self.within.map(|v| format!("{v:.1}"));
        let [a, b, c, d] = self.by_turn.map(pixels);
        columns([
            format!("{}/{}", self.used, self.frames),
            self.tracks.to_string(),
            format!("{:.1}", self.live),
            one,
            right,
            three,
            format!("{:.1}", self.found),
            self.standing.to_string(),
            pixels(self.median),
            a,
            b,
            c,
            d,
        ])
    }
}

fn columns(cells: [String; 13]) -> String {
    cells.map(|cell| format!("  {cell:>COLUMN$}")).concat()
}

fn pixels(value: f64) -> String {
    if value.is_finite() { format!("{value:.2}") } else { "-".to_owned() }
}

/// What a film is.
pub fn describe(clip: &Clip) -> String {
    let nose =
        |frame: &crate::scenes::clip::Frame| clip.camera.project(&frame.cam_from_head.apply(&clip.nose_tip.into()));
    let places: Vec<Vec2> = clip.frames.iter().filter_map(nose).collect();
    let moves: Vec<f64> = places.windows(2).map(|p| (p[1] - p[0]).norm()).collect();
    let turn = |k: usize| clip.frames.get(k).map_or(f64::NAN, |frame| frame.yaw_deg);
    format!(
        "{} frames of {}x{}, the head turns from {:.0}° to {:.0}°, its nose moves {:.1} px from frame to frame",
        clip.frames.len(),
        clip.camera.width,
        clip.camera.height,
        turn(0),
        turn(clip.frames.len().saturating_sub(1)),
        median(moves),
    )
}

/// What is found out about one track.
#[derive(Default)]
struct Judged {
    /// Error of each observation but the reference, pixels, and the turn since the reference, degrees.
    errors: Vec<(f64, f64)>,
    /// Frames but the reference in which the truth shows the point.
    shown: usize,
    /// Those of them that have an observation that is right.
    right: usize,
    stands: bool,
}

/// Judges the tracks of a film by the head that was filmed.
pub fn judge(tracks: &Tracks, body: &Body, camera: Camera, truth: &Truth) -> anyhow::Result<Verdict> {
    let frames = truth.cam_from_head.len();
    ensure!(tracks.frames.len() == frames, "tracks of {} frames, a film of {frames}", tracks.frames.len());
    let inside = |t: &Track| t.observations.iter().all(|o| o.0 < frames) && t.reference < frames;
    ensure!(tracks.tracks.iter().all(inside), "a track has an observation in a frame that is not there");
    let seen: Vec<Seen<'_>> = truth.cam_from_head.par_iter().map(|pose| Seen::new(body, camera, *pose)).collect();
    let judged: Vec<Judged> = tracks.tracks.par_iter().map(|track| follow(track, &seen, truth)).collect();
    let errors: Vec<(f64, f64)> = judged.iter().flat_map(|j| j.errors.iter().copied()).collect();
    let count = |bound: f64| errors.iter().filter(|(error, _)| *error <= bound).count();
    let at = |(low, high): (f64, f64)| {
        median(errors.iter().filter(|(_, turn)| (low..=high).contains(turn)).map(|(error, _)| *error).collect())
    };
    let sum = |of: fn(&Judged) -> usize| judged.iter().map(of).sum::<usize>();
    let observations: usize = tracks.tracks.iter().map(|t| t.observations.len()).sum();
    Ok(Verdict {
        frames,
        used: tracks.frames.iter().filter(|f| f.used).count(),
        tracks: tracks.tracks.len(),
        live: observations as f64 / frames as f64,
        within: BOUNDS_PX.map(|bound| percent(count(bound), errors.len())),
        found: percent(sum(|j| j.right), sum(|j| j.shown)),
        standing: sum(|j| usize::from(j.stands)),
        median: median(errors.iter().map(|(error, _)| *error).collect()),
        by_turn: TURNS_DEG.map(at),
    })
}

/// Follows the point of the head that a track's reference shows.
fn follow(track: &Track, seen: &[Seen<'_>], truth: &Truth) -> Judged {
    // Where it would be in a film that was not moved.
    let places: Vec<(usize, Vec2)> = track
        .observations
        .iter()
        .map(|&(frame, u, v, _)| (frame, Vec2::new(u, v) - Vec2::from(truth.shifts[frame])))
        .collect();
    let begin = places.iter().find(|(frame, _)| *frame == track.reference);
    let Some((point, normal)) = begin.and_then(|(frame, pixel)| seen[*frame].point(pixel)) else {
        return Judged { stands: true, ..Judged::default() };
    };
    let project = |frame: usize| project(&seen[frame].camera, &seen[frame].cam_from_head, &point);
    let mut judged = Judged::default();
    let mut right = vec![false; seen.len()];
    let mut ways: Vec<(Vec2, Vec2)> = Vec::with_capacity(places.len());
    for (frame, place) in &places {
        let Some(expected) = project(*frame) else { continue };
        ways.push((*place, expected));
        if *frame != track.reference {
            let turn = seen[track.reference].cam_from_head.angle_to(&seen[*frame].cam_from_head).to_degrees();
            let error = (place - expected).norm();
            right[*frame] = error <= BOUNDS_PX[1];
            judged.errors.push((error, turn));
        }
    }
    for (frame, right) in right.into_iter().enumerate() {
        if frame != track.reference && seen[frame].pixel(&point, &normal).is_some() {
            judged.shown += 1;
            judged.right += usize::from(right);
        }
    }
    judged.stands = stands(&ways);
    judged
}

fn project(camera: &Camera, cam_from_head: &Transform, point: &Vec3) -> Option<Vec2> {
    camera.project(&cam_from_head.apply(point))
}

/// Whether there is a time in which the places stay while the truth goes on.
fn stands(ways: &[(Vec2, Vec2)]) -> bool {
    ways.iter().enumerate().any(|(k, (place, expected))| {
        let still = ways[k..].iter().take_while(|(other, _)| (other - place).norm() <= STANDS_PX.0);
        still.into_iter().any(|(_, other)| (other - expected).norm() > STANDS_PX.1)
    })
}

fn percent(part: usize, whole: usize) -> f64 {
    100.0 * part as f64 / whole as f64
}

#[cfg(test)]
mod tests {
    use super::super::tracks::Frame;
    use super::*;
    use synthetic::{Random, head_from_turn};

    const FRAMES: usize = 31;
    const REFERENCE: usize = 15;

    fn camera() -> Camera {
        Camera::centred(352, 288, 615.0)
    }

    /// A film of the computed head that turns by a degree from frame to frame, moved by some pixels.
    fn truth() -> Truth {
        let pose = |i: usize| head_from_turn((i as f64 - 15.0).to_radians(), 0.02, 0.0, Vec3::zeros(), 0.75);
        Truth {
            what: String::new(),
            film: std::path::PathBuf::new(),
            cam_from_head: (0..FRAMES).map(pose).collect(),
            shifts: (0..FRAMES).map(|i| [(i % 5) as f64, -((i % 3) as f64)]).collect(),
        }
    }

    /// Tracks of points before the head's middle: true places wherever they are seen, and what `spoil` makes of them.
    fn tracks(body: &Body, truth: &Truth, mut spoil: impl FnMut(usize, usize, Vec2) -> Option<Vec2>) -> Tracks {
        let seen: Vec<Seen<'_>> = truth.cam_from_head.iter().map(|pose| Seen::new(body, camera(), *pose)).collect();
        let tracks = (0..40).map(|k| {
            let pixel = Vec2::new(150.0 + 6.0 * (k % 8) as f64 + 0.3, 120.0 + 7.0 * (k / 8) as f64 + 0.4);
            let (point, normal) = seen[REFERENCE].point(&pixel).unwrap();
            let observation = |i: usize| {
                let place = seen[i].pixel(&point, &normal)?;
                let place = if i == REFERENCE { Some(place) } else { spoil(k, i, place) }?;
                let filmed = place + Vec2::from(truth.shifts[i]);
                Some((i, filmed.x, filmed.y, 0.3))
            };
            Track { reference: REFERENCE, observations: (0..FRAMES).filter_map(observation).collect() }
        });
        let tracks = tracks.collect();
        Tracks { frames: (0..FRAMES).map(|i| Frame { used: i != 3 }).collect(), tracks }
    }

    fn judged(spoil: impl FnMut(usize, usize, Vec2) -> Option<Vec2>) -> Verdict {
        let (body, truth) = (crate::scenes::head::body(), truth());
        judge(&tracks(&body, &truth, spoil), &body, camera(), &truth).unwrap()
    }

    #[test]
    fn true_tracks_are_right_everywhere() {
        let verdict = judged(|_, _, place| Some(place));
        assert_eq!((verdict.tracks, verdict.standing, verdict.used), (40, 0, FRAMES - 1));
        assert_eq!(verdict.within, [100.0; 3]);
        assert!(verdict.found > 99.999 && verdict.median < 1e-6 && verdict.live > 30.0, "{verdict:?}");
        assert!(verdict.by_turn[0] < 1e-6 && verdict.by_turn[3].is_nan(), "no more than 15° from the reference");
    }

    #[test]
    fn noise_is_measured_as_what_it_is() {
        let mut random = Random::new(5);
        let verdict = judged(|_, _, place| Some(place + random.normal2(0.8)));
        // The median and the distribution of a length of two normal numbers (Rayleigh).
        let share = |bound: f64| 100.0 * (1.0 - (-bound * bound / (2.0 * 0.64)).exp());
        assert!((verdict.median - 0.8 * 1.1774).abs() < 0.06, "{verdict:?}");
        for (within, bound) in verdict.within.into_iter().zip(BOUNDS_PX) {
            assert!((within - share(bound)).abs() < 4.0, "{bound}: {within} instead of {}", share(bound));
        }
        assert_eq!(verdict.standing, 0);
    }

    #[test]
    fn drift_grows_with_the_turn() {
        let drift =
            |_: usize, i: usize, place: Vec2| Some(place + Vec2::new(0.2 * (i as f64 - REFERENCE as f64).abs(), 0.0));
        let [near, middle, ..] = judged(drift).by_turn;
        assert!((near - 1.2).abs() < 0.21 && (middle - 2.2).abs() < 0.21, "{near} {middle}");
    }

    #[test]
    fn what_is_left_out_lowers_what_is_found_and_not_what_is_right() {
        let verdict = judged(|_, i, place| (i % 2 == 0).then_some(place));
        assert_eq!(verdict.within, [100.0; 3]);
        assert!((verdict.found - 50.0).abs() < 5.0, "{verdict:?}");
    }

    #[test]
    fn tracks_that_stand_still_and_begin_beside_the_head_are_counted() {
        let (body, truth) = (crate::scenes::head::body(), truth());
        let mut stuck = Vec2::zeros();
        let spoil = |k: usize, i: usize, place: Vec2| {
            if k != 7 || i <= 20 {
                stuck = if k == 7 { place } else { stuck };
                return Some(place);
            }
            Some(stuck)
        };
        let mut tracks = tracks(&body, &truth, spoil);
        let beside = Track { reference: 2, observations: vec![(2, 3.0, 4.0, 0.3), (3, 3.0, 4.0, 0.3)] };
        tracks.tracks.push(beside);
        let verdict = judge(&tracks, &body, camera(), &truth).unwrap();
        assert_eq!(verdict.standing, 2, "{verdict:?}");
    }

    #[test]
    fn tracks_of_another_film_are_refused() {
        let (body, truth) = (crate::scenes::head::body(), truth());
        let mut other = tracks(&body, &truth, |_, _, place| Some(place));
        other.tracks[0].observations.push((FRAMES, 1.0, 1.0, 0.1));
        assert!(judge(&other, &body, camera(), &truth).is_err());
        other.frames.pop();
        assert!(judge(&other, &body, camera(), &truth).is_err());
    }
}
