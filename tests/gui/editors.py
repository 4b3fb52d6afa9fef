"""Runs inside the window's Blender: makes the window's main area the editor that the test is about."""

import os
from collections.abc import Generator
from math import radians
from pathlib import Path

import bpy
from mathutils import Euler

EDITOR = os.environ["FACEWRIGHT_GUI_EDITOR"]
# Blender lets the tab of a side bar be chosen only once the side bar has been drawn.
DRAWING_SECONDS = 0.5
# The face looks into the camera there.
FRONTAL_FRAME = 11
TAIL_FRAMES = 2


def window() -> bpy.types.Window:
    return bpy.context.window_manager.windows[0]


def place(kind: str) -> tuple[bpy.types.Area, bpy.types.Region]:
    """The editor and one of its regions."""
    area = next(area for area in window().screen.areas if area.type == EDITOR)
    return area, next(region for region in area.regions if region.type == kind)


def prepare_editor(clip: Path) -> Generator[float, None, None]:
    """Show the editor with our tab open in its side bar; yields how long Blender may draw meanwhile."""
    area = next(area for area in window().screen.areas if area.type == "VIEW_3D")
    area.type = EDITOR
    if EDITOR == "CLIP_EDITOR":
        open_clip(area.spaces.active, clip)
    area.spaces.active.show_region_ui = True
    yield DRAWING_SECONDS
    place("UI")[1].active_panel_category = "Facewright"
    yield DRAWING_SECONDS
    if EDITOR == "CLIP_EDITOR":
        look_at_the_frame()
    else:
        look_at_the_head(area)


def open_clip(space: bpy.types.SpaceClipEditor, folder: Path) -> None:
    """The frames as a movie clip, which has a track of the artist's own."""
    clip = bpy.data.movieclips.load(str(min((folder / "frames").iterdir())))
    own = clip.tracking.tracks.new(name="Own", frame=1)
    own.markers[0].co = (0.9, 0.9)
    space.clip, space.mode = clip, "TRACKING"
    space.show_region_toolbar = False
    bpy.context.scene.frame_set(FRONTAL_FRAME)


def look_at_the_frame() -> None:
    """The whole frame, with what tracks will be in it as points with short tails: patterns would hide the face."""
    area, region = place("WINDOW")
    space = area.spaces.active
    space.show_marker_pattern, space.show_disabled, space.path_length = False, False, TAIL_FRAMES
    with bpy.context.temp_override(window=window(), area=area, region=region):
        bpy.ops.clip.view_all(fit_view=True)


def look_at_the_head(area: bpy.types.Area) -> None:
    """A view of where the head will be, a little from the side, without what would cross it."""
    space = area.spaces.active
    space.shading.color_type = "TEXTURE"
    space.clip_start = 0.01
    for name in ("show_cursor", "show_object_origins", "show_axis_x", "show_axis_y", "show_floor"):
        setattr(space.overlay, name, False)
    view = space.region_3d
    view.view_rotation = Euler((radians(84), 0.0, radians(18))).to_quaternion()
    view.view_location = (0.08, 0.06, -0.03)
    view.view_distance = 0.5
