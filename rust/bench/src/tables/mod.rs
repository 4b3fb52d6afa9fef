//! The paper's Tables 1 and 2: which share of 66 corners is matched rightly, by window and by rotation, before and after
//! the correction. `cargo x tables` runs it.
//!
//! The paper does not say how near to the truth a match has to be; here shares are given within [`TOLERANCES_PX`].
//! Every corner counts: one that was lost or rejected is matched wrongly.
//!
//! - Film: `../shared/data/james-cif` beside the project (352×288 as the paper's) where it is there, and always the
//!   project's own clip.
//! - Pairs: all of two frames, both ways, whose yaw differs by a range of the paper's and whose mean yaw is within
//!   [`FRONTAL_DEG`] of frontal.
//! - Corners: the [`CORNERS`] strongest of the first frame's face that the second frame shows too, see `inputs`.

mod inputs;
mod judge;
mod ours;
mod print;

pub use print::print;

use crate::feature::{Feature, Figure};
use crate::results::{Pixel, Run};
use geometry::{Camera, Transform};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Differences of yaw, degrees; the rows of the paper's tables.
const RANGES_DEG: [(f64, f64); 4] = [(5.0, 7.0), (10.0, 12.0), (15.0, 17.0), (20.0, 23.0)];
/// Sides of the tracker's window; the columns of the paper's tables.
const WINDOWS: [usize; 4] = [3, 5, 7, 9];
/// Table 1: before the correction, %.
const TABLE_1: [[f64; 4]; 4] =
    [[48.0, 75.0, 62.0, 40.0], [42.0, 60.0, 78.0, 55.0], [37.0, 71.0, 70.0, 45.0], [31.0, 44.0, 60.0, 52.0]];
/// Table 2: after it, %.
const TABLE_2: [[f64; 4]; 4] =
    [[78.0, 95.0, 92.0, 70.0], [62.0, 90.0, 98.0, 75.0], [67.0, 91.0, 90.0, 85.0], [51.0, 74.0, 80.0, 72.0]];
/// A match this near to the truth is right, pixels.
const TOLERANCES_PX: [f64; 3] = [1.0, 1.5, 3.0];
/// Corners of a pair.
const CORNERS: usize = 66;
/// A pair's mean yaw is at most this, degrees: the paper matches about frontal views.
const FRONTAL_DEG: f64 = 5.0;

/// The bench.
pub struct Tables;

/// Pairs of frames of one film.
#[derive(Serialize, Deserialize)]
pub struct Case {
    /// The film.
    name: String,
    /// Side of the tracker's window, pixels: one task each.
    windows: Vec<usize>,
    pictures: Vec<String>,
    pairs: Vec<Pair>,
}

/// Corners of one picture that are to be found in another.
#[derive(Serialize, Deserialize)]
struct Pair {
    a: usize,
    b: usize,
    points: Vec<Pixel>,
}

/// The surface that was filmed, and how.
#[derive(Serialize, Deserialize)]
pub struct CaseTruth {
    film: PathBuf,
    camera: Camera,
    frames: Vec<Frame>,
    /// Of each pair, which row of the tables it belongs to.
    ranges: Vec<usize>,
}

/// A frame that is used.
#[derive(Serialize, Deserialize)]
struct Frame {
    name: String,
    cam_from_head: Transform,
}

/// Where a side put each point of each pair; none where it gave the point up.
#[derive(Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Answer {
    matches: Vec<Vec<Option<Pixel>>>,
}

impl Feature for Tables {
    type Inputs = Vec<Case>;
    type Truth = Vec<CaseTruth>;
    type Answer = Answer;

    fn inputs(folder: &Path) -> anyhow::Result<(Vec<Case>, Vec<CaseTruth>)> {
        inputs::films(folder)
    }

    fn measure(inputs: &Vec<Case>, folder: &Path) -> anyhow::Result<Vec<Run<Answer>>> {
        let runs = inputs.iter().map(|case| ours::measure(case, folder)).collect::<anyhow::Result<Vec<_>>>()?;
        Ok(runs.into_iter().flatten().collect())
    }

    fn figures(run: &Run<Answer>, inputs: &Vec<Case>, truth: &Vec<CaseTruth>) -> anyhow::Result<Vec<Figure>> {
        let Some((case, truth)) = inputs.iter().zip(truth).find(|(case, _)| case.name == run.case) else {
            return Ok(Vec::new());
        };
        let rows = judge::Judge::new(case, truth)?.shares(run);
        let figure = |(row, shares): (&(f64, f64), &judge::Shares), k: usize| {
            Figure::gain(&format!("{}–{}°, within {} px, %", row.0, row.1, TOLERANCES_PX[k]), shares.all[k])
        };
        let rows = || RANGES_DEG.iter().zip(&rows);
        Ok(rows().flat_map(|row| (0..TOLERANCES_PX.len()).map(move |k| figure(row, k))).collect())
    }
}

/// Task of a window, before or after the correction.
fn task(window: usize, corrected: bool) -> String {
    format!("window {window}{}", if corrected { ", corrected" } else { "" })
}
