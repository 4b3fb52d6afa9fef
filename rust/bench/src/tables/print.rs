//! The tables, side by side with the paper's and the peers', as text and as JSON.

use super::judge::{Judge, Shares};
use super::{
    Answer, CORNERS, Case, CaseTruth, FRONTAL_DEG, RANGES_DEG, TABLE_1, TABLE_2, TOLERANCES_PX, WINDOWS, task,
};
use crate::files;
use crate::results::{Results, Run, merged};
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Ours before the correction may be below a peer's by so much, points.
const LEVEL: f64 = 1.0;
/// The tolerance at which ours is held against the paper's.
const PAPER_TOLERANCE: usize = TOLERANCES_PX.len() - 1;
/// What must be said of the figures.
const NOTE: &str = "The paper does not say how near to the truth a match has to be, so its figures are the same at each \
    tolerance. All corners count: a lost or rejected one is wrong; \"kept\" is the share among those that are neither.";

/// One side's figures of one film, a row per range and a column per window.
#[derive(Serialize)]
struct Side {
    program: String,
    corrected: bool,
    shares: Vec<Vec<Shares>>,
}

/// All sides on one film.
#[derive(Serialize)]
struct Film<'t> {
    film: &'t str,
    folder: &'t Path,
    pairs: Vec<usize>,
    points: Vec<usize>,
    sides: Vec<Side>,
}

/// What is written as JSON; ranges in degrees, shares in %.
#[derive(Serialize)]
struct Report<'t> {
    note: &'t str,
    ranges_deg: [(f64, f64); 4],
    mean_yaw_within_deg: f64,
    windows: [usize; 4],
    tolerances_px: [f64; 3],
    paper_table_1: [[f64; 4]; 4],
    paper_table_2: [[f64; 4]; 4],
    films: Vec<Film<'t>>,
}

/// Judges all results, prints the tables and writes them to `tables.json` in the folder.
pub fn print(folder: &Path, results: &[PathBuf]) -> anyhow::Result<()> {
    let inputs: Vec<Case> = files::read_json(&folder.join("inputs.json"))?;
    let truth: Vec<CaseTruth> = files::read_json(&folder.join("truth.json"))?;
    let results =
        results.iter().map(|path| files::read_json(path)).collect::<anyhow::Result<Vec<Results<Answer>>>>()?;
    let runs = merged(results);
    let films = inputs.iter().zip(&truth).map(|(case, truth)| film(case, truth, &runs));
    let report = Report {
        note: NOTE,
        ranges_deg: RANGES_DEG,
        mean_yaw_within_deg: FRONTAL_DEG,
        windows: WINDOWS,
        tolerances_px: TOLERANCES_PX,
        paper_table_1: TABLE_1,
        paper_table_2: TABLE_2,
        films: films.collect::<anyhow::Result<Vec<_>>>()?,
    };
    files::write_json(&folder.join("tables.json"), &report)?;
    let mut out = std::io::stdout().lock();
    writeln!(out, "{NOTE}")?;
    report.films.iter().try_for_each(|film| film.write(&mut out))
}

fn film<'t>(case: &'t Case, truth: &'t CaseTruth, runs: &[(String, Run<Answer>)]) -> anyhow::Result<Film<'t>> {
    let judge = Judge::new(case, truth)?;
    let of_range = |range: usize| {
        let pairs = case.pairs.iter().zip(&truth.ranges).filter(move |(_, r)| **r == range);
        pairs.map(|(pair, _)| pair.points.len())
    };
    let mut programs: Vec<&str> = runs.iter().map(|(program, _)| program.as_str()).collect();
    programs.dedup();
    let side = |program: &str, corrected: bool| -> Option<Side> {
        let of_window = |window: &usize| {
            let wanted = task(*window, corrected);
            let found = |(p, run): &&(String, Run<Answer>)| p == program && run.case == case.name && run.task == wanted;
            runs.iter().find(found).map(|(_, run)| judge.shares(run))
        };
        let columns = WINDOWS.iter().map(of_window).collect::<Option<Vec<_>>>()?;
        let row = |range: usize| columns.iter().map(|column| column[range].clone()).collect();
        Some(Side { program: program.to_owned(), corrected, shares: (0..RANGES_DEG.len()).map(row).collect() })
    };
    let both = programs.iter().flat_map(|program| [side(program, false), side(program, true)]);
    Ok(Film {
        film: &case.name,
        folder: &truth.film,
        pairs: (0..RANGES_DEG.len()).map(|range| of_range(range).count()).collect(),
        points: (0..RANGES_DEG.len()).map(|range| of_range(range).sum()).collect(),
        sides: both.flatten().collect(),
    })
}

impl Film<'_> {
    fn write(&self, out: &mut impl Write) -> anyhow::Result<()> {
        writeln!(out, "\n{} ({}), mean yaw within {FRONTAL_DEG}°", self.film, self.folder.display())?;
        for (k, tolerance) in TOLERANCES_PX.iter().enumerate() {
            let windows: String = WINDOWS.iter().map(|side| format!("{:>7}", format!("{side}×{side}"))).collect();
            writeln!(out, "\n{:<38}{windows}", format!("within {tolerance} px, %"))?;
            for (range, (from, to)) in RANGES_DEG.iter().enumerate() {
                let (pairs, points) = (self.pairs[range], self.points[range]);
                writeln!(out, "{from}–{to}° ({pairs} pairs, {points} of at most {} corners)", CORNERS * pairs)?;
                if pairs > 0 {
                    self.write_rows(out, range, k)?;
                }
            }
        }
        self.write_summary(out)
    }

    fn write_rows(&self, out: &mut impl Write, range: usize, k: usize) -> anyhow::Result<()> {
        let mut row = |who: &str, values: &mut dyn Iterator<Item = f64>| {
            let values: Vec<String> = values.map(|value| format!("{value:7.1}")).collect();
            writeln!(out, "  {who:<36}{}", values.concat())
        };
        for corrected in [false, true] {
            let (when, paper) = if corrected { ("after", TABLE_2) } else { ("before", TABLE_1) };
            row(&format!("{when}: paper"), &mut paper[range].into_iter())?;
            for side in self.sides.iter().filter(|side| side.corrected == corrected) {
                row(&format!("{when}: {}", side.program), &mut side.shares[range].iter().map(|s| s.all[k]))?;
                if corrected {
                    row(&format!("{when}: {}, kept", side.program), &mut side.shares[range].iter().map(|s| s.kept[k]))?;
                }
            }
        }
        Ok(())
    }

    /// In how many cells ours holds what is asked of it.
    fn write_summary(&self, out: &mut impl Write) -> anyhow::Result<()> {
        let Some(after) = self.sides.iter().find(|side| side.corrected) else { return Ok(()) };
        let before = |side: &&Side| !side.corrected && side.program == after.program;
        let Some(before) = self.sides.iter().find(before) else { return Ok(()) };
        let tolerances = 0..TOLERANCES_PX.len();
        let count = |tolerances: std::ops::Range<usize>, holds: &dyn Fn(usize, usize, usize) -> bool| {
            let rows = (0..RANGES_DEG.len()).filter(|&range| self.pairs[range] > 0);
            let cells = rows.flat_map(|range| (0..WINDOWS.len()).map(move |window| (range, window)));
            let cells = cells.flat_map(|(range, window)| tolerances.clone().map(move |k| (range, window, k)));
            let holds: Vec<bool> = cells.map(|(range, window, k)| holds(range, window, k)).collect();
            format!("{} of {} cells", holds.iter().filter(|holds| **holds).count(), holds.len())
        };
        let share = |side: &Side, (range, window, k): (usize, usize, usize)| side.shares[range][window].all[k];
        writeln!(out)?;
        for peer in self.sides.iter().filter(|side| side.program != after.program && !side.corrected) {
            let level = |r: usize, w: usize, k: usize| share(before, (r, w, k)) >= share(peer, (r, w, k)) - LEVEL;
            let cells = count(tolerances.clone(), &level);
            writeln!(out, "before the correction no more than {LEVEL} point below {}: {cells}", peer.program)?;
        }
        let better = |r: usize, w: usize, k: usize| share(after, (r, w, k)) > share(before, (r, w, k));
        writeln!(out, "after the correction better than before: {}", count(tolerances, &better))?;
        let paper = |r: usize, w: usize, k: usize| share(after, (r, w, k)) >= TABLE_2[r][w];
        let cells = count(PAPER_TOLERANCE..PAPER_TOLERANCE + 1, &paper);
        writeln!(out, "within {} px at least the paper's Table 2: {cells}", TOLERANCES_PX[PAPER_TOLERANCE])?;
        Ok(())
    }
}
