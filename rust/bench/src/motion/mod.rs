//! Bench of `motion`: the motion between two frames when some of the matches are wrong.

mod cases;

use crate::clock::{median, timed};
use crate::feature::{Feature, Figure};
use crate::results::{Pixel, Run};
use geometry::{Camera, Transform, Vec2};
use motion::MotionError;
use motion::two_view::{RoughTurn, TwoView, TwoViewOptions, paper, robust};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// A trial whose rotation is off by less has found the motion and not its mirror.
const FOUND_DEG: f64 = 5.0;

/// The bench.
pub struct Motion;

/// Matches of one head between two frames.
#[derive(Serialize, Deserialize)]
pub struct Matches {
    a: Vec<Pixel>,
    b: Vec<Pixel>,
    /// The turn as landmarks might tell it; the translation is nothing. Only one of our ways reads it.
    rough_turn: Transform,
}

/// Scenes of one kind.
#[derive(Serialize, Deserialize)]
pub struct Case {
    name: String,
    camera: Camera,
    threshold_px: f64,
    /// Deviation of the rough turns about each axis.
    rough_turn_sigma_rad: f64,
    trials: Vec<Matches>,
}

impl Feature for Motion {
    type Inputs = Vec<Case>;
    /// True motions of each case.
    type Truth = Vec<Vec<Transform>>;
    type Answer = Answer;

    fn inputs(_folder: &Path) -> anyhow::Result<(Self::Inputs, Self::Truth)> {
        Ok(cases::KINDS.iter().map(|kind| kind.case()).unzip())
    }

    fn measure(inputs: &Self::Inputs, _folder: &Path) -> anyhow::Result<Vec<Run<Self::Answer>>> {
        Ok(inputs.iter().flat_map(measure).collect())
    }

    fn figures(run: &Run<Self::Answer>, inputs: &Self::Inputs, truth: &Self::Truth) -> anyhow::Result<Vec<Figure>> {
        let Some(k) = inputs.iter().position(|case| case.name == run.case) else { return Ok(Vec::new()) };
        let errors = |error: fn(&Transform, &Transform) -> f64| -> Vec<f64> {
            let of_trial = |(found, truth): (&Option<Transform>, &Transform)| {
                found.as_ref().map_or(180.0, |found| error(found, truth).to_degrees())
            };
            run.answer.iter().zip(&truth[k]).map(of_trial).collect()
        };
        let turns = errors(Transform::angle_to);
        let found = turns.iter().filter(|error| **error < FOUND_DEG).count() as f64 / turns.len() as f64;
        Ok(vec![
            Figure::cost("ms per pair", run.time("solve")),
            Figure::cost("rotation error, degrees", median(turns)),
            Figure::cost("direction error, degrees", median(errors(|a, b| a.translation.angle(&b.translation)))),
            Figure::gain("rotation within 5 degrees, %", 100.0 * found),
        ])
    }
}

/// The motion of each trial; none where it was given up.
type Answer = Vec<Option<Transform>>;

/// Our ways: the robust one, the paper's, and the robust one that is told the turn roughly, which no peer is.
fn measure(case: &Case) -> [Run<Answer>; 3] {
    let options = TwoViewOptions { threshold: case.threshold_px / case.camera.fx, ..TwoViewOptions::default() };
    let told = |matches: &Matches| {
        let rough = RoughTurn { b_from_a: matches.rough_turn.rotation, sigma_rad: case.rough_turn_sigma_rad };
        TwoViewOptions { rough_turn: Some(rough), ..options.clone() }
    };
    [
        run(case, "", |_, a, b| robust(a, b, &options)),
        run(case, "the paper's method", |_, a, b| paper(a, b)),
        run(case, "told the turn to 2 degrees", |matches, a, b| robust(a, b, &told(matches))),
    ]
}

fn run(
    case: &Case,
    setting: &str,
    solve: impl Fn(&Matches, &[Vec2], &[Vec2]) -> Result<TwoView, MotionError>,
) -> Run<Answer> {
    let solve = |matches: &Matches| {
        let ray = |p: &Pixel| case.camera.normalise(&Vec2::new(p[0], p[1]));
        let normalised = |pixels: &[Pixel]| pixels.iter().map(ray).collect::<Vec<Vec2>>();
        solve(matches, &normalised(&matches.a), &normalised(&matches.b)).ok().map(|found| found.b_from_a)
    };
    let solve_all = || case.trials.iter().map(solve).collect::<Answer>();
    let (all_ms, answer) = timed(solve_all);
    let times_ms = BTreeMap::from([("solve".to_owned(), all_ms / case.trials.len() as f64)]);
    let (name, task) = (case.name.clone(), "robust motion".to_owned());
    Run { case: name, task, setting: setting.to_owned(), times_ms, answer }
}
