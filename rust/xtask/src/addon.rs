//! `cargo x addon`: the abi3 wheel and the extension zip, built and validated by Blender's own tool.

use crate::environment::BLENDER_5_0;
use crate::generic_head;
use crate::run::{root, run, say, target};
use anyhow::Context;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Builds `target/addon/facewright-VERSION.zip` and gives back its path.
pub fn build() -> anyhow::Result<PathBuf> {
    let assets = generic_head::build()?;
    let wheel = build_wheel()?;
    let stage = target("addon/facewright");
    if stage.exists() {
        std::fs::remove_dir_all(&stage)?;
    }
    copy(&root().join("addon"), &stage)?;
    for name in ["NOTICE", "LICENSE-GPL"] {
        std::fs::copy(root().join(name), stage.join(name)).with_context(|| format!("{name} is missing"))?;
    }
    copy(&assets, &stage.join("assets"))?;
    std::fs::remove_file(stage.join("assets/built-from.txt"))?;
    std::fs::create_dir_all(stage.join("wheels"))?;
    let wheel_name = wheel.file_name().unwrap_or_default().to_string_lossy().into_owned();
    std::fs::copy(&wheel, stage.join("wheels").join(&wheel_name))?;
    let manifest = stage.join("blender_manifest.toml");
    let text = std::fs::read_to_string(&manifest)?.replace("@WHEEL@", &wheel_name);
    std::fs::write(&manifest, text)?;
    let zip = target(&format!("addon/facewright-{}.zip", env!("CARGO_PKG_VERSION")));
    let tool = BLENDER_5_0.extension_tool()?;
    let python = || -> anyhow::Result<Command> {
        let mut python = BLENDER_5_0.python()?;
        python.arg(&tool);
        Ok(python)
    };
    say("building and validating the extension");
    run(python()?.args(["build", "--source-dir"]).arg(&stage).arg("--output-filepath").arg(&zip))?;
    run(python()?.arg("validate").arg(&zip))?;
    say(&format!("{} ({} MB)", zip.display(), zip.metadata()?.len() / 1_000_000));
    Ok(zip)
}

fn build_wheel() -> anyhow::Result<PathBuf> {
    say("building the wheel");
    let out = target("addon/wheels");
    if out.exists() {
        std::fs::remove_dir_all(&out)?;
    }
    let maturin = BLENDER_5_0.program("maturin")?;
    let path = std::env::join_paths(
        maturin
            .parent()
            .map(Path::to_owned)
            .into_iter()
            .chain(std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default())),
    )?;
    let mut build = Command::new(&maturin);
    build.args(["build", "--release", "--quiet", "--zig", "--compatibility", "manylinux2014", "--manifest-path"]);
    run(build.arg("rust/python/Cargo.toml").arg("--out").arg(&out).env("PATH", path))?;
    let mut wheels = std::fs::read_dir(&out)?;
    Ok(wheels.next().context("maturin made no wheel")??.path())
}

fn copy(from: &Path, to: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(to)?;
    for entry in std::fs::read_dir(from)? {
        let (path, name) = {
            let e = entry?;
            (e.path(), e.file_name())
        };
        if name == "__pycache__" {
            continue;
        }
        if path.is_dir() {
            copy(&path, &to.join(name))?;
        } else {
            std::fs::copy(&path, to.join(name))?;
        }
    }
    Ok(())
}
