//! `cargo x degraded`: what a worse film does to its tracks, judged by the true surface.

use crate::run::{run, say, target};
use crate::{compile, generic_head};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Writes the films, tracks each with the program as users call it, and prints the table.
pub fn degraded(method: &str) -> anyhow::Result<()> {
    let (assets, folder) = (generic_head::build()?, target("bench/degraded"));
    compile::programs(&["bench", "facewright"])?;
    say("degraded films");
    run(bench("inputs").arg(&folder))?;
    let mut films: Vec<PathBuf> = std::fs::read_dir(&folder)?.filter_map(|e| Some(e.ok()?.path())).collect();
    films.retain(|film| film.join("frames").is_dir());
    films.sort();
    for film in &films {
        track(film, &assets, method)?;
    }
    run(bench("table").arg(&folder))
}

/// A film that cannot be tracked has no tracks: that too is a result.
fn track(film: &Path, assets: &Path, method: &str) -> anyhow::Result<()> {
    let tracks = film.join("tracks.json");
    if tracks.is_file() {
        std::fs::remove_file(&tracks)?;
    }
    let mut program = compile::program("facewright");
    program.args(["--quiet", "track"]).arg(film.join("frames")).arg("--assets").arg(assets);
    program.arg("--camera").arg(film.join("camera.json")).args(["--method", method]).arg("-o").arg(&tracks);
    if let Err(error) = run(&mut program) {
        say(&error.to_string());
    }
    Ok(())
}

fn bench(step: &str) -> Command {
    let mut command = compile::program("bench");
    command.args([step, "degraded"]);
    command
}
