//! `cargo x bench [WORD]`: time and error of a feature, ours and the peer's, on the same inputs in the same run.

use crate::environment::{BLENDER_4_5, Environment, OPENCV_4, OPENCV_5, POSELIB, PYCOLMAP};
use crate::run::{root, run, say, target};
use crate::{bench_reconstruct, compile};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Features that are measured, and the whole way.
pub const WORDS: [&str; 7] = ["calibrate", "track", "motion", "bundle", "sequence", "dense", bench_reconstruct::WORD];
/// Words that are measured with another, as parts of its feature: the motion of two frames, the bundle over many and the way
/// from one to the other.
const PARTS: [(&str, &str); 2] = [("motion", "bundle"), ("motion", "sequence")];
/// Those of them that OpenCV has too.
const OPENCV_WORDS: [&str; 4] = ["calibrate", "track", "motion", "dense"];
/// The peers. Each has a script per word that it is measured in, `peers/WORD` and its ending.
const PEERS: [Peer; 5] = [
    Peer { name: "opencv-4", environment: &OPENCV_4, script: ".py", words: &OPENCV_WORDS },
    Peer { name: "opencv-5", environment: &OPENCV_5, script: ".py", words: &OPENCV_WORDS },
    Peer { name: "blender-4.5", environment: &BLENDER_4_5, script: "_blender.py", words: &["track"] },
    Peer { name: "poselib", environment: &POSELIB, script: "_poselib.py", words: &["motion"] },
    Peer { name: "pycolmap", environment: &PYCOLMAP, script: "_pycolmap.py", words: &["bundle", "sequence"] },
];
/// Ours and the peers are measured in turn so many times; the table shows the median.
const TURNS: usize = 3;
/// Every side gets one thread.
const ONE_THREAD: [(&str, &str); 3] =
    [("RAYON_NUM_THREADS", "1"), ("OMP_NUM_THREADS", "1"), ("OPENBLAS_NUM_THREADS", "1")];

/// A program that ours is measured beside.
struct Peer {
    name: &'static str,
    environment: &'static Environment,
    script: &'static str,
    words: &'static [&'static str],
}

/// Measures one feature with its parts, or all; the whole way beside the program `before` too.
pub fn bench(word: Option<&str>, before: Option<&Path>) -> anyhow::Result<()> {
    compile::programs(&["bench"])?;
    let is_asked = |part: &str| word.is_none_or(|word| part == word || PARTS.contains(&(word, part)));
    WORDS.iter().filter(|part| is_asked(part)).try_for_each(|&part| match part {
        bench_reconstruct::WORD => bench_reconstruct::measure(before),
        _ => measure(part),
    })
}

fn measure(word: &str) -> anyhow::Result<()> {
    let folder = target("bench").join(word);
    say(&format!("{word}: inputs"));
    run(&mut ours("inputs", word, &folder))?;
    let mut results = Vec::new();
    for turn in 1..=TURNS {
        say(&format!("{word}: turn {turn} of {TURNS}"));
        results.push(result(&folder, "ours", turn));
        run(ours("measure", word, &folder).args(results.last()).envs(ONE_THREAD))?;
        for peer in PEERS.iter().filter(|peer| peer.words.contains(&word)) {
            results.push(result(&folder, peer.name, turn));
            run(python(peer, word, &folder)?.args(results.last()).envs(ONE_THREAD))?;
        }
    }
    say(word);
    run(ours("table", word, &folder).args(&results))
}

fn result(folder: &Path, side: &str, turn: usize) -> PathBuf {
    folder.join(format!("{side}-{turn}.json"))
}

fn ours(step: &str, word: &str, folder: &Path) -> Command {
    let mut command = compile::program("bench");
    command.args([step, word]).arg(folder);
    command
}

fn python(peer: &Peer, word: &str, folder: &Path) -> anyhow::Result<Command> {
    let mut command = peer.environment.python()?;
    command.arg(root().join("rust/bench/peers").join(format!("{word}{}", peer.script))).arg(folder);
    Ok(command)
}
