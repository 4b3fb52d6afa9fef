//! `cargo x test --gui`, `cargo x manual --pictures`: the extension in a real Blender window, used by mouse and keyboard.
//!
//! Blender, a virtual screen and a virtual hand are installed into a Debian of their own under `target/gui`: the machine gets
//! at most debootstrap. `tests/gui/drive.py` does the tests inside.

use crate::environment::BLENDER_5_0;
use crate::fetch::{THREE, npm_package};
use crate::run::{root, run, say, target};
use anyhow::{Context, bail};
use std::path::Path;
use std::process::Command;

/// The Debian that has Blender 4.3.
const SUITE: &str = "trixie";

/// What is installed there.
const PACKAGES: &[&str] =
    &["blender", "python3", "python3-numpy", "xvfb", "xauth", "xdotool", "imagemagick", "libgl1-mesa-dri", "libegl1"];

/// How apt-get installs: only what is needed, without questions.
const INSTALL: &[&str] = &["install", "--yes", "--quiet=2", "--no-install-recommends"];

/// Tests an extension zip in a window; screenshots and logs are left in `target/gui`.
pub fn gui(zip: &Path) -> anyhow::Result<()> {
    if output(Command::new("id").arg("-u"))? != "0" {
        bail!("the window test lives in a Debian folder, which needs root: run it as root, or leave --gui out");
    }
    install()?;
    say("Blender 4.3 in a window");
    std::fs::copy(zip, target("gui/extension.zip")).with_context(|| format!("{} is missing", zip.display()))?;
    let mut drive = inside();
    drive.args(["python3", "tests/gui/drive.py", "--zip", "target/gui/extension.zip"]);
    drive.args(["--clip", "tests/data/clip", "--out", "target/gui"]);
    if !drive.status().context("unshare cannot be started")?.success() {
        // The driver's last line has said how many failed; nothing is to follow it.
        std::process::exit(1);
    }
    read_back()
}

/// What the hour's test has exported, as Blender 5.0 and three.js read it.
fn read_back() -> anyhow::Result<()> {
    let mut python = BLENDER_5_0.python()?;
    python.arg("tests/gui/read_back.py").arg(target("gui"));
    if Command::new("node").arg("--version").output().is_ok() {
        python.arg("--three").arg(npm_package(&THREE)?);
    } else {
        say("skipped: three.js needs `node` on PATH");
    }
    run(&mut python)
}

/// Makes the manual's pictures of what the tests have left.
pub fn pictures() -> anyhow::Result<()> {
    let mut make = inside();
    make.args(["python3", "tests/gui/pictures.py", "--shots", "target/gui"]);
    run(make.args(["--frames", "tests/data/clip/frames", "--out", "docs/manual/pictures"]))
}

/// Makes the Debian folder when it is not there or its recipe has changed.
fn install() -> anyhow::Result<()> {
    let stamp = target("gui/installed.txt");
    let wanted = format!("{SUITE}\n{}", PACKAGES.join("\n"));
    if std::fs::read_to_string(&stamp).ok().as_deref() == Some(&wanted) {
        return Ok(());
    }
    say(&format!("installing Debian {SUITE} with Blender into target/gui"));
    if target("gui").exists() {
        std::fs::remove_dir_all(target("gui"))?;
    }
    std::fs::create_dir_all(target("gui"))?;
    bootstrap()?;
    run(inside().args(["apt-get", "update", "--quiet=2"]))?;
    run(quiet(inside().arg("apt-get").args(INSTALL).args(PACKAGES)))?;
    Ok(std::fs::write(stamp, wanted)?)
}

fn bootstrap() -> anyhow::Result<()> {
    if Command::new("debootstrap").arg("--version").output().is_err() {
        run(Command::new("apt-get").args(["update", "--quiet=2"]))?;
        run(quiet(Command::new("apt-get").args(INSTALL).arg("debootstrap")))?;
    }
    let folder = target("gui").join(SUITE);
    let mut debootstrap = Command::new("unshare");
    debootstrap.args(["--mount", "debootstrap", "--variant=minbase", SUITE]).arg(&folder).args(mirror());
    run(quiet(&mut debootstrap)).with_context(|| format!("see {}/debootstrap/debootstrap.log", folder.display()))
}

/// The mirror that the machine itself uses; none on a machine that is no Debian, where debootstrap knows its own.
fn mirror() -> Option<String> {
    let mut targets = Command::new("apt-get");
    targets.args(["indextargets", "--format", "$(REPO_URI)"]).args(["Origin: Debian", "Label: Debian"]);
    output(&mut targets).ok()?.lines().next().map(str::to_owned)
}

/// A command inside the Debian folder; its program and arguments are added by the caller.
fn inside() -> Command {
    let mut command = Command::new("unshare");
    command.args(["--mount", "--pid", "--fork", "--kill-child"]).arg(root().join("tests/gui/enter.sh"));
    command.arg(target("gui").join(SUITE)).arg(root());
    command.env("PATH", "/usr/sbin:/usr/bin:/sbin:/bin").env("LANG", "C.UTF-8").env("HOME", "/tmp");
    command.env("DEBIAN_FRONTEND", "noninteractive").env("PYTHONDONTWRITEBYTECODE", "1");
    command
}

/// A command without its hundreds of lines on stdout; errors still show.
fn quiet(command: &mut Command) -> &mut Command {
    command.stdout(std::process::Stdio::null())
}

fn output(command: &mut Command) -> anyhow::Result<String> {
    let output = command.output().with_context(|| format!("{:?} cannot be started", command.get_program()))?;
    Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}
