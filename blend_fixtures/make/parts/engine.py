"""The add-on and its native library, from the extension in FACEWRIGHT_ZIP or from the working copy."""

import importlib
import os
import sys
import tempfile
from pathlib import Path
from types import ModuleType

os.environ.setdefault("BLENDER_USER_RESOURCES", tempfile.mkdtemp(prefix="facewright-fixtures-"))

import bpy

ROOT = Path(__file__).resolve().parents[3]
FIXTURES = ROOT / "blend_fixtures"
CLIP = ROOT / "tests/data/clip"


def empty_scene() -> bpy.types.Scene:
    """A scene with nothing in it, and the add-on at hand."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    zip_file = os.environ.get("FACEWRIGHT_ZIP")
    if zip_file:
        bpy.ops.extensions.package_install_files(
            filepath=zip_file, repo="user_default", enable_on_install=True, overwrite=True
        )
    return bpy.context.scene


def addon(module: str) -> ModuleType:
    """A module of the add-on: `engine`, `scene.head`. Needs :func:`empty_scene` first."""
    if os.environ.get("FACEWRIGHT_ZIP"):
        return importlib.import_module(f"bl_ext.user_default.facewright.{module}")
    sys.path[:0] = [str(ROOT)]
    os.environ.setdefault("FACEWRIGHT_ASSETS", str(ROOT / "target/assets"))
    return importlib.import_module(f"addon.{module}")


def save(name: str) -> Path:
    """Save the open scene as a small `.blend` in the fixtures' folder."""
    path = FIXTURES / f"{name}.blend"
    bpy.context.preferences.filepaths.save_version = 0
    bpy.ops.outliner.orphans_purge(do_recursive=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)
    return path


def write_toml(name: str, lines: list[str]) -> None:
    """Write the truth beside a `.blend`."""
    (FIXTURES / f"{name}.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
