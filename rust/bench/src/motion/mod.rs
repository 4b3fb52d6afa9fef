//! Bench of `motion`: the motion between two frames when some of the matches are wrong.

use crate::clock::{median, median_ms};
use crate::feature::{Feature, Figure};
use crate::results::{Pixel, Run};
use geometry::{Camera, Transform, Vec2};
use motion::two_view::{TwoViewOptions, robust};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use synthetic::{Scene, SceneOptions};

/// Turn (degrees), points and share of wrong matches of each case.
const CASES: [(f64, usize, f64); 5] =
    [(10.0, 66, 0.0), (10.0, 66, 0.2), (10.0, 66, 0.4), (10.0, 500, 0.3), (20.0, 66, 0.2)];
/// Scenes of each case.
const TRIALS: u64 = 20;
/// Distance of a right match from its epipolar line at most, for every side.
const THRESHOLD_PX: f64 = 1.0;

/// The bench.
pub struct Motion;

/// Matches of one head between two frames.
#[derive(Serialize, Deserialize)]
pub struct Matches {
    a: Vec<Pixel>,
    b: Vec<Pixel>,
}

/// Scenes of one kind.
#[derive(Serialize, Deserialize)]
pub struct Case {
    name: String,
    camera: Camera,
    threshold_px: f64,
    trials: Vec<Matches>,
}

impl Feature for Motion {
    type Inputs = Vec<Case>;
    /// True motions of each case.
    type Truth = Vec<Vec<Transform>>;
    /// The motion of each trial; none where it was given up.
    type Answer = Vec<Option<Transform>>;

    fn inputs(_folder: &Path) -> anyhow::Result<(Self::Inputs, Self::Truth)> {
        Ok(CASES.iter().map(|&(turn, points, wrong)| case(turn, points, wrong)).unzip())
    }

    fn measure(inputs: &Self::Inputs, _folder: &Path) -> anyhow::Result<Vec<Run<Self::Answer>>> {
        Ok(inputs.iter().map(measure).collect())
    }

    fn figures(run: &Run<Self::Answer>, inputs: &Self::Inputs, truth: &Self::Truth) -> anyhow::Result<Vec<Figure>> {
        let Some(k) = inputs.iter().position(|case| case.name == run.case) else { return Ok(Vec::new()) };
        let errors = |error: fn(&Transform, &Transform) -> f64| {
            let of_trial = |(found, truth): (&Option<Transform>, &Transform)| {
                found.as_ref().map_or(180.0, |found| error(found, truth).to_degrees())
            };
            median(run.answer.iter().zip(&truth[k]).map(of_trial).collect())
        };
        Ok(vec![
            Figure::cost("ms per pair", run.time("solve")),
            Figure::cost("rotation error, degrees", errors(Transform::angle_to)),
            Figure::cost("direction error, degrees", errors(|a, b| a.translation.angle(&b.translation))),
        ])
    }
}

fn case(turn_deg: f64, points: usize, wrong: f64) -> (Case, Vec<Transform>) {
    let scenes: Vec<Scene> = (0..TRIALS).map(|seed| scene(turn_deg, points, wrong, seed)).collect();
    let name = format!("{turn_deg} degrees, {points} points, {:.0} % wrong", 100.0 * wrong);
    let trials = scenes.iter().map(|scene| matches(scene, points)).collect();
    let truth = scenes.iter().map(|scene| scene.b_from_a(0, 1)).collect();
    (Case { name, camera: SceneOptions::default().camera, threshold_px: THRESHOLD_PX, trials }, truth)
}

fn scene(turn_deg: f64, points: usize, wrong: f64, seed: u64) -> Scene {
    Scene::turning_head(&SceneOptions {
        yaw_deg: (-0.5 * turn_deg, 0.5 * turn_deg),
        frames: 2,
        // Those that both frames see are taken from a larger number.
        points: points * 4,
        min_facing: 0.3,
        // A match is wrong when either of its ends is.
        outliers: 1.0 - (1.0 - wrong).sqrt(),
        seed,
        ..SceneOptions::default()
    })
}

fn matches(scene: &Scene, points: usize) -> Matches {
    let (a, b) = scene.matches(0, 1).into_iter().take(points).map(|(_, a, b, _)| ([a.x, a.y], [b.x, b.y])).unzip();
    Matches { a, b }
}

fn measure(case: &Case) -> Run<Vec<Option<Transform>>> {
    let options = TwoViewOptions { threshold: case.threshold_px / case.camera.fx, ..TwoViewOptions::default() };
    let solve = |matches: &Matches| {
        let ray = |p: &Pixel| case.camera.normalise(&Vec2::new(p[0], p[1]));
        let normalised = |pixels: &[Pixel]| pixels.iter().map(ray).collect::<Vec<Vec2>>();
        robust(&normalised(&matches.a), &normalised(&matches.b), &options).ok().map(|found| found.b_from_a)
    };
    let solve_all = || case.trials.iter().map(solve).collect::<Vec<_>>();
    let times_ms = BTreeMap::from([("solve".to_owned(), median_ms(solve_all) / case.trials.len() as f64)]);
    let (name, task) = (case.name.clone(), "robust motion".to_owned());
    Run { case: name, task, setting: String::new(), times_ms, answer: solve_all() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_case_has_the_points_it_names() {
        for (turn, points, wrong) in CASES {
            let (case, truth) = case(turn, points, wrong);
            assert!(case.trials.iter().all(|m| m.a.len() == points && m.b.len() == points), "{}", case.name);
            assert!(truth.iter().all(|t| (t.angle_to(&Transform::identity()).to_degrees() - turn).abs() < 3.0));
            assert!(truth.iter().all(|t| t.translation.norm() > 0.0));
        }
    }
}
