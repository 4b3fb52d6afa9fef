"""Runs inside the window's Blender: installs the extension, presents the clip, then tells the driver what there is.

Everything the test does to Blender it does by mouse and keyboard; this script only prepares and watches.
"""

import ctypes
import hashlib
import importlib
import json
import os
import sys
import tempfile
import traceback
from collections.abc import Generator
from math import radians
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Euler

PACKAGE = "bl_ext.user_default.facewright"
ZIP, CLIP, STATE = (Path(os.environ[f"FACEWRIGHT_GUI_{name}"]) for name in ("ZIP", "CLIP", "STATE"))
QUESTION = STATE.with_name("question")
TICK_SECONDS = 0.05
# Blender lets the tab of a side bar be chosen only once the side bar has been drawn.
DRAWING_SECONDS = 0.5


def life() -> Generator[float, None, None]:
    """Prepare, then write the state again and again; yields how long Blender may go on meanwhile."""
    prepare_scene()
    area, _ = place("WINDOW")
    area.spaces.active.show_region_ui = True
    yield DRAWING_SECONDS
    place("UI")[1].active_panel_category = "Facewright"
    yield DRAWING_SECONDS
    look_at_the_head(area)
    with bpy.context.temp_override(window=window(), area=area):
        bpy.ops.ed.undo_push(message="Prepared")
    told: dict[str, Any] = {"tick": 0, "answered": 0}
    while True:
        told |= {"tick": told["tick"] + 1} | shown()
        if not told["running"] and question() != told["answered"]:
            told |= made() | {"answered": question()}
        write_state(told)
        yield TICK_SECONDS


def question() -> int:
    """Number of the driver's last question for all that was made; answering takes too long to do it always."""
    return int(QUESTION.read_text()) if QUESTION.exists() else 0


def window() -> bpy.types.Window:
    return bpy.context.window_manager.windows[0]


def place(kind: str) -> tuple[bpy.types.Area, bpy.types.Region]:
    """The 3D view and one of its regions."""
    area = next(area for area in window().screen.areas if area.type == "VIEW_3D")
    return area, next(region for region in area.regions if region.type == kind)


def prepare_scene() -> None:
    """The start-up cube alone, hidden; the extension from its zip; the camera from its boards; the clip."""
    bpy.ops.extensions.package_install_files(filepath=str(ZIP), repo="user_default", enable_on_install=True)
    for name in ("Camera", "Light"):
        bpy.data.objects.remove(bpy.data.objects[name])
    bpy.data.objects["Cube"].hide_set(True)
    bpy.ops.facewright.calibrate("EXEC_DEFAULT", directory=str(CLIP / "board"))
    bpy.context.scene.facewright_clip.path = str(CLIP / "frames")


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


def shown() -> dict[str, Any]:
    """What the window shows, and what the library does."""
    running = importlib.import_module(f"{PACKAGE}.modal").Running
    return {
        "height": window().height,
        "side_bar": rectangle(place("UI")[1]),
        "view": rectangle(place("WINDOW")[1]),
        "hovered": hovered(),
        "running": running.active,
        "fraction": running.fraction,
        "smile": smile(),
    }


def made() -> dict[str, Any]:
    """What there is in the file; not while the library works, as counting undo steps turns all output aside."""
    return {
        "shape_keys": {o.name: len(o.data.shape_keys.key_blocks) for o in bpy.data.objects if o.data.shape_keys},
        "data": data(),
        "undo_steps": undo_steps(),
    }


def rectangle(region: bpy.types.Region) -> list[int]:
    return [region.x, region.y, region.width, region.height]


def hovered() -> str:
    """The Python command of the button under the mouse; empty over anything else."""
    area, region = place("UI")
    with bpy.context.temp_override(window=window(), area=area, region=region):
        if not bpy.ops.ui.copy_python_command_button.poll():
            return ""
        bpy.ops.ui.copy_python_command_button()
    return bpy.context.window_manager.clipboard


def smile() -> float:
    face = bpy.data.objects.get("Face")
    return face.data.shape_keys.key_blocks["mouthSmileLeft"].value if face else 0.0


def data() -> dict[str, str | int]:
    """All that an artist would call changed: objects with their shapes, and how much of each other kind there is."""
    kinds = ("meshes", "materials", "images", "scenes", "actions", "movieclips", "collections")
    counts = {kind: len(getattr(bpy.data, kind)) for kind in kinds}
    return counts | {f"object {o.name}": shape(o.data) for o in bpy.data.objects}


def shape(mesh: bpy.types.Mesh) -> str:
    """Hash of a mesh's coordinates, those of its shape keys included."""
    digest = hashlib.sha256()
    for points in [mesh.vertices, *(block.data for block in (mesh.shape_keys.key_blocks if mesh.shape_keys else []))]:
        coordinates = np.empty(3 * len(points), np.float32)
        points.foreach_get("co", coordinates)
        digest.update(coordinates.tobytes())
    return digest.hexdigest()[:16]


def undo_steps() -> int:
    """Length of the undo history. Blender only prints it, so standard output is turned aside meanwhile."""
    flush = ctypes.CDLL(None).fflush
    sys.stdout.flush()
    flush(None)
    kept = os.dup(1)
    with tempfile.TemporaryFile() as printed:
        os.dup2(printed.fileno(), 1)
        bpy.context.window_manager.print_undo_steps()
        flush(None)
        os.dup2(kept, 1)
        os.close(kept)
        printed.seek(0)
        return sum(line.lstrip().startswith((b"[", b"*")) for line in printed)


def write_state(content: dict[str, Any]) -> None:
    """Replace the state file in one step, so that the driver never reads half of it."""
    fresh = STATE.with_suffix(".new")
    fresh.write_text(json.dumps(content))
    fresh.replace(STATE)


def guarded() -> Generator[float, None, None]:
    try:
        yield from life()
    except Exception as error:  # noqa: BLE001 — whatever it is, the driver must be told
        traceback.print_exc()
        write_state({"error": str(error).strip()})


preferences = bpy.context.preferences
preferences.view.show_splash = False
preferences.view.use_save_prompt = False
preferences.use_preferences_save = False
course = guarded()
bpy.app.timers.register(lambda: next(course, None), persistent=True)
