"""What tests of controls press and look at."""

from typing import Any

import bpy
from people import select
from test_keys import FACE, values
from tracking import module


def add(skin: bpy.types.Object) -> bpy.types.Object:
    """Press the button; gives the armature."""
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    select(skin)
    assert FACE.add_controls() == {"FINISHED"}
    return armature(skin)


def remove(skin: bpy.types.Object) -> None:
    assert FACE.remove_controls() == {"FINISHED"}
    assert armature(skin) is None


def armature(skin: bpy.types.Object) -> Any:
    return module("scene.controls_find").of(skin)


def bone(skin: bpy.types.Object, role: str) -> bpy.types.PoseBone:
    return module("scene.controls_find").bones(armature(skin))[role]


def layout() -> Any:
    return module("scene.controls_layout")


def over(skin: bpy.types.Object, times: list[float]) -> list[dict[str, float]]:
    """All keys at times of the timeline."""
    found = []
    for moment in times:
        bpy.context.scene.frame_set(int(moment), subframe=moment - int(moment))
        found.append(values(skin))
    return found


def largest(some: list[dict[str, float]], others: list[dict[str, float]]) -> float:
    return max(abs(a[name] - b[name]) for a, b in zip(some, others) for name in a)


def target(skin: bpy.types.Object, place: tuple[float, float, float]) -> None:
    """Put the gaze target to a place in the skin's coordinates, and let the eyes follow it."""
    eyes = bone(skin, "eyes")
    eyes["follow"] = 1.0
    eyes.location = eyes.bone.matrix_local.inverted() @ module("scene.controls_bones").Vector(place)
    armature(skin).update_tag()
    bpy.context.view_layer.update()
