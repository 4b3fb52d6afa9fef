//! Frames in, head out: `cargo run --release --example reconstruct -- FRAMES OUT [camera.json]`.

use facewright::{Assets, FrameSet, Given, ReconstructOptions, SourcedCamera, check_folder, reconstruct};
use geometry::Progress;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Duration;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let (frames, out, camera) = match &arguments[..] {
        [frames, out] => (frames, out, None),
        [frames, out, camera] => (frames, out, Some(SourcedCamera::read(camera)?)),
        _ => return Err("usage: reconstruct FRAMES OUT [camera.json]".into()),
    };
    let progress = Progress::new();
    show(progress.clone());
    run(frames, out, &Given { camera, ..Given::default() }, &progress)
}

fn run(frames: &Path, out: &Path, given: &Given, progress: &Progress) -> Result<(), Box<dyn Error>> {
    check_folder(out)?;
    let frames = FrameSet::open(&[frames.to_owned()], progress)?;
    let assets = Assets::load(&Assets::default_folder())?;
    let head = reconstruct(&frames, &assets, given, &ReconstructOptions::default(), progress)?;
    head.write(out)?;
    let used = head.report.frames.iter().filter(|frame| frame.used).count();
    eprintln!("{used} of {} frames used; size from the {}", frames.len(), head.report.scale.source);
    head.report.warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
    Ok(())
}

/// Prints the stage twice a second, until the program ends. Calling `cancel` on any clone would stop the work.
fn show(progress: Progress) {
    std::thread::spawn(move || {
        loop {
            let now = progress.snapshot();
            eprint!("\r{:<12}{:>4.0} %", now.stage, 100.0 * now.fraction);
            std::thread::sleep(Duration::from_millis(500));
        }
    });
}
