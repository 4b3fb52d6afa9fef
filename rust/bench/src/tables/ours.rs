//! Our matches, as `facewright match --method paper` makes them.

use super::{Answer, Case, Pair, task};
use crate::clock::median_ms;
use crate::files::read_grey;
use crate::results::{Pixel, Run, to_points};
use geometry::Vec2;
use std::collections::BTreeMap;
use std::path::Path;
use vision::correct::{Correction, LocalAdjustmentOptions, Match, local_adjustment};
use vision::pyramid::Pyramid;
use vision::track::{Status, Track, TrackOptions, track};

/// Every window, before and after the correction.
pub(super) fn measure(case: &Case, folder: &Path) -> anyhow::Result<Vec<Run<Answer>>> {
    let levels = TrackOptions::paper(3).levels;
    let pyramid = |file: &String| Ok(Pyramid::new(&read_grey(&folder.join(file))?, levels));
    let pyramids = case.pictures.iter().map(pyramid).collect::<anyhow::Result<Vec<_>>>()?;
    let mut runs = Vec::new();
    for &window in &case.windows {
        let matched = |pair: &Pair| tracked(&pyramids, pair, window);
        let matches = case.pairs.iter().map(matched).collect::<anyhow::Result<Vec<_>>>()?;
        let options = LocalAdjustmentOptions { window, ..LocalAdjustmentOptions::default() };
        let corrected = || -> anyhow::Result<Vec<_>> {
            let adjusted = |(pair, matches): (&Pair, &Vec<Match>)| {
                local_adjustment(&pyramids[pair.a], &pyramids[pair.b], matches, &options)
            };
            Ok(case.pairs.iter().zip(&matches).map(adjusted).collect::<Result<_, _>>()?)
        };
        let usable = |correction: &Correction| {
            let found = correction.matches.iter().zip(&correction.outcomes);
            found.map(|(m, outcome)| outcome.is_usable().then_some([m.b.x, m.b.y])).collect()
        };
        let after = corrected()?.iter().map(usable).collect();
        let times_ms = BTreeMap::from([("correct".to_owned(), median_ms(corrected) / case.pairs.len() as f64)]);
        let found = |m: &Match| -> Option<Pixel> { m.b.x.is_finite().then_some([m.b.x, m.b.y]) };
        let before = matches.iter().map(|matches| matches.iter().map(found).collect()).collect();
        runs.push(run(case, task(window, false), BTreeMap::new(), before));
        runs.push(run(case, task(window, true), times_ms, after));
    }
    Ok(runs)
}

fn tracked(pyramids: &[Pyramid], pair: &Pair, window: usize) -> anyhow::Result<Vec<Match>> {
    let points: Vec<Vec2> = to_points(&pair.points);
    let tracks = track(&pyramids[pair.a], &pyramids[pair.b], &points, None, &TrackOptions::paper(window))?;
    let found = |(a, track): (&Vec2, &Track)| match track.status {
        Status::Found => Match { a: *a, b: track.position },
        _ => Match::missing(*a),
    };
    Ok(points.iter().zip(&tracks).map(found).collect())
}

fn run(case: &Case, task: String, times_ms: BTreeMap<String, f64>, matches: Vec<Vec<Option<Pixel>>>) -> Run<Answer> {
    Run { case: case.name.clone(), task, setting: String::new(), times_ms, answer: Answer { matches } }
}
