//! Files broken at random: whatever is in a file, the library answers with a value or a sentence, soon and in bounded memory.
//!
//! The ordinary tests run a fixed number of inputs from a fixed seed. `cargo x fuzz` goes on for as long as it is told: it sets
//! `FACEWRIGHT_FUZZ_SECONDS`, for each target, and `FACEWRIGHT_FUZZ_SEED`. An input that fails is left in `target/fuzz`.

#![expect(clippy::unwrap_used, reason = "the helpers of tests are tests too")]

mod mutate;
mod seeds;
mod targets;

use mutate::{Kind, mutated};
use seeds::{file, pictures};
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::{Duration, Instant};
use targets::Target;

/// Inputs of a target in the ordinary tests …
const EXECUTIONS: u64 = 1500;
/// … and their seed.
const SEED: u64 = 1;
/// What one input may take.
const TIME: Duration = Duration::from_secs(2);
/// Of several runs of a slow input the fastest counts: the machine may be busy.
const ATTEMPTS: usize = 3;
/// By how much one input may raise the largest size that the process ever had, bytes; the seeds are of some kilobytes.
const ROOM: u64 = 512 << 20;

/// How long, and from which seed.
struct Plan {
    seed: u64,
    /// Without it, a fixed number of inputs.
    time: Option<Duration>,
}

impl Plan {
    fn new() -> Self {
        let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse().ok());
        let time = number("FACEWRIGHT_FUZZ_SECONDS").map(Duration::from_secs);
        Self { seed: number("FACEWRIGHT_FUZZ_SEED").unwrap_or(SEED), time }
    }

    fn goes_on(&self, executions: u64, started: Instant) -> bool {
        self.time.map_or(executions < EXECUTIONS, |time| started.elapsed() < time)
    }
}

/// Where an input stays that fails, even one that ends the process.
fn kept(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/fuzz");
    std::fs::create_dir_all(&folder).unwrap();
    folder.join(name)
}

/// Runs a target on its seeds, then on what mutations make of them.
fn fuzz(name: &str, seeds: &[Vec<u8>], kind: Kind, target: Target) {
    let (plan, started, path) = (Plan::new(), Instant::now(), kept(name));
    let mut executions = 0;
    while plan.goes_on(executions, started) {
        let whole = seeds.get(executions as usize).cloned();
        let input = whole.unwrap_or_else(|| mutated(seeds, kind, plan.seed.wrapping_add(executions)));
        std::fs::write(&path, &input).unwrap();
        let fault = fault(&input, target);
        let place = || format!("{name}, seed {}, input {executions}, kept as {}", plan.seed, path.display());
        assert!(fault.is_none(), "{}: {}", place(), fault.unwrap_or_default());
        executions += 1;
    }
    std::fs::remove_file(&path).unwrap();
    eprintln!("{name}: {executions} inputs from seed {} in {:.0?}", plan.seed, started.elapsed());
}

/// What is wrong with how a target takes an input.
fn fault(input: &[u8], target: Target) -> Option<String> {
    let before = peak_bytes();
    let mut outcome = run(input, target);
    for _ in 1..ATTEMPTS {
        if outcome == Outcome::Slow {
            outcome = run(input, target);
        }
    }
    let grown = peak_bytes().saturating_sub(before);
    match outcome {
        Outcome::Panic => Some("it panics".to_owned()),
        Outcome::Slow => Some(format!("it takes more than {TIME:?}")),
        Outcome::Fine if grown > ROOM => Some(format!("{} bytes of input take {} MB", input.len(), grown >> 20)),
        Outcome::Fine => None,
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    Fine,
    Panic,
    Slow,
}

/// Runs a target in a thread of its own, which is left alone if it does not end.
fn run(input: &[u8], target: Target) -> Outcome {
    let (sender, receiver) = mpsc::channel();
    let input = input.to_vec();
    std::thread::spawn(move || {
        target(&input);
        sender.send(())
    });
    match receiver.recv_timeout(TIME) {
        Ok(()) => Outcome::Fine,
        Err(mpsc::RecvTimeoutError::Disconnected) => Outcome::Panic,
        Err(mpsc::RecvTimeoutError::Timeout) => Outcome::Slow,
    }
}

/// The largest address space that the process ever had, where the system tells: memory counts that was asked for and not touched.
fn peak_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmPeak:")).unwrap_or_default();
    line.trim().trim_end_matches(" kB").parse::<u64>().map_or(0, |kilobytes| kilobytes << 10)
}

#[test]
fn what_a_target_must_not_do_is_noticed() {
    let waits = |_: &[u8]| std::thread::sleep(2 * TIME);
    assert_eq!(fault(b"", |_| std::panic::resume_unwind(Box::new("as it must"))), Some("it panics".to_owned()));
    assert!(fault(b"", waits).unwrap().contains("takes more than 2s"));
    assert_eq!(fault(b"", |_| ()), None);
    // Memory is not tried here: the peak would hide what the other tests take.
    assert!(peak_bytes() > 1 << 20 || cfg!(not(target_os = "linux")));
}

#[test]
fn cameras_of_any_program() {
    let seeds = ["camera.json", "opencv.yml", "kalibr.yaml", "rig.json"].map(file);
    fuzz("cameras", &seeds, Kind::Text, targets::camera);
}

#[test]
fn files_of_faces() {
    fuzz("faces", &[file("faces.json")], Kind::Text, targets::faces);
}

#[test]
fn files_of_tracks_and_the_motion_of_them() {
    fuzz("tracks", &[file("tracks.json")], Kind::Text, targets::tracks);
}

#[test]
fn files_of_motion() {
    fuzz("motion", &[file("motion.json")], Kind::Text, targets::motion);
}

#[test]
fn files_of_matches() {
    fuzz("matches", &[file("matches.json")], Kind::Text, targets::matches);
}

#[test]
fn files_of_rigs() {
    fuzz("rig", &[file("rig.json"), file("camera.json")], Kind::Text, targets::rig);
}

#[test]
fn reports_and_the_overlay_of_them() {
    fuzz("report", &[file("report.json")], Kind::Text, targets::report);
}

#[test]
fn heads_of_any_bytes() {
    fuzz("head", &[file("head.glb")], Kind::Bytes, targets::head);
}

#[test]
fn heads_of_any_structure() {
    fuzz("head-json", &[seeds::head_json()], Kind::Text, targets::head_of_json);
}

#[test]
fn pictures_of_any_bytes() {
    fuzz("pictures", &pictures(), Kind::Bytes, targets::picture);
}

#[test]
fn pngs_whose_checksums_are_right() {
    fuzz("png", &[seeds::png()], Kind::Bytes, targets::mended_png);
}
