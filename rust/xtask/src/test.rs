//! `cargo x test`, `cargo x fixtures`.

use crate::environment::{BLENDER_4_5, BLENDER_5_0, Environment};
use crate::gltf::gltf;
use crate::run::{cargo, root, run, say, together};
use crate::{addon, compile, generic_head, gui, wheel};
use std::process::Command;

/// Tests of the library as Python sees it.
const LIBRARY: &str = "tests/python";

/// Every test: Rust, glTF, Python, Blender 4.5 and 5.0; Blender 4.3 in a real window if wanted.
pub fn test(window: bool) -> anyhow::Result<()> {
    compile::programs(&["assets", "facewright"])?;
    let assets = generic_head::build()?;
    say("Rust");
    run(&mut cargo(&["test", "--release", "--workspace"]))?;
    gltf(&assets)?;
    let zip = addon::build()?;
    say("Python");
    run(&mut pytest(&BLENDER_5_0, LIBRARY, &zip)?)?;
    say("Blender 5.0 and, beside it, 4.5");
    // One process each, which keeps to one core most of the time.
    together([pytest(&BLENDER_5_0, "tests/blender", &zip)?, pytest(&BLENDER_4_5, "tests/blender", &zip)?])?;
    if window { gui::gui(&zip) } else { Ok(()) }
}

fn pytest(environment: &Environment, folder: &str, zip: &std::path::Path) -> anyhow::Result<Command> {
    let mut python = environment.python()?;
    python.args(["-m", "pytest", "-q", "-p", "no:cacheprovider", folder]);
    // The package that the add-on's wheel was packed from; Blender's tests take the one in the add-on.
    if folder == LIBRARY {
        python.env("PYTHONPATH", wheel::package().with_file_name(""));
    }
    python.env("FACEWRIGHT_ZIP", zip).env("FACEWRIGHT_ROOT", root());
    Ok(python)
}

/// Runs every script of `blend_fixtures/make`.
pub fn fixtures() -> anyhow::Result<()> {
    let zip = addon::build()?;
    let mut scripts: Vec<_> = std::fs::read_dir(root().join("blend_fixtures/make"))?.filter_map(|e| e.ok()).collect();
    scripts.sort_by_key(std::fs::DirEntry::path);
    for script in scripts.iter().map(std::fs::DirEntry::path).filter(|p| p.extension().is_some_and(|e| e == "py")) {
        say(&script.file_name().unwrap_or_default().to_string_lossy());
        run(BLENDER_5_0.python()?.arg(&script).env("FACEWRIGHT_ZIP", &zip))?;
    }
    Ok(())
}
