//! What both sides write.

use crate::clock::median;
use geometry::Vec2;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A position in a picture, as it stands in files.
pub type Pixel = [f64; 2];

/// Positions as they stand in files.
pub fn to_pixels<'p>(points: impl IntoIterator<Item = &'p Vec2>) -> Vec<Pixel> {
    points.into_iter().map(|p| [p.x, p.y]).collect()
}

/// Positions out of a file.
pub fn to_points(pixels: &[Pixel]) -> Vec<Vec2> {
    pixels.iter().map(|p| Vec2::new(p[0], p[1])).collect()
}

/// One side's runs.
#[derive(Serialize, Deserialize)]
pub struct Results<A> {
    /// Name and version.
    pub program: String,
    /// One per case, task and setting.
    pub runs: Vec<Run<A>>,
}

/// One task on one case.
#[derive(Serialize, Deserialize)]
pub struct Run<A> {
    /// Which input.
    pub case: String,
    /// What was to be done; runs of the same case and task are compared.
    pub task: String,
    /// How it was done.
    pub setting: String,
    /// Processor time of each part, milliseconds.
    pub times_ms: BTreeMap<String, f64>,
    /// What came out.
    pub answer: A,
}

impl<A> Run<A> {
    fn name(&self) -> [&str; 3] {
        [&self.case, &self.task, &self.setting]
    }

    /// A time, or not a number where it was not taken.
    pub fn time(&self, part: &str) -> f64 {
        self.times_ms.get(part).copied().unwrap_or(f64::NAN)
    }
}

/// The turns of each run in one: the median of each time, the first turn's answer (every turn gives the same).
pub fn merged<A>(turns: Vec<Results<A>>) -> Vec<(String, Run<A>)> {
    let mut groups: Vec<(String, Vec<Run<A>>)> = Vec::new();
    for results in turns {
        for run in results.runs {
            let same = |(program, group): &&mut (String, Vec<Run<A>>)| {
                *program == results.program && group[0].name() == run.name()
            };
            match groups.iter_mut().find(same) {
                Some((_, group)) => group.push(run),
                None => groups.push((results.program.clone(), vec![run])),
            }
        }
    }
    groups.into_iter().filter_map(|(program, group)| Some((program, with_median_times(group)?))).collect()
}

fn with_median_times<A>(mut turns: Vec<Run<A>>) -> Option<Run<A>> {
    let parts: Vec<String> = turns.first()?.times_ms.keys().cloned().collect();
    let times_ms = parts.into_iter().map(|part| {
        let middle = median(turns.iter().map(|turn| turn.time(&part)).collect());
        (part, middle)
    });
    let times_ms = times_ms.collect();
    Some(Run { times_ms, ..turns.swap_remove(0) })
}
