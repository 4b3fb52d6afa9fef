"""The drivers that let bones lead keys: simple expressions, which Blender runs with scripts turned off too."""

import bpy

from .controls_find import FOLLOW, reach
from .controls_layout import AIMS, EYES, GAZE, LINKS
from .controls_measure import Aim

# Nearer to the eyes' plane, metres, a target is before them: they cannot look back.
NEAREST = 0.001


def drive(
    block: bpy.types.ShapeKey, armature: bpy.types.Object, found: dict[str, bpy.types.PoseBone], aims: dict[str, Aim]
) -> None:
    """Let the bones of an armature set a key, in place of a driver that it has."""
    link, name = LINKS[block.name], block.name
    block.driver_remove("value")
    driver = block.driver_add("value").driver
    driver.type = "SCRIPTED"
    pose = found[link.axis.role]
    expression = f"min({reach(armature, name):.9g},max(0,h*{1.0 / link.full:.9g}))+r"
    _read(driver, "h", armature, f"{pose.path_from_id(link.axis.channel)}[{link.axis.index}]")
    _read(driver, "r", armature, f'{pose.path_from_id()}["{name}"]')
    side = "Left" if name.endswith("Left") else "Right"
    if name in GAZE and all(key in aims for key in _of_eye(side)) and AIMS[side] in found and EYES in found:
        for variable, axis in (("x", "LOC_X"), ("y", "LOC_Z"), ("z", "LOC_Y")):
            _read_place(driver, variable, armature, found[AIMS[side]].name, axis)
        _read(driver, "f", armature, f'{found[EYES].path_from_id()}["{FOLLOW}"]')
        expression = f"({expression})*(1-f)+f*{_aimed(name, side, aims)}"
    driver.expression = expression


def _aimed(name: str, side: str, aims: dict[str, Aim]) -> str:
    """The value that brings the eye to the target at x, y and z, from its centre to its left, forward and up.

    A key moves what looks forward by the same step for each part of its value: with values a and b of a key sideways
    and one upwards the eye looks along (a·aside, 1 + a·back + b·back, b·aside).
    """
    parts = {}
    for key in _of_eye(side):
        way = key.removeprefix("eyeLook").removesuffix(side)
        is_positive = way == "Up" or (way == "Out") == (side == "Left") and way != "Down"
        parts[key] = f"max(0,{'' if is_positive else '-'}{'z' if way in ('Up', 'Down') else 'x'})"
    back = "".join(f"+{parts[key]}*{-aims[key].back / aims[key].aside:.5g}" for key in parts)
    return f"{parts[name]}/{aims[name].aside:.5g}/(max({NEAREST},y){back})"


def _of_eye(side: str) -> list[str]:
    return [key for key in GAZE if key.endswith(side)]


def _read(driver: bpy.types.Driver, name: str, armature: bpy.types.Object, path: str) -> None:
    variable = driver.variables.new()
    variable.name = name
    variable.targets[0].id, variable.targets[0].data_path = armature, path


def _read_place(driver: bpy.types.Driver, name: str, armature: bpy.types.Object, bone: str, axis: str) -> None:
    variable = driver.variables.new()
    variable.name, variable.type = name, "TRANSFORMS"
    target = variable.targets[0]
    target.id, target.bone_target = armature, bone
    target.transform_type, target.transform_space = axis, "LOCAL_SPACE"
