//! Bench of `track`: pyramids, corners, and Lucas–Kanade with the pyramids it needs.

mod inputs;
mod judge;
mod ours;

use crate::feature::{Feature, Figure};
use crate::results::{Pixel, Run};
use geometry::{Camera, Transform};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Task of building pyramids.
const PYRAMIDS: &str = "pyramids";
/// Task of finding corners; the other tasks are trackers of a window's size.
const CORNERS: &str = "corners";

/// The bench.
pub struct Track;

/// Pairs of frames of one film.
#[derive(Serialize, Deserialize)]
pub struct Case {
    name: String,
    pictures: Vec<String>,
    /// Pictures that are white where the face is.
    masks: Vec<String>,
    /// At most so many corners are asked for.
    corners: usize,
    /// Least distance between two corners, pixels.
    min_distance: f64,
    /// Least score of a corner relative to the strongest.
    quality: f64,
    pairs: Vec<Pair>,
}

/// Points of one picture that are to be found in another.
#[derive(Serialize, Deserialize)]
struct Pair {
    a: usize,
    b: usize,
    points: Vec<Pixel>,
}

/// The surface that was filmed, and how.
#[derive(Serialize, Deserialize)]
pub struct CaseTruth {
    film: Film,
    camera: Camera,
    cam_from_head: Vec<Transform>,
}

/// What was filmed.
#[derive(Clone, Copy, Serialize, Deserialize)]
enum Film {
    /// The project's clip.
    Clip,
    /// The synthetic head.
    Computed,
}

/// What a side found: corners of each picture, or each point of each pair; none where it gave the point up.
#[derive(Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Answer {
    corners: Vec<Vec<Pixel>>,
    tracks: Vec<Vec<Option<Pixel>>>,
}

impl Feature for Track {
    type Inputs = Vec<Case>;
    type Truth = Vec<CaseTruth>;
    type Answer = Answer;

    fn inputs(folder: &Path) -> anyhow::Result<(Vec<Case>, Vec<CaseTruth>)> {
        Ok([inputs::clip(folder)?, inputs::computed(folder)?].into_iter().unzip())
    }

    fn measure(inputs: &Vec<Case>, folder: &Path) -> anyhow::Result<Vec<Run<Answer>>> {
        let runs = inputs.iter().map(|case| ours::measure(case, folder)).collect::<anyhow::Result<Vec<_>>>()?;
        Ok(runs.into_iter().flatten().collect())
    }

    fn figures(run: &Run<Answer>, inputs: &Vec<Case>, truth: &Vec<CaseTruth>) -> anyhow::Result<Vec<Figure>> {
        match inputs.iter().zip(truth).find(|(case, _)| case.name == run.case) {
            Some(_) if run.task == PYRAMIDS => Ok(judge::pyramids(run)),
            Some((case, truth)) if run.task == CORNERS => judge::corners(run, case, truth),
            Some((case, truth)) => judge::tracks(run, case, truth),
            None => Ok(Vec::new()),
        }
    }
}
