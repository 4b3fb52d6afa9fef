"""Runs inside the window's Blender: makes the window's main area the editors that the test is about."""

import os
from collections.abc import Generator, Iterable
from math import radians
from pathlib import Path
from typing import Any

import bpy
from mathutils import Euler

# This word among the editors: all panels are open, as an artist may have left them.
OPEN = "OPEN"
WORDS = os.environ["FACEWRIGHT_GUI_EDITORS"].split()
# The test is about the first; another one is shown beside it. None: Blender as it starts.
EDITORS = [word for word in WORDS if word != OPEN]
EDITOR, *BESIDE = EDITORS or ["VIEW_3D"]
# Blender lets the tab of a side bar be chosen only once the side bar has been drawn.
DRAWING_SECONDS = 0.5
# The face looks into the camera there.
FRONTAL_FRAME = 11
TAIL_FRAMES = 2
# Blender's number for a camera's frame as wide as the view.
FILLED_ZOOM = 29.0


def is_fresh() -> bool:
    """Whether the test begins with Blender as it is after it was installed, without our extension."""
    return not EDITORS


def window() -> bpy.types.Window:
    return bpy.context.window_manager.windows[0]


def areas(kind: str) -> list[bpy.types.Area]:
    return [area for area in window().screen.areas if area.type == kind]


def place(kind: str) -> tuple[bpy.types.Area, bpy.types.Region]:
    """The editor and one of its regions."""
    area = areas(EDITOR)[0]
    return area, next(region for region in area.regions if region.type == kind)


def prepare_editor(clip: Path) -> Generator[float, None, None]:
    """Show the editor with our tab open in its side bar; yields how long Blender may draw meanwhile."""
    area = areas("VIEW_3D")[0]
    if BESIDE:
        look_at_the_points(split(area, BESIDE[0]))
        set_own_camera()
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


def open_panels(classes: Iterable[type]) -> None:
    """Let the panels among some classes be open when they are drawn first: Blender has no other way but the mouse."""
    panels: list[Any] = [cls for cls in classes if issubclass(cls, bpy.types.Panel)]
    for cls in reversed(panels):
        bpy.utils.unregister_class(cls)
    for cls in panels:
        cls.bl_options = set(getattr(cls, "bl_options", ())) - {"DEFAULT_CLOSED"}
        bpy.utils.register_class(cls)


def split(area: bpy.types.Area, other: str) -> bpy.types.Area:
    """Give half of an area to another editor; gives that half."""
    known = set(window().screen.areas)
    with bpy.context.temp_override(window=window(), area=area):
        bpy.ops.screen.area_split(direction="VERTICAL", factor=0.5)
    (half,) = set(window().screen.areas) - known
    half.type = other
    return half


def set_own_camera() -> None:
    """A scene's camera that is the artist's own."""
    eye = bpy.data.objects.new("Own Camera", bpy.data.cameras.new("Own Camera"))
    bpy.context.scene.collection.objects.link(eye)
    eye.hide_set(True)
    bpy.context.scene.camera = eye


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


def look_at_the_points(area: bpy.types.Area) -> None:
    """The same for points: as small as they are here, black outlines would hide their colours."""
    look_at_the_head(area)
    space = area.spaces.active
    space.shading.show_object_outline, space.show_region_toolbar = False, False
    # What the camera sees fills the view.
    space.region_3d.view_camera_zoom = FILLED_ZOOM
