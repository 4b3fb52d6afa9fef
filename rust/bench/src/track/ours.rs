//! Our times and answers.

use super::{Answer, CORNERS, Case, PYRAMIDS, Pair};
use crate::clock::median_ms;
use crate::files::read_grey;
use crate::results::{Pixel, Run, to_points};
use geometry::Vec2;
use image::GrayImage;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use vision::corners::{CornerOptions, Spread, detect};
use vision::pyramid::Pyramid;
use vision::track::{Status, Track, TrackOptions, track};

/// Pixels of the window of the corners' gradient matrix.
const CORNER_WINDOW: usize = 5;
/// Levels of a pyramid.
const LEVELS: usize = 4;

/// Trackers of the same window on every side; the last one is checked by tracking back.
fn trackers() -> [(&'static str, TrackOptions); 4] {
    let checked = TrackOptions { window: 11, forward_backward_px: Some(0.5), ..TrackOptions::default() };
    [
        ("window 7", TrackOptions::paper(7)),
        ("window 15", TrackOptions::paper(15)),
        ("window 21", TrackOptions::paper(21)),
        ("window 11, checked", checked),
    ]
}

/// All tasks of a case.
pub(super) fn measure(case: &Case, folder: &Path) -> anyhow::Result<Vec<Run<Answer>>> {
    let read = |file: &String| Ok(Arc::new(read_grey(&folder.join(file))?));
    let read_all = |files: &[String]| files.iter().map(read).collect::<anyhow::Result<Vec<_>>>();
    let (pictures, masks) = (read_all(&case.pictures)?, read_all(&case.masks)?);
    let mut runs = vec![pyramids(case, &pictures), corners(case, &pictures, &masks)?];
    for (task, options) in trackers() {
        runs.push(tracks(case, &pictures, task, &TrackOptions { levels: LEVELS, ..options })?);
    }
    Ok(runs)
}

/// Both pyramids of every pair.
fn pyramids(case: &Case, pictures: &[Arc<GrayImage>]) -> Run<Answer> {
    let build = |pair: &Pair| [pair.a, pair.b].map(|i| Pyramid::sharing(pictures[i].clone(), LEVELS));
    let build_all = || {
        for pair in &case.pairs {
            std::hint::black_box(build(pair));
        }
    };
    let times_ms = BTreeMap::from([("build".to_owned(), median_ms(build_all) / case.pairs.len() as f64)]);
    run(case, PYRAMIDS, times_ms, Answer::default())
}

fn corners(case: &Case, pictures: &[Arc<GrayImage>], masks: &[Arc<GrayImage>]) -> anyhow::Result<Run<Answer>> {
    let options = CornerOptions {
        max_count: case.corners,
        window: CORNER_WINDOW,
        quality: case.quality,
        min_distance: case.min_distance,
        spread: Spread::Strongest,
        ..CornerOptions::default()
    };
    let find = |(picture, mask): (&Arc<GrayImage>, &Arc<GrayImage>)| -> anyhow::Result<Vec<Pixel>> {
        let found = detect(&Pyramid::sharing(picture.clone(), 1), Some(mask), &options)?;
        Ok(found.iter().map(|corner| [corner.position.x, corner.position.y]).collect())
    };
    let find_all = || pictures.iter().zip(masks).map(find).collect::<anyhow::Result<Vec<_>>>();
    let times_ms = BTreeMap::from([("find".to_owned(), median_ms(find_all) / pictures.len() as f64)]);
    let answer = Answer { corners: find_all()?, ..Answer::default() };
    Ok(run(case, CORNERS, times_ms, answer))
}

/// Each call builds both pyramids, as the peer's does; a call with one point tells what they cost.
fn tracks(case: &Case, pictures: &[Arc<GrayImage>], task: &str, options: &TrackOptions) -> anyhow::Result<Run<Answer>> {
    let call = |pair: &Pair, points: &[Vec2]| -> anyhow::Result<Vec<Option<Pixel>>> {
        let [a, b] = [pair.a, pair.b].map(|i| Pyramid::sharing(pictures[i].clone(), options.levels));
        let found = |track: &Track| (track.status == Status::Found).then_some([track.position.x, track.position.y]);
        Ok(track(&a, &b, points, None, options)?.iter().map(found).collect())
    };
    let points: Vec<Vec<Vec2>> = case.pairs.iter().map(|pair| to_points(&pair.points)).collect();
    let calls = |count: usize| -> anyhow::Result<Vec<_>> {
        case.pairs.iter().zip(&points).map(|(pair, points)| call(pair, &points[..count.min(points.len())])).collect()
    };
    let per_pair = 1.0 / case.pairs.len() as f64;
    let times_ms = BTreeMap::from([
        ("call".to_owned(), median_ms(|| calls(usize::MAX)) * per_pair),
        ("call_with_one_point".to_owned(), median_ms(|| calls(1)) * per_pair),
    ]);
    let answer = Answer { tracks: calls(usize::MAX)?, ..Answer::default() };
    Ok(run(case, task, times_ms, answer))
}

fn run(case: &Case, task: &str, times_ms: BTreeMap<String, f64>, answer: Answer) -> Run<Answer> {
    Run { case: case.name.clone(), task: task.to_owned(), setting: String::new(), times_ms, answer }
}
