//! Films made worse in known ways, and what that does to the tracks of `facewright track`.
//!
//! `cargo x degraded` runs three steps:
//! - `bench inputs degraded FOLDER` writes every film to a folder of its own: `frames/`, `camera.json`, and `truth.json`, which
//!   the program does not read;
//! - `facewright track` leaves `tracks.json` beside them, as users call it;
//! - `bench table degraded FOLDER` judges all tracks by the true surface and prints a row for each film.
//!
//! The film is `../shared/data/james-cif` where that is there, else the project's own clip.

mod degrade;
mod judge;
mod reflection;
mod tracks;

use crate::files::{read_json, write_json};
use crate::scenes::clip::Clip;
use anyhow::Context;
use degrade::{Degradation, Picture};
use geometry::Transform;
use judge::Verdict;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::{Path, PathBuf};
use tracks::Tracks;

/// What the judge knows of a film.
#[derive(Serialize, Deserialize)]
struct Truth {
    /// What was done to it.
    what: String,
    /// Folder of the film it was made from.
    film: PathBuf,
    /// The true poses.
    cam_from_head: Vec<Transform>,
    /// How far each frame was moved, pixels.
    shifts: Vec<[f64; 2]>,
}

/// Writes all films into a folder.
pub fn write(folder: &Path) -> anyhow::Result<()> {
    let film = film();
    let clip = Clip::open_in(&film)?;
    let pictures = (0..clip.frames.len()).map(|i| clip.picture(i)).collect::<anyhow::Result<Vec<_>>>()?;
    for (number, degradation) in Degradation::ALL.into_iter().enumerate() {
        // The table has the films in this order.
        let folder = folder.join(format!("{number}-{}", degradation.word()));
        let frames = folder.join("frames");
        if frames.is_dir() {
            std::fs::remove_dir_all(&frames)?;
        }
        std::fs::create_dir_all(&frames)?;
        let made = degradation.apply(&clip, &pictures);
        let save = |(frame, picture): (&crate::scenes::clip::Frame, &Picture)| picture.save(&frames, &frame.name);
        clip.frames.par_iter().zip(&made.pictures).try_for_each(save)?;
        let truth = Truth {
            what: degradation.what().to_owned(),
            film: film.clone(),
            cam_from_head: made.cam_from_head,
            shifts: made.shifts,
        };
        write_json(&folder.join("truth.json"), &truth)?;
        write_json(&folder.join("camera.json"), &clip.camera)?;
    }
    Ok(())
}

/// Judges the tracks of all films and prints a row for each.
pub fn print(folder: &Path) -> anyhow::Result<()> {
    let entries = std::fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))?;
    let mut films: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    films.retain(|path| path.join("truth.json").is_file());
    films.sort();
    let judged: Vec<(String, Option<Verdict>)> =
        films.par_iter().map(|film| judge(film)).collect::<anyhow::Result<_>>()?;
    let mut out = std::io::stdout().lock();
    let film = Clip::open_in(&film())?;
    writeln!(out, "{}", judge::describe(&film))?;
    let width = judged.iter().map(|(what, _)| what.chars().count()).max().unwrap_or(0);
    Verdict::headings(width).into_iter().try_for_each(|line| writeln!(out, "{line}"))?;
    for (what, verdict) in judged {
        match verdict {
            Some(verdict) => writeln!(out, "{what:<width$}{}", verdict.row())?,
            None => writeln!(out, "{what:<width$}  no tracks")?,
        }
    }
    Ok(())
}

/// What was done to a film, and how its tracks are; `None` where there are none.
fn judge(folder: &Path) -> anyhow::Result<(String, Option<Verdict>)> {
    let truth: Truth = read_json(&folder.join("truth.json"))?;
    let file = folder.join("tracks.json");
    if !file.is_file() {
        return Ok((truth.what, None));
    }
    let (clip, tracks) = (Clip::open_in(&truth.film)?, read_json::<Tracks>(&file)?);
    let verdict = judge::judge(&tracks, &clip.head()?, clip.camera, &truth)?;
    Ok((truth.what, Some(verdict)))
}

fn film() -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let shared = root.join("../shared/data/james-cif");
    if shared.join("truth.json").is_file() { shared } else { root.join("tests/data/clip") }
}
