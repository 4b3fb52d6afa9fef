"""Several cameras at once in Blender: calibrated from folders, saved, opened, and one of them chosen for the clip."""

import json
from pathlib import Path
from typing import Any

import bpy
import pytest
from conftest import ROOT, snapshot
from tracking import drawn, module, same

BOARD = ROOT / "tests/data/clip/board"


@pytest.fixture
def settings() -> Any:
    return bpy.context.scene.facewright_rig


@pytest.fixture(scope="module")
def rig_json(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A rig of twice the same camera as a file."""
    folder = tmp_path_factory.mktemp("rig")
    add(folder, "left", "right")
    assert bpy.ops.facewright.calibrate_rig() == {"FINISHED"}
    assert bpy.ops.facewright.save_rig(filepath=str(folder / "rig.json")) == {"FINISHED"}
    return folder / "rig.json"


def add(folder: Path, *names: str) -> None:
    """Folders with the synthetic boards, as cameras."""
    for name in names:
        (folder / name).symlink_to(BOARD, target_is_directory=True)
        assert bpy.ops.facewright.add_rig_folder(directory=str(folder / name)) == {"FINISHED"}


def test_folders_of_pictures_give_a_rig(rig_json: Path, settings: Any) -> None:
    assert bpy.ops.facewright.open_rig(filepath=str(rig_json)) == {"FINISHED"}
    assert same(json.loads(rig_json.read_text()), json.loads(settings.text))
    rig = module("rig.actions").known(settings.text)
    assert rig.names == ["left", "right"] and rig.cameras[1].baseline < 1e-4
    assert "2 cameras, error" in drawn("FACEWRIGHT_PT_rig")


def test_the_camera_that_filmed_the_clip_is_chosen(rig_json: Path, settings: Any) -> None:
    actions, camera = module("rig.actions"), bpy.context.scene.facewright_camera
    bpy.ops.facewright.open_rig(filepath=str(rig_json))
    assert actions.chosen(bpy.context.scene) == "" and camera.text == ""
    assert bpy.ops.facewright.choose_rig_camera(name="right") == {"FINISHED"}
    assert actions.chosen(bpy.context.scene) == "right" and len(camera.pictures) == 8
    assert json.loads(camera.text)["fx"] == pytest.approx(520.0, abs=0.5)
    bpy.ops.facewright.forget_camera()
    assert actions.chosen(bpy.context.scene) == "", "another camera is used now"
    with pytest.raises(RuntimeError, match="the rig has no camera middle: its cameras are left, right"):
        bpy.ops.facewright.choose_rig_camera(name="middle")
    bpy.ops.facewright.choose_rig_camera(name="left")
    bpy.ops.facewright.forget_rig()
    assert settings.text == "" and camera.text, "the camera that was chosen stays"


def test_what_is_no_rig_gets_a_sentence_and_changes_nothing(settings: Any, tmp_path: Path) -> None:
    before, operators = snapshot(), bpy.ops.facewright
    assert not operators.calibrate_rig.poll() and not operators.save_rig.poll()
    assert not operators.choose_rig_camera.poll()
    with pytest.raises(RuntimeError, match="is not a folder"):
        operators.add_rig_folder(directory=str(tmp_path / "none"))
    add(tmp_path, "left", "right")
    settings.folders[1].name = "left"
    with pytest.raises(RuntimeError, match="two cameras are named left"):
        operators.calibrate_rig()
    settings.folders[1].name = ""
    with pytest.raises(RuntimeError, match="has no name"):
        operators.calibrate_rig()
    settings.folders[1].name, settings.folders[1].path = "right", str(tmp_path / "gone")
    with pytest.raises(RuntimeError, match="is not a folder: choose the pictures of camera right again"):
        operators.calibrate_rig()
    assert operators.remove_rig_folder(index=1) == {"FINISHED"} and [f.name for f in settings.folders] == ["left"]
    for content, sentence in (("{", "is not JSON"), ("[]", "holds no rig"), ('{"cameras": 3}', "its cameras is")):
        (tmp_path / "rig.json").write_text(content)
        with pytest.raises(RuntimeError, match=sentence):
            operators.open_rig(filepath=str(tmp_path / "rig.json"))
    assert snapshot() == before and settings.text == ""


def test_the_lens_is_solved_for_as_the_panel_says(settings: Any) -> None:
    camera = bpy.context.scene.facewright_camera
    camera.distortion_terms, camera.square_pixels, camera.bend = 0, True, "never"
    assert bpy.ops.facewright.calibrate(directory=str(BOARD)) == {"FINISHED"}
    found = json.loads(camera.text)
    assert found["k1"] == found["k2"] == 0.0 and found["fx"] == found["fy"]
    camera.distortion_terms, camera.tangential, camera.square_pixels = 3, True, False
    assert bpy.ops.facewright.calibrate(directory=str(BOARD)) == {"FINISHED"}
    found = json.loads(camera.text)
    assert found["fx"] != found["fy"] and all(found[key] != 0.0 for key in ("k1", "k2", "k3", "p1", "p2"))
    drawn("FACEWRIGHT_PT_lens")
