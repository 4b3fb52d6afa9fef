//! `cargo x addon`: the extension zip, built and validated by Blender's own tool.

use crate::environment::BLENDER_5_0;
use crate::run::{copy, empty, root, run, say, target};
use crate::wheel::{self, name};
use crate::{compile, generic_head, manual};
use anyhow::{Context, bail};
use std::path::{Path, PathBuf};
use std::process::Command;

/// What stands in the manifest for the names of the wheels and for their platforms.
const WHEELS: &str = "\"./wheels/@WHEEL@\"";
const PLATFORMS: &str = "\"linux-x64\"";

/// What is said of the add-on, of its library, and of what others have made: with the licences that it names.
const NOTICES: [&str; 4] = ["NOTICE", "LICENSE-GPL", "LICENSE-MIT", "LICENSE-APACHE"];

/// Where the native library of an extension comes from.
pub enum Library<'a> {
    /// Compiled as everything else is: quick, but it runs on machines like this one only. For demo and tests.
    Here,
    /// Compiled once more, against the oldest glibc that Blender runs on (elsewhere than on Linux: as by [`Here`](Self::Here)).
    Portable,
    /// Wheels of any number of platforms, all in a folder: a zip for each platform.
    Wheels(&'a Path),
}

/// Builds the extension for this machine alone and gives back its zip.
pub fn build() -> anyhow::Result<PathBuf> {
    bundle(&Library::Here)?.pop().context("Blender's tool made no zip")
}

/// Builds `target/addon/facewright-VERSION.zip`, or one for each platform of given wheels, and gives back their paths.
pub fn bundle(library: &Library) -> anyhow::Result<Vec<PathBuf>> {
    let (wheels, folder) = match library {
        Library::Here => {
            compile::programs(&["assets"])?;
            (vec![wheel::for_here()?], target("addon/here"))
        }
        Library::Portable => (vec![wheel::portable()?], target("addon")),
        Library::Wheels(given) => (wheel::in_folder(&std::path::absolute(given)?)?, target("addon")),
    };
    let stage = stage(&wheels)?;
    let zip = folder.join(format!("facewright-{}.zip", env!("CARGO_PKG_VERSION")));
    let is_split = matches!(library, Library::Wheels(_));
    std::fs::create_dir_all(&folder)?;
    say("building and validating the extension");
    let mut build = extension_tool()?;
    build.args(["build", "--source-dir"]).arg(&stage).arg("--output-filepath").arg(&zip);
    run(build.args(is_split.then_some("--split-platforms")))?;
    let mut zips = if is_split { split_zips(&zip, &wheels)? } else { vec![zip] };
    zips.sort();
    for zip in &zips {
        run(extension_tool()?.arg("validate").arg(zip))?;
        say(&format!("{} ({} MB)", zip.display(), zip.metadata()?.len() / 1_000_000));
    }
    Ok(zips)
}

/// The extension's folder: the add-on with licences, assets and wheels, which its manifest names.
fn stage(wheels: &[PathBuf]) -> anyhow::Result<PathBuf> {
    let assets = generic_head::build()?;
    let stage = target("addon/facewright");
    empty(&stage)?;
    copy(&root().join("addon"), &stage)?;
    for name in NOTICES {
        std::fs::copy(root().join(name), stage.join(name)).with_context(|| format!("{name} is missing"))?;
    }
    copy(&manual::pages()?, &stage.join("manual"))?;
    copy(&assets, &stage.join("assets"))?;
    std::fs::remove_file(stage.join("assets/built-from.txt"))?;
    std::fs::create_dir_all(stage.join("wheels"))?;
    for wheel in wheels {
        std::fs::copy(wheel, stage.join("wheels").join(name(wheel)))?;
    }
    let manifest = stage.join("blender_manifest.toml");
    std::fs::write(&manifest, with_wheels(&std::fs::read_to_string(&manifest)?, wheels)?)?;
    Ok(stage)
}

fn with_wheels(manifest: &str, wheels: &[PathBuf]) -> anyhow::Result<String> {
    if !manifest.contains(WHEELS) || !manifest.contains(PLATFORMS) {
        bail!("blender_manifest.toml lacks {WHEELS} or {PLATFORMS}");
    }
    let quoted = |words: Vec<String>| words.iter().map(|w| format!("\"{w}\"")).collect::<Vec<_>>().join(", ");
    let paths = wheels.iter().map(|wheel| format!("./wheels/{}", name(wheel))).collect();
    Ok(manifest.replace(WHEELS, &quoted(paths)).replace(PLATFORMS, &quoted(platforms(wheels)?)))
}

fn platforms(wheels: &[PathBuf]) -> anyhow::Result<Vec<String>> {
    wheels
        .iter()
        .map(|wheel| wheel::platform(&name(wheel)).with_context(|| format!("no platform in {}", name(wheel))))
        .collect()
}

/// Blender's tool adds the platform to the name of a zip.
fn split_zips(zip: &Path, wheels: &[PathBuf]) -> anyhow::Result<Vec<PathBuf>> {
    let of = |platform: &String| zip.with_file_name(format!("{}-{}.zip", stem(zip), platform.replace('-', "_")));
    Ok(platforms(wheels)?.iter().map(of).collect())
}

fn extension_tool() -> anyhow::Result<Command> {
    let mut python = BLENDER_5_0.python()?;
    python.arg(BLENDER_5_0.extension_tool()?);
    Ok(python)
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_licence_that_the_notice_names_comes_along() {
        let notice = std::fs::read_to_string(root().join("NOTICE")).unwrap();
        let words = notice.split(|c: char| !(c.is_ascii_uppercase() || c == '-'));
        let named: std::collections::BTreeSet<&str> = words.filter(|word| word.starts_with("LICENSE-")).collect();
        assert_eq!(named.len(), 3, "{named:?}");
        assert!(named.iter().all(|name| NOTICES.contains(name)), "{named:?}");
    }

    #[test]
    fn the_manifest_names_every_wheel_and_platform() {
        let wheels = ["a-1-cp311-abi3-linux_x86_64.whl", "a-1-cp311-abi3-win_amd64.whl"].map(PathBuf::from);
        let manifest = std::fs::read_to_string(root().join("addon/blender_manifest.toml")).unwrap();
        let filled = with_wheels(&manifest, &wheels).unwrap();
        assert!(filled.contains("platforms = [\"linux-x64\", \"windows-x64\"]"));
        assert!(filled.contains(
            "wheels = [\"./wheels/a-1-cp311-abi3-linux_x86_64.whl\", \"./wheels/a-1-cp311-abi3-win_amd64.whl\"]"
        ));
    }
}
