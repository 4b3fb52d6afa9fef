"""How far the keys of the gaze go: a whole one turns an eye by 10 to 15 degrees only, less than people look aside."""

import json
from collections.abc import Iterable, Iterator

import bpy

from .controls_layout import GAZE
from .keys import key_channel

# Twice a whole key is some 29 degrees sideways, 20 up and 22 down.
FARTHEST = 2.0
# Of an armature's data: the limits that the skin's keys had, a JSON object.
LIMITS = "facewright_limits"


def widen(skin: bpy.types.Object, objects: Iterable[bpy.types.Object], armature: bpy.types.Object) -> None:
    """Let the keys of the gaze go as far as the target can bring them, on the skin and on what follows it."""
    known = json.loads(armature.data.get(LIMITS, "{}"))
    armature.data[LIMITS] = json.dumps({block.name: block.slider_max for block in _of_gaze(skin)} | known)
    for block in (block for obj in objects for block in _of_gaze(obj)):
        block.slider_max = max(block.slider_max, FARTHEST)


def narrow(skin: bpy.types.Object, objects: Iterable[bpy.types.Object], armature: bpy.types.Object | None) -> None:
    """Give the keys of the gaze their limits back, but for those whose value or keyframes are beyond them."""
    known = json.loads(armature.data.get(LIMITS, "{}")) if armature is not None else {}
    limits = {block.name: float(known.get(block.name, 1.0)) for block in _of_gaze(skin)}
    beyond = {block.name for block in _of_gaze(skin) if _highest(block) > limits[block.name]}
    for block in (block for obj in objects for block in _of_gaze(obj)):
        if block.slider_max == FARTHEST and block.name in limits.keys() - beyond:
            block.slider_max = limits[block.name]


def _of_gaze(obj: bpy.types.Object) -> Iterator[bpy.types.ShapeKey]:
    keys = obj.data.shape_keys
    if keys is not None:
        yield from (keys.key_blocks[name] for name in GAZE if name in keys.key_blocks)


def _highest(block: bpy.types.ShapeKey) -> float:
    """The greatest value of a key, now and at its keyframes."""
    curve = key_channel(block).curve
    return max([block.value, *(point.co.y for point in curve.keyframe_points)] if curve is not None else [block.value])
