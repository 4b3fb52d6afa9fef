"""Files of older versions: what they saved is found where it belongs now."""

import importlib
from pathlib import Path
from typing import Any

import bpy
import pytest
from conftest import PACKAGE


def raw(group: bpy.types.PropertyGroup) -> Any:
    """What is saved of a group, by names."""
    system = getattr(group, "bl_system_properties_get", None)
    return group if system is None else system(do_create=True)


def reopened(path: Path) -> bpy.types.Scene:
    """The scene after the file was saved and opened."""
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    return bpy.context.scene


def test_a_measured_eye_distance_goes_from_the_clip_to_the_person(tmp_path: Path) -> None:
    old = raw(bpy.context.scene.facewright_clip)
    old["use_interocular"], old["interocular_mm"] = True, 61.5
    scene = reopened(tmp_path / "old.blend")
    assert scene.facewright_person.use_interocular, "the switch"
    assert scene.facewright_person.interocular_mm == pytest.approx(61.5), "the distance"
    assert "use_interocular" not in raw(scene.facewright_clip), "it is taken over once"
    scene.facewright_person.interocular_mm = 64.0
    scene = reopened(tmp_path / "new.blend")
    assert scene.facewright_person.interocular_mm == pytest.approx(64.0), "what was set since then stays"


def test_a_file_that_is_open_when_the_extension_comes_is_taken_over_too() -> None:
    old = raw(bpy.context.scene.facewright_clip)
    old["use_interocular"] = True
    older_files = importlib.import_module(f"{PACKAGE}.older_files")
    older_files.unregister()
    older_files.register()
    assert bpy.app.timers.is_registered(older_files.take_over), "Blender calls it as soon as it may"
    older_files.take_over()
    assert bpy.context.scene.facewright_person.use_interocular


def test_a_chosen_texture_stays_chosen(tmp_path: Path) -> None:
    raw(bpy.context.scene.facewright_clip)["texture_size"] = 2
    scene = reopened(tmp_path / "old.blend")
    assert (scene.facewright_clip.texture_size, scene.facewright_clip.texture_px) == ("4096", 4096)
    assert "texture_size" not in raw(scene.facewright_clip), "it is taken over once"
    scene.facewright_clip.texture_size = "1024"
    scene = reopened(tmp_path / "new.blend")
    assert scene.facewright_clip.texture_size == "1024", "what was set since then stays"


def test_a_motion_takes_the_measured_eye_distance_of_the_person() -> None:
    actions = importlib.import_module(f"{PACKAGE}.motion.actions")
    person = bpy.context.scene.facewright_person
    person.interocular_mm = 66.0
    assert actions.Settings.of(bpy.context.scene).interocular_mm is None, "not while the switch is off"
    person.use_interocular = True
    assert actions.Settings.of(bpy.context.scene).interocular_mm == pytest.approx(66.0)
