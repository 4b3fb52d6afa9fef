//! Wheels of the native library: `abi3`, so one serves every Python from 3.11 on.

use crate::compile;
use crate::environment::MATURIN;
use crate::run::{copy, empty, root, run, say, target};
use anyhow::Context;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The Python package as it is imported, native module and all, after [`for_here`].
pub fn package() -> PathBuf {
    target("python/facewright")
}

/// The wheel of what [`compile::programs`] has compiled, for machines like this one.
pub fn for_here() -> anyhow::Result<PathBuf> {
    let (package, out) = (package(), target("addon/here/wheels"));
    empty(&package)?;
    empty(&out)?;
    copy(&root().join("rust/python/python/facewright"), &package)?;
    let module = if cfg!(windows) { "_native.pyd" } else { "_native.abi3.so" };
    std::fs::copy(compile::native_module(), package.join(module)).context("the native module was not compiled")?;
    let mut pack = Command::new("python3");
    pack.arg("rust/xtask/python/wheel.py").args(["--version", env!("CARGO_PKG_VERSION"), "--package"]).arg(&package);
    run(pack.arg("--out").arg(&out))?;
    only(&out)
}

/// A wheel that others can use too: on Linux one for every glibc from 2.17 on.
pub fn portable() -> anyhow::Result<PathBuf> {
    say("building the wheel");
    let out = target("addon/wheels");
    empty(&out)?;
    let maturin = MATURIN.program("maturin")?;
    let usual = std::env::var_os("PATH").unwrap_or_default();
    // Zig lies beside maturin.
    let path = maturin.parent().map(Path::to_owned).into_iter().chain(std::env::split_paths(&usual));
    let mut build = Command::new(&maturin);
    build.args(["build", "--release", "--quiet", "--manifest-path", "rust/python/Cargo.toml"]);
    if cfg!(target_os = "linux") {
        build.args(["--zig", "--compatibility", "manylinux2014"]);
    }
    run(build.arg("--out").arg(&out).env("PATH", std::env::join_paths(path)?))?;
    only(&out)
}

fn only(folder: &Path) -> anyhow::Result<PathBuf> {
    in_folder(folder)?.pop().with_context(|| format!("{} holds no wheel", folder.display()))
}

/// The wheels of a folder.
pub fn in_folder(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder).with_context(|| format!("{} cannot be read", folder.display()))?;
    let mut wheels = entries.map(|e| Ok(e?.path())).collect::<anyhow::Result<Vec<PathBuf>>>()?;
    wheels.retain(|path| path.extension().is_some_and(|e| e == "whl"));
    wheels.sort();
    Ok(wheels)
}

/// Blender's word for the platform of a wheel: `linux-x64` for `…-manylinux_2_17_x86_64.whl`.
pub fn platform(wheel: &str) -> Option<String> {
    const SYSTEMS: [(&str, &str); 4] =
        [("manylinux", "linux"), ("linux", "linux"), ("win", "windows"), ("macosx", "macos")];
    const MACHINES: [(&str, &str); 4] = [("x86_64", "x64"), ("amd64", "x64"), ("aarch64", "arm64"), ("arm64", "arm64")];
    let tag = wheel.strip_suffix(".whl")?.rsplit('-').next()?;
    let (_, system) = SYSTEMS.into_iter().find(|(word, _)| tag.starts_with(word))?;
    let (_, machine) = MACHINES.into_iter().find(|(word, _)| tag.ends_with(word))?;
    Some(format!("{system}-{machine}"))
}

/// A file's name.
pub fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blenders_words_for_the_platforms_of_wheels() {
        let of = |tag: &str| platform(&format!("facewright-0.1.0-cp311-abi3-{tag}.whl"));
        let words = [
            ("linux_x86_64", "linux-x64"),
            ("manylinux_2_17_x86_64.manylinux2014_x86_64", "linux-x64"),
            ("manylinux_2_17_aarch64.manylinux2014_aarch64", "linux-arm64"),
            ("win_amd64", "windows-x64"),
            ("win_arm64", "windows-arm64"),
            ("macosx_10_12_x86_64", "macos-x64"),
            ("macosx_11_0_arm64", "macos-arm64"),
        ];
        for (tag, word) in words {
            assert_eq!(of(tag).as_deref(), Some(word), "{tag}");
        }
        assert_eq!(of("any"), None);
    }
}
