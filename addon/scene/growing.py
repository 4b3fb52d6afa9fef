"""A new head in a window while it is being made: where it will stand, and seen."""

import bpy
from mathutils import Vector

from ..engine import generic_head
from . import heads
from .axes import to_blender
from .sketch import Positions, Sketch
from .standing import free_place
from .view import Glance


class Growing:
    """The head of some work: sketched in the scene in which that began, looked at until it ends."""

    def __init__(self, scene: bpy.types.Scene, glance: Glance) -> None:
        # Undo makes other data of the scene; its number stays.
        self._scene = scene.session_uid
        self._sketch: Sketch | None = None
        self._glance = glance

    def show(self, window: bpy.types.Window, positions: Positions) -> None:
        """Draw it as far as it is, (n, 3) in the head frame, metres. The first time the views turn to its place."""
        scene = window.scene
        if scene.session_uid != self._scene:
            return
        if self._sketch is None:
            shape = to_blender(positions)
            skins = [head.skin for head in heads.heads(scene) if head.skin is not None]
            place = free_place(scene, shape, skins, set())
            self._sketch = Sketch(scene, generic_head(), place)
            low, high = shape.min(axis=0), shape.max(axis=0)
            self._glance.turn(window, place + Vector((low + high) / 2.0), float((high - low).max()))
        self._sketch.show(positions)

    def end(self, window: bpy.types.Window | None, cancelled: bool) -> None:
        """Take it away, and let the views look where they did where nothing takes its place."""
        if self._sketch is not None:
            self._sketch.end()
        if cancelled and window is not None:
            self._glance.back(window)
