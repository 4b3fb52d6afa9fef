"""The list of heads as tests use it: what it says, its clicks and buttons, and all that a file shows of its heads."""

import hashlib
from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
from people import (
    head_of,
    select,
)
from tracking import drawn, module

OPERATORS = ("duplicate_head", "remove_head", "mark_head")


def listed() -> str:
    """What the panel of the list says."""
    return drawn("FACEWRIGHT_PT_heads", object=bpy.context.object, mode=bpy.context.mode)


def row(skin: bpy.types.Object) -> int:
    """The number of a head in the list."""
    return list(bpy.context.scene.objects).index(skin)


def click(skin: bpy.types.Object) -> None:
    bpy.context.scene.facewright_heads.index = row(skin)


def duplicate(skin: bpy.types.Object) -> bpy.types.Object:
    select(skin)
    assert bpy.ops.facewright.duplicate_head() == {"FINISHED"}
    return bpy.context.object


def remove(skin: bpy.types.Object) -> None:
    select(skin)
    assert bpy.ops.facewright.remove_head() == {"FINISHED"}


def used_by(skin: bpy.types.Object) -> set[bpy.types.ID]:
    """All that a head has."""
    objects = head_of(skin).objects
    belongings = module("scene.belongings")
    return {*objects, *belongings.keys_of(objects), *belongings.everything(objects), head_of(skin).home}


def hashes() -> dict[str, str]:
    """What of a file an artist would see: shapes at rest and of keys, places, pictures and their small ones, names."""
    found: dict[str, Any] = {"next": bpy.context.scene.facewright_clip.wanted}
    for mesh in bpy.data.meshes:
        blocks = mesh.shape_keys.key_blocks if mesh.shape_keys else []
        for name, points in [("", mesh.vertices), *((block.name, block.data) for block in blocks)]:
            places = np.empty(3 * len(points), np.float32)
            points.foreach_get("co", places)
            found[f"mesh {mesh.name} {name}"] = places.tobytes()
        found[f"values {mesh.name}"] = [block.value for block in blocks]
    for picture in bpy.data.images:
        pixels = np.empty(len(picture.pixels), np.float32)
        picture.pixels.foreach_get(pixels)
        found[f"image {picture.name}"] = pixels.tobytes()
    for obj in bpy.data.objects:
        shows = [slot.material.name for slot in obj.material_slots]
        found[f"object {obj.name}"] = (obj.data.name, tuple(obj.location), shows, sorted(obj.items(), key=str))
    for home in bpy.data.collections:
        small = list(home.preview.image_pixels) if home.preview is not None else []
        found[f"collection {home.name}"] = (sorted(home.objects.keys()), home.asset_data is not None, small)
    return {name: hashlib.sha256(repr(value).encode()).hexdigest() for name, value in found.items()}


def assert_is_one_step(act: Callable[[], Any]) -> None:
    """Doing it, undoing and redoing it give what there was before and after."""
    bpy.ops.ed.undo_push(message="Before")
    before = hashes()
    act()
    after = hashes()
    assert after != before
    bpy.ops.ed.undo()
    assert hashes() == before, "undone"
    bpy.ops.ed.redo()
    assert hashes() == after, "redone"
