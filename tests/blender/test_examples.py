"""The example script leaves a file with a head whose expression is animated."""

import runpy
import sys
from pathlib import Path

import bpy
import pytest
from conftest import ROOT

SCRIPT = ROOT / "addon/examples/expression.py"


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> None:
    monkeypatch.setattr(sys, "argv", ["blender", "-b", "--python", str(SCRIPT), *arguments])
    runpy.run_path(str(SCRIPT), run_name="__main__")


def test_a_head_is_made_and_its_expression_keyframed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    run(monkeypatch, "--", str(ROOT / "tests/data/clip/frames"), str(tmp_path / "head.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "head.blend"))
    (keys,) = (key for key in bpy.data.shape_keys if key.user.name == "Face")
    smile = keys.key_blocks["mouthSmileLeft"]
    seen = []
    for frame in (12, 18, 80):
        bpy.context.scene.frame_set(frame)
        seen.append(smile.value)
    assert seen[0] == seen[1] == 0.0 and seen[2] == pytest.approx(0.65)


def test_without_arguments_the_usage_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(SystemExit, match="FRAMES head.blend"):
        run(monkeypatch)
