//! How good corners and tracks are.

use super::{Answer, Case, CaseTruth};
use crate::clock::median;
use crate::feature::Figure;
use crate::results::{Pixel, Run, to_points};
use crate::scenes::seen::{Body, Seen};
use geometry::Vec2;

/// A corner found again this near is repeated, a track this near is right, pixels.
const NEAR_PX: f64 = 1.0;

/// Times of building.
pub(super) fn pyramids(run: &Run<Answer>) -> Vec<Figure> {
    vec![Figure::cost("ms for two pictures", run.time("build"))]
}

/// Times of the detector, and how many corners of one frame are corners of the next one.
pub(super) fn corners(run: &Run<Answer>, case: &Case, truth: &CaseTruth) -> anyhow::Result<Vec<Figure>> {
    let body = truth.film.body()?;
    let frames = frames(&body, truth);
    let (mut repeated, mut seen) = (0, 0);
    for pair in &case.pairs {
        let [in_a, in_b] = [pair.a, pair.b].map(|i| to_points(&run.answer.corners[i]));
        for carried in in_a.iter().filter_map(|p| frames[pair.a].carried(p, &frames[pair.b])) {
            seen += 1;
            repeated += usize::from(in_b.iter().any(|p| (p - carried).norm() < NEAR_PX));
        }
    }
    let found: usize = run.answer.corners.iter().map(Vec::len).sum();
    Ok(vec![
        Figure::cost("ms per picture", run.time("find")),
        Figure::gain("corners per picture", found as f64 / run.answer.corners.len() as f64),
        Figure::gain("found again within 1 px, %", percent(repeated, seen)),
    ])
}

/// Times of the tracker, and how near its points are to the truth.
pub(super) fn tracks(run: &Run<Answer>, case: &Case, truth: &CaseTruth) -> anyhow::Result<Vec<Figure>> {
    let body = truth.film.body()?;
    let frames = frames(&body, truth);
    let mut errors = Vec::new();
    for (pair, found) in case.pairs.iter().zip(&run.answer.tracks) {
        let truth = |p: &Vec2| frames[pair.a].carried(p, &frames[pair.b]);
        let error = |(p, q): (&Vec2, &Option<Pixel>)| Some((truth(p)? - Vec2::from((*q)?)).norm());
        errors.extend(to_points(&pair.points).iter().zip(found).filter_map(error));
    }
    let points: usize = case.pairs.iter().map(|pair| pair.points.len()).sum();
    let right = errors.iter().filter(|e| **e < NEAR_PX).count();
    let (call, one) = (run.time("call"), run.time("call_with_one_point"));
    let per_call = points as f64 / case.pairs.len() as f64;
    Ok(vec![
        Figure::cost("ms per call", call),
        Figure::cost("ms per call with one point", one),
        Figure::cost("µs per point of a call", 1e3 * call / per_call),
        Figure::cost("µs per further point", 1e3 * (call - one) / (per_call - 1.0)),
        Figure::gain("within 1 px of all points, %", percent(right, points)),
        Figure::gain("within 1 px of points kept, %", percent(right, errors.len())),
        Figure::cost("median error, px", median(errors)),
    ])
}

fn frames<'b>(body: &'b Body, truth: &CaseTruth) -> Vec<Seen<'b>> {
    truth.cam_from_head.iter().map(|pose| Seen::new(body, truth.camera, *pose)).collect()
}

fn percent(part: usize, whole: usize) -> f64 {
    100.0 * part as f64 / whole as f64
}
