"""What Blender's own tool and an installed extension say of the store's rules; the others are in tests/python."""

import importlib
import os
import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

import bpy
import pytest
from conftest import PACKAGE, ROOT
from people import Clips, run

FOLDER = Path(importlib.import_module(PACKAGE).__file__ or "").parent


def tool(*arguments: str) -> subprocess.CompletedProcess[str]:
    """What `blender --command extension` runs."""
    scripts = Path(bpy.utils.resource_path("LOCAL")) / "scripts"
    program = scripts / "addons_core" / "bl_pkg" / "cli" / "blender_ext.py"
    return subprocess.run([sys.executable, str(program), *arguments], capture_output=True, text=True, check=False)


@pytest.fixture
def unpacked(tmp_path: Path) -> Path:
    with ZipFile(os.environ["FACEWRIGHT_ZIP"]) as content:
        content.extractall(tmp_path / "facewright")
    return tmp_path / "facewright"


def test_blenders_tool_finds_nothing_wrong(unpacked: Path, tmp_path: Path) -> None:
    for arguments in (
        ["validate", os.environ["FACEWRIGHT_ZIP"]],
        ["validate", str(unpacked)],
        ["build", "--source-dir", str(unpacked), "--output-filepath", str(tmp_path / "built.zip")],
    ):
        done = tool(*arguments)
        assert done.returncode == 0 and "Error" not in done.stdout + done.stderr, done.stdout + done.stderr
    with ZipFile(tmp_path / "built.zip") as built, ZipFile(os.environ["FACEWRIGHT_ZIP"]) as given:
        files = [{name for name in one.namelist() if not name.endswith("/")} for one in (built, given)]
    assert files[0] == files[1]


@pytest.mark.parametrize(
    ("right", "wrong"), [('tagline = "', 'tagline = "Heads. '), ("[permissions]", "[permissions]\ndisk = 'All of it'")]
)
def test_blenders_tool_finds_what_is_wrong(unpacked: Path, right: str, wrong: str) -> None:
    manifest = unpacked / "blender_manifest.toml"
    text = manifest.read_text(encoding="utf-8")
    assert right in text
    manifest.write_text(text.replace(right, wrong + "x" * 60 if "tagline" in right else wrong), encoding="utf-8")
    assert tool("validate", str(unpacked)).returncode != 0


def files() -> dict[str, int]:
    """Files of the installed extension with their times; Python's own caches apart."""
    found = [path for path in FOLDER.rglob("*") if path.is_file() and "__pycache__" not in path.parts]
    return {str(path.relative_to(FOLDER)): path.stat().st_mtime_ns for path in found}


def test_nothing_is_written_into_the_extensions_own_folder(clips: Clips, tmp_path: Path) -> None:
    before = files()
    run(clips.anna)
    bpy.ops.facewright.calibrate(directory=str(ROOT / "tests/data/clip/board"))
    bpy.ops.facewright.save_camera(filepath=str(tmp_path / "camera.json"))
    bpy.ops.facewright.save_board(filepath=str(tmp_path / "board.pdf"))
    bpy.ops.facewright.open_report()
    bpy.ops.facewright.export(filepath=str(tmp_path / "anna.glb"))
    assert {path.name for path in tmp_path.iterdir()} >= {"camera.json", "board.pdf", "anna.glb"}
    assert len(before) > 40 and files() == before


def test_every_class_is_called_as_blender_wants_it() -> None:
    kinds = {bpy.types.Operator: "_OT_", bpy.types.Panel: "_PT_", bpy.types.Menu: "_MT_", bpy.types.UIList: "_UL_"}
    seen = 0
    for cls in importlib.import_module(f"{PACKAGE}.registration").CLASSES:
        for kind, infix in kinds.items():
            if issubclass(cls, kind):
                seen += 1
                assert cls.__name__.startswith(f"FACEWRIGHT{infix}"), cls.__name__
        if issubclass(cls, bpy.types.Operator):
            assert cls.bl_idname == f"facewright.{cls.__name__.removeprefix('FACEWRIGHT_OT_')}"
    assert seen > 50
