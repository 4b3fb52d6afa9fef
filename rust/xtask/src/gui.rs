//! `cargo x test --gui`: the panel, clicked in a real window of Debian trixie's Blender under Xvfb.

use crate::run::{output, root, run, say, target};
use anyhow::bail;
use std::path::Path;
use std::process::Command;

/// Whether a real window can be made here: root and debootstrap (or apt to get it).
pub fn possible() -> bool {
    let is_root = output(Command::new("id").arg("-u")).is_ok_and(|id| id == "0");
    is_root && output(Command::new("which").arg("apt-get")).is_ok()
}

/// Sets up the window and clicks through it.
pub fn test(zip: &Path) -> anyhow::Result<()> {
    if !possible() {
        bail!("a real window needs root and apt-get: run as root on Debian, or leave out --gui");
    }
    say("real window (Debian trixie's Blender)");
    let script = root().join("tests/gui/run.sh");
    run(Command::new("bash").arg(script).arg(target("gui")).arg(zip).arg(root()))
}
