//! Bench of `bundle`: poses and points of a turning head from all its observations at once.

use crate::clock::{rms, timed};
use crate::feature::{Feature, Figure};
use crate::results::{Pixel, Run};
use crate::shape::errors_mm;
use geometry::least_squares::Loss;
use geometry::{Camera, Progress, Similarity, Transform, Vec2, Vec3};
use motion::bundle::{Bundle, BundleOptions, BundleReport, Observation, adjust};
use nalgebra::Rotation3;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use synthetic::{Random, Scene, SceneOptions};

/// Frames, points, and part of the frames in a row that see a point.
const CASES: [(usize, usize, f64); 4] = [(24, 66, 1.0), (120, 66, 1.0), (120, 500, 1.0), (120, 500, 1.0 / 3.0)];
/// Noise of each coordinate of an observation.
const SIGMA_PX: f64 = 0.3;
/// By how much the start is off: turn about and shift along each axis of the poses, shift of the points.
const START: (f64, f64, f64) = (0.01, 0.003, 0.003);
/// Limit of the robust losses, pixels, as every side counts it.
const LIMIT_PX: f64 = 1.0;

/// The bench.
pub struct BundleBench;

/// A bundle to adjust.
#[derive(Serialize, Deserialize)]
pub struct Case {
    name: String,
    camera: Camera,
    limit_px: f64,
    /// `cam_from_head`; the first is exact and stays.
    poses: Vec<Transform>,
    points: Vec<[f64; 3]>,
    /// Frame, point and pixel of each observation.
    observations: Vec<(usize, usize, Pixel)>,
}

/// An adjusted bundle.
#[derive(Serialize, Deserialize)]
pub struct Answer {
    /// Solved linear systems, whether their step was taken or not.
    steps: usize,
    poses: Vec<Transform>,
    points: Vec<[f64; 3]>,
}

impl Feature for BundleBench {
    type Inputs = Vec<Case>;
    /// True points of each case.
    type Truth = Vec<Vec<[f64; 3]>>;
    type Answer = Answer;

    fn inputs(_folder: &Path) -> anyhow::Result<(Self::Inputs, Self::Truth)> {
        Ok(CASES.iter().map(|&(frames, points, seen)| case(frames, points, seen)).unzip())
    }

    fn measure(inputs: &Self::Inputs, _folder: &Path) -> anyhow::Result<Vec<Run<Self::Answer>>> {
        let losses = ["squared", "huber", "cauchy"];
        inputs.iter().flat_map(|case| losses.map(|loss| measure(case, loss))).collect()
    }

    fn figures(run: &Run<Self::Answer>, inputs: &Self::Inputs, truth: &Self::Truth) -> anyhow::Result<Vec<Figure>> {
        let Some(k) = inputs.iter().position(|case| case.name == run.case) else { return Ok(Vec::new()) };
        let adjust = run.time("adjust");
        Ok(vec![
            Figure::cost("ms per step", adjust / run.answer.steps as f64),
            Figure::cost("steps", run.answer.steps as f64),
            Figure::cost("ms", adjust),
            Figure::cost("cost at the end, px²", cost(&inputs[k], loss(&run.task)?, &run.answer)),
            Figure::cost("error of points, mm", shape_error_mm(&run.answer.points, &truth[k])?),
        ])
    }
}

fn case(frames: usize, points: usize, seen: f64) -> (Case, Vec<[f64; 3]>) {
    let scene = Scene::turning_head(&SceneOptions {
        frames,
        points,
        noise_px: SIGMA_PX,
        min_facing: -1.0,
        ..SceneOptions::default()
    });
    let mut random = Random::new(7);
    let mut step = |size: f64| Vec3::new(random.normal(), random.normal(), random.normal()) * size;
    let (turn, shift, off) = START;
    let nudged = |(i, pose): (usize, &Transform)| match i {
        0 => *pose,
        _ => Transform::new(Rotation3::new(step(turn)) * pose.rotation, pose.translation + step(shift)),
    };
    let poses = scene.cam_from_head.iter().enumerate().map(nudged).collect();
    let starts = scene.points.iter().map(|p| (p + step(off)).into()).collect();
    let span = (seen * frames as f64).round() as usize;
    let is_seen = |frame: usize, point: usize| {
        let first = (frames - span) * point / points;
        (first..first + span).contains(&frame)
    };
    let kept = scene.observations.iter().filter(|o| is_seen(o.frame, o.point));
    let part = if seen < 1.0 { ", a third of the frames each" } else { "" };
    let case = Case {
        name: format!("{frames} frames, {points} points{part}"),
        camera: scene.camera,
        limit_px: LIMIT_PX,
        poses,
        points: starts,
        observations: kept.map(|o| (o.frame, o.point, [o.pixel.x, o.pixel.y])).collect(),
    };
    (case, scene.points.iter().map(|p| (*p).into()).collect())
}

fn loss(task: &str) -> anyhow::Result<Loss> {
    match task {
        "squared" => Ok(Loss::Squared),
        "huber" => Ok(Loss::Huber(LIMIT_PX)),
        "cauchy" => Ok(Loss::Cauchy(LIMIT_PX)),
        _ => anyhow::bail!("{task} is no loss"),
    }
}

fn bundle(case: &Case) -> Bundle {
    // Residuals in pixels: the peer's losses know no standard deviation.
    let observation = |&(frame, point, pixel): &(usize, usize, Pixel)| Observation {
        frame,
        point,
        pixel: Vec2::from(pixel),
        sigma_px: 1.0,
    };
    Bundle {
        camera: case.camera,
        poses: case.poses.clone(),
        points: case.points.iter().map(|p| Vec3::from(*p)).collect(),
        observations: case.observations.iter().map(observation).collect(),
    }
}

fn measure(case: &Case, task: &str) -> anyhow::Result<Run<Answer>> {
    let options = BundleOptions { loss: loss(task)?, ..BundleOptions::default() };
    let start = bundle(case);
    let solve = || -> Result<(Bundle, BundleReport), motion::MotionError> {
        let mut bundle = start.clone();
        let report = adjust(&mut bundle, &options, &Progress::new())?;
        Ok((bundle, report))
    };
    let (adjust_ms, solved) = timed(solve);
    let (found, report) = solved?;
    let answer = Answer {
        steps: report.iterations + report.rejected_steps,
        poses: found.poses,
        points: found.points.iter().map(|p| (*p).into()).collect(),
    };
    let times_ms = BTreeMap::from([("adjust".to_owned(), adjust_ms)]);
    Ok(Run { case: case.name.clone(), task: task.to_owned(), setting: String::new(), times_ms, answer })
}

/// The sum of all losses at an answer, computed one observation after the other.
fn cost(case: &Case, loss: Loss, answer: &Answer) -> f64 {
    let squared = |(frame, point, pixel): &(usize, usize, Pixel)| {
        let in_cam = answer.poses[*frame].apply(&Vec3::from(answer.points[*point]));
        case.camera.project(&in_cam).map_or(f64::INFINITY, |seen| (seen - Vec2::from(*pixel)).norm_squared())
    };
    case.observations.iter().map(|o| loss.evaluate(squared(o)).0).sum()
}

/// Root mean square distance from the true points after the best similarity, millimetres.
fn shape_error_mm(points: &[[f64; 3]], truth: &[[f64; 3]]) -> anyhow::Result<f64> {
    let places = |points: &[[f64; 3]]| points.iter().map(|p| Vec3::from(*p)).collect::<Vec<_>>();
    let (points, truth) = (places(points), places(truth));
    let fit = Similarity::fit(&points, &truth, None, true).ok_or_else(|| anyhow::anyhow!("no similarity"))?;
    Ok(rms(&errors_mm(&fit, &points, &truth)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_is_seen_by_as_many_frames_as_its_case_says() {
        for (frames, points, seen) in CASES {
            let (case, truth) = case(frames, points, seen);
            let expected = points as f64 * seen * frames as f64;
            // Some leave the picture.
            let found = case.observations.len() as f64;
            assert!(truth.len() == points && found <= expected + 1.0 && found > 0.9 * expected, "{}", case.name);
        }
    }
}
