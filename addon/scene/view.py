"""What the windows show of a head, and what is selected."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import radians
from typing import Any

import bpy
from mathutils import Euler, Quaternion, Vector

from .axes import FORWARD

# Editors with a side bar of ours.
SIDE_BARS = {"VIEW_3D", "CLIP_EDITOR"}
# Distance of a view from what it shows, in sizes of that.
DISTANCE = 2.5
# A new face is seen from so far above its front, and so far from its own left: both cheeks show, and the nose's form.
ABOVE, ASIDE = radians(10.0), radians(20.0)


def redraw() -> None:
    """Draw the editors with our side bars again, in all windows."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in SIDE_BARS:
                area.tag_redraw()


def present(window: bpy.types.Window) -> None:
    """Frame what is selected in the 3D views of a window, with its textures.

    A view through a camera stays as it is; so do the colours of one that shows materials or lights already.
    """
    for area in window.screen.areas:
        if area.type != "VIEW_3D":
            continue
        space = area.spaces.active
        if space.shading.type == "SOLID":
            space.shading.color_type = "TEXTURE"
        if space.region_3d.view_perspective != "CAMERA":
            region = next(region for region in area.regions if region.type == "WINDOW")
            with bpy.context.temp_override(window=window, area=area, region=region):
                bpy.ops.view3d.view_selected()


def present_wide(window: bpy.types.Window) -> None:
    """The same for what is wide, in the part of each view that the side bar leaves free."""
    with _at_once():
        present(window)
    for area in window.screen.areas:
        view = area.spaces.active.region_3d if area.type == "VIEW_3D" else None
        if view is not None and view.view_perspective != "CAMERA":
            regions = {region.type: region for region in area.regions}
            _step_aside(view, regions["WINDOW"].width, regions["UI"].width)


@contextmanager
def _at_once() -> Iterator[None]:
    """Views turn without the time that they usually take, so that they can be moved further."""
    preferences = bpy.context.preferences
    before, was_dirty = preferences.view.smooth_view, preferences.is_dirty
    preferences.view.smooth_view = 0
    try:
        yield
    finally:
        preferences.view.smooth_view = before
        preferences.is_dirty = was_dirty


def _step_aside(view: bpy.types.RegionView3D, width: int, covered: int) -> None:
    """Move a view so that its middle is in the middle of what a side bar leaves of it, both in pixels."""
    if not bpy.context.preferences.system.use_region_overlap:
        return
    view.update()
    right = view.view_rotation @ Vector((1.0, 0.0, 0.0))
    ends = [view.perspective_matrix @ place.to_4d() for place in (view.view_location, view.view_location + right)]
    pixels = (ends[1].x / ends[1].w - ends[0].x / ends[0].w) * width / 2.0
    view.view_location += right * (covered / 2.0 / pixels)


@dataclass
class Glance:
    """A look of a window's 3D views at a place, from which they can return."""

    # By views, as pointers that are compared and never followed: where each looked before, and where it was turned to.
    _turned: dict[int, tuple[Any, Any]] = field(default_factory=dict)

    def turn(self, window: bpy.types.Window, centre: Vector, size: float) -> None:
        """Look at a head of a size that stands upright; a view through a camera stays as it is."""
        for view in _views(window):
            before = _look(view)
            view.view_location, view.view_distance = centre, DISTANCE * size
            _face(view, Quaternion())
            self._turned[view.as_pointer()] = before, _look(view)

    def face(self, window: bpy.types.Window, head: Quaternion) -> None:
        """Look at a head's front as it is turned, but for views that the artist has moved since they looked there."""
        for view in _views(window):
            _, turned = self._turned.get(view.as_pointer(), (None, None))
            if turned is None or _look(view) == turned:
                _face(view, head)

    def back(self, window: bpy.types.Window) -> None:
        """Look where the views looked before, but for those that the artist has moved since."""
        for view in _views(window):
            before, turned = self._turned.get(view.as_pointer(), (None, None))
            if before is not None and _look(view) == turned:
                view.view_location, view.view_distance, view.view_rotation = before[:3], before[3], before[4:]


def _views(window: bpy.types.Window) -> Iterator[bpy.types.RegionView3D]:
    for area in window.screen.areas:
        if area.type == "VIEW_3D" and area.spaces.active.region_3d.view_perspective != "CAMERA":
            yield area.spaces.active.region_3d


def _look(view: bpy.types.RegionView3D) -> tuple[float, ...]:
    return (*view.view_location, view.view_distance, *view.view_rotation)


def _face(view: bpy.types.RegionView3D, head: Quaternion) -> None:
    """Turn a view to a head's front, with what is up in the scene upwards; one along an axis is the artist's choice."""
    if view.is_orthographic_side_view or view.lock_rotation:
        return
    before_face = Euler((FORWARD[0] - ABOVE, 0.0, ASIDE)).to_quaternion()
    view.view_rotation = (head @ before_face @ Vector((0.0, 0.0, 1.0))).to_track_quat("Z", "Y")


def select(layer: bpy.types.ViewLayer, obj: bpy.types.Object) -> bool:
    """Select an object alone and make it active; False for one in a collection that the view layer leaves out."""
    # A view layer knows nothing of new objects before.
    layer.update()
    for other in list(layer.objects.selected):
        other.select_set(False, view_layer=layer)
    # Not by its name, which a linked object may have too.
    if obj not in layer.objects.values():
        return False
    obj.select_set(True, view_layer=layer)
    layer.objects.active = obj
    return True
