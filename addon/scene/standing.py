"""Where a new head stands, so that it is seen: at the 3D cursor, beside other heads, before what is in its place."""

from collections.abc import Iterable
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from .controls_find import of

# Between a new head and the one that stands farthest to the left of its subject, metres.
BESIDE = 0.3
# What the panel of a head's handles takes beside it.
PANEL = 0.2
# Between a new head and what it stands before, metres: a view from there is not blocked.
BEFORE = 0.2
# What is longer, in metres, is not in a head's place but around it: a room, a floor, a sky.
SURROUNDINGS = 3.0


@dataclass(frozen=True)
class Box:
    """Axes-parallel, in metres."""

    low: NDArray[np.float64]
    high: NDArray[np.float64]

    def meets(self, other: "Box") -> bool:
        return bool(np.all(self.low < other.high) and np.all(other.low < self.high))

    def at(self, place: Vector) -> "Box":
        return Box(self.low + np.array(place), self.high + np.array(place))


def free_place(
    scene: bpy.types.Scene,
    positions: NDArray[np.float32],
    skins: Iterable[bpy.types.Object],
    own: set[bpy.types.Object],
) -> Vector:
    """Where to stand with (n, 3) vertices in Blender's axes, in a scene that has the skins of other heads already."""
    for layer in scene.view_layers:
        # Where things are after what was moved just now.
        layer.update()
    place = scene.cursor.location.copy()
    neighbour = max(skins, key=lambda skin: skin.matrix_world.translation.x, default=None)
    if neighbour is not None:
        aside = BESIDE + (PANEL if of(neighbour) is not None else 0.0)
        place = neighbour.matrix_world.translation + Vector((aside, 0.0, 0.0))
    head = Box(positions.min(axis=0).astype(np.float64), positions.max(axis=0).astype(np.float64))
    boxes = _in_the_way(scene, own)
    while met := [box for box in boxes if box.meets(head.at(place))]:
        place.y = min(box.low[1] for box in met) - head.high[1] - BEFORE
    return place


def _in_the_way(scene: bpy.types.Scene, own: set[bpy.types.Object]) -> list[Box]:
    """What can be seen in a scene and is no larger than things are."""
    layers = scene.view_layers
    seen = [obj for obj in scene.objects if obj not in own and any(obj.visible_get(view_layer=v) for v in layers)]
    boxes = [_box(obj) for obj in seen if _is_solid(obj)]
    return [box for box in boxes if (box.high - box.low).max() <= SURROUNDINGS]


def _is_solid(obj: bpy.types.Object) -> bool:
    """Whether an object hides what is in it; points, as those of a motion, do not."""
    return bool(obj.data.polygons) if obj.type == "MESH" else obj.type in {"CURVE", "SURFACE", "META", "FONT", "VOLUME"}


def _box(obj: bpy.types.Object) -> Box:
    corners = np.array([obj.matrix_world @ Vector(corner) for corner in obj.bound_box], np.float64)
    return Box(corners.min(axis=0), corners.max(axis=0))
