//! Running other programs: what is run is shown, and a failure stops the task.

use anyhow::{Context, anyhow, bail};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The project's root folder.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap_or(Path::new(".")).to_owned()
}

/// A folder or file under `target/`.
pub fn target(path: &str) -> PathBuf {
    root().join("target").join(path)
}

/// Says what is being done.
pub fn say(message: &str) {
    eprintln!("\x1b[1m▸ {message}\x1b[0m");
}

/// Runs a command in the project's root and fails if it fails.
pub fn run(command: &mut Command) -> anyhow::Result<()> {
    let shown = show(command);
    let status = command.current_dir(root()).status().with_context(|| format!("{shown} cannot be started"))?;
    if !status.success() {
        bail!("{shown} failed ({status})");
    }
    Ok(())
}

/// Runs two commands at the same time, and fails if one fails. What the second says is shown when the first has ended.
pub fn together([mut first, mut second]: [Command; 2]) -> anyhow::Result<()> {
    let shown = show(&second);
    second.current_dir(root()).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let other = second.spawn().with_context(|| format!("{shown} cannot be started"))?;
    // Pipes that nobody reads would stop it.
    let other = std::thread::spawn(|| other.wait_with_output());
    let ended = run(&mut first);
    let said = other.join().map_err(|_| anyhow!("{shown} was lost"))?.with_context(|| format!("{shown} failed"))?;
    std::io::stdout().write_all(&said.stdout)?;
    std::io::stderr().write_all(&said.stderr)?;
    ended?;
    if !said.status.success() {
        bail!("{shown} failed ({})", said.status);
    }
    Ok(())
}

/// `cargo` with its arguments.
pub fn cargo(arguments: &[&str]) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or("cargo".into()));
    command.args(arguments);
    command
}

/// Makes a folder anew, without what it held.
pub fn empty(folder: &Path) -> anyhow::Result<()> {
    if folder.exists() {
        std::fs::remove_dir_all(folder)?;
    }
    Ok(std::fs::create_dir_all(folder)?)
}

/// Copies a folder with all it holds but Python's caches.
pub fn copy(from: &Path, to: &Path) -> anyhow::Result<()> {
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

fn show(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(|w| w.to_string_lossy()).collect::<Vec<_>>().join(" ")
}
