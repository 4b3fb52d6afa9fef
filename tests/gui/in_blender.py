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
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Vector

sys.path.insert(0, str(Path(__file__).parent))
from editors import EDITOR, OPEN, WORDS, areas, is_fresh, open_panels, place, prepare_editor, window
from everywhere import heads_at_this_frame, hovered, seen_everywhere, worn
from windows import obey

PACKAGE = "bl_ext.user_default.facewright"
ZIP, CLIP, STATE = (Path(os.environ[f"FACEWRIGHT_GUI_{name}"]) for name in ("ZIP", "CLIP", "STATE"))
QUESTION, ORDER = STATE.with_name("question"), STATE.with_name("order")
TICK_SECONDS = 0.05


def life() -> Generator[float, None, None]:
    """Prepare, then write the state again and again; yields how long Blender may go on meanwhile."""
    if not is_fresh():
        prepare_scene()
        yield from prepare_editor(CLIP)
        with bpy.context.temp_override(window=window(), area=place("WINDOW")[0]):
            bpy.ops.ed.undo_push(message="Prepared")
    told: dict[str, Any] = {"tick": 0, "answered": 0, "ordered": 0}
    while True:
        told["ordered"] = obey(ORDER, told["ordered"])
        told |= {"tick": told["tick"] + 1} | shown()
        if not told["running"] and question() != told["answered"]:
            told |= made() | {"answered": question()}
        write_state(told)
        yield TICK_SECONDS


def question() -> int:
    """Number of the driver's last question for all that was made; answering takes too long to do it always."""
    return int(QUESTION.read_text()) if QUESTION.exists() else 0


def prepare_scene() -> None:
    """The start-up cube alone, hidden; the extension from its zip; the camera from its boards; the clip."""
    bpy.ops.extensions.package_install_files(filepath=str(ZIP), repo="user_default", enable_on_install=True)
    if OPEN in WORDS:
        open_panels(importlib.import_module(f"{PACKAGE}.registration").CLASSES)
    for name in ("Camera", "Light"):
        bpy.data.objects.remove(bpy.data.objects[name])
    bpy.data.objects["Cube"].hide_set(True)
    bpy.ops.facewright.calibrate("EXEC_DEFAULT", directory=str(CLIP / "board"))
    bpy.context.scene.facewright_clip.path = str(CLIP / "frames")


def shown() -> dict[str, Any]:
    """What the window shows, and what the library does."""
    told = {"height": window().height, "hovered": hovered(), "mode": bpy.context.mode} | work() | seen_everywhere()
    told |= {"smiles": smiles(), "camera": bpy.context.scene.camera.name if bpy.context.scene.camera else ""}
    # Instead of the editor there may be a file browser now.
    return told | (editor() if areas(EDITOR) else {})


def work() -> dict[str, Any]:
    """What the library does, or did last; nothing before the extension is there."""
    if PACKAGE not in bpy.context.preferences.addons:
        return {"installed": False, "running": False, "stage": "", "fraction": 0.0, "step": None}
    running = importlib.import_module(f"{PACKAGE}.running").Running
    return {
        "installed": True,
        "running": running.active,
        # Of what runs, or ran last.
        "stage": running.progress.stage,
        "fraction": running.progress.fraction,
        "step": running.progress.step,
        "sketched": importlib.import_module(f"{PACKAGE}.scene.sketch").Sketch.drawn is not None,
        "clip": chosen(),
        "head": bpy.context.scene.facewright_clip.head,
    }


def editor() -> dict[str, Any]:
    """Where the editor is, and what the 3D views show."""
    area, side_bar = place("UI")
    return {
        "side_bar": rectangle(side_bar),
        "tab": side_bar.active_panel_category if side_bar.width > 1 else "",
        "editor": rectangle(area),
        "looks": [look(area.spaces.active.region_3d) for area in areas("VIEW_3D")],
        "handle": handle(),
        "colours": [area.spaces.active.shading.color_type for area in areas("VIEW_3D")],
        "heads_seen": [seen(area) for area in areas("VIEW_3D")],
        "views": [area.spaces.active.region_3d.view_perspective for area in areas("VIEW_3D")],
    }


def chosen() -> dict[str, Any]:
    """What of the clip is used, whether it was looked at, and how many frames the heads were given."""
    settings = bpy.context.scene.facewright_clip
    skins = [obj for obj in bpy.data.objects if obj.get("facewright_part") == "skin"]
    return {
        "part": [settings.first, settings.last] if settings.use_range else None,
        "left_out": settings.left_out,
        "looked": importlib.import_module(f"{PACKAGE}.clip.actions").strip_of(settings) is not None,
        "given": [len(json.loads(skin["facewright_report"])["frames"]) for skin in skins],
    }


def made() -> dict[str, Any]:
    """What there is in the file; not while the library works, as counting undo steps turns all output aside."""
    return {
        "shape_keys": {mesh.name: len(mesh.shape_keys.key_blocks) for mesh in bpy.data.meshes if mesh.shape_keys},
        "tracks": {name: len(o.tracks) for name, o in tracking_objects().items()},
        "data": data(),
        "undo_steps": undo_steps(),
        "held": {scene.name: [obj.name for obj in scene.objects] for scene in bpy.data.scenes},
        "boxes": heads_at_this_frame(),
        "worn": worn(),
    }


def rectangle(part: bpy.types.Area | bpy.types.Region) -> list[int]:
    return [part.x, part.y, part.width, part.height]


def seen(area: bpy.types.Area) -> float:
    """The part of a 3D view's height that the first head takes; 0 where it is not wholly in it, or behind something."""
    skin = next((obj for obj in bpy.data.objects if obj.get("facewright_part") == "skin"), None)
    if skin is None or hidden(skin, area):
        return 0.0
    to_view = area.spaces.active.region_3d.perspective_matrix @ skin.matrix_world
    places = [to_view @ vertex.co.to_4d() for vertex in list(skin.data.vertices)[::20]]
    # Both ways from -1 to 1 in the view.
    if any(p.w <= 0.0 or abs(p.x) > p.w or abs(p.y) > p.w for p in places):
        return 0.0
    heights = [p.y / p.w for p in places]
    return (max(heights) - min(heights)) / 2.0


def look(view: bpy.types.RegionView3D) -> list[float]:
    """Where a 3D view looks, and from how far."""
    return [*view.view_location, view.view_distance]


def hidden(skin: bpy.types.Object, area: bpy.types.Area) -> bool:
    """Whether something stands between the eye of a 3D view and a head."""
    eye = area.spaces.active.region_3d.view_matrix.inverted().translation
    middle = skin.matrix_world @ (sum((Vector(corner) for corner in skin.bound_box), Vector()) / 8)
    graph = bpy.context.evaluated_depsgraph_get()
    met = bpy.context.scene.ray_cast(graph, eye, (middle - eye).normalized())
    return met[0] and not met[4].get("facewright_part")


def smiles() -> dict[str, float]:
    """How much each head smiles, by the names of their skins."""
    skins = [obj for obj in bpy.data.objects if obj.get("facewright_part") == "skin"]
    return {skin.name: skin.data.shape_keys.key_blocks["mouthSmileLeft"].value for skin in skins}


def handle() -> list[int]:
    """Where in the window the handle of the mouth's left corner is, from its lower left; empty without controls."""
    rig = next((obj for obj in bpy.data.objects if obj.type == "ARMATURE"), None)
    view = areas("VIEW_3D")[:1]
    if rig is None or not view:
        return []
    bone = next(pose for pose in rig.pose.bones if pose.bone.get("facewright_role") == "lips.L")
    region = next(region for region in view[0].regions if region.type == "WINDOW")
    place = view[0].spaces.active.region_3d.perspective_matrix @ (rig.matrix_world @ bone.head).to_4d()
    # Both ways from -1 to 1 in the view.
    across, up = (0.5 + 0.5 * part / place.w for part in place[:2])
    return [region.x + round(across * region.width), region.y + round(up * region.height)]


def data() -> dict[str, str | int]:
    """All that an artist would call changed: shapes, keys, tracks, and how much of each other kind there is."""
    kinds = ("meshes", "cameras", "materials", "node_groups", "images", "scenes", "movieclips", "collections")
    counts = {kind: len(getattr(bpy.data, kind)) for kind in kinds}
    objects = {f"object {o.name}": described(o) for o in bpy.data.objects}
    actions = {f"action {action.name}": keys(action) for action in bpy.data.actions}
    clips = {f"clip {clip.name}": fingerprint([*clip.items(), lens(clip)]) for clip in bpy.data.movieclips}
    tracks = {f"tracks {name}": markers(o) for name, o in tracking_objects().items()}
    pictures = {f"image {picture.name}": pixels(picture) for picture in bpy.data.images}
    return counts | objects | actions | clips | tracks | pictures | {"scene": set_in(bpy.context.scene)}


def described(obj: bpy.types.Object) -> str:
    """What an object is: of a mesh its shape, place and report, of another its kind and what carries it."""
    if obj.type == "MESH":
        place = [round(value, 5) for value in obj.matrix_basis.translation]
        return f"{shape(obj.data)} at {place}, reported {fingerprint(obj.get('facewright_report'))}"
    return f"{obj.type} below {obj.parent.name}" if obj.parent else obj.type


def keys(action: bpy.types.Action) -> str:
    return fingerprint([(c.data_path, c.array_index, [k.co[:] for k in c.keyframe_points]) for c in action.fcurves])


def lens(clip: bpy.types.MovieClip) -> list[float]:
    camera = clip.tracking.camera
    return [camera.focal_length, *camera.principal_point, camera.k1, camera.k2, camera.k3]


def set_in(scene: bpy.types.Scene) -> str:
    """The scene's camera, the size of its pictures and its frames."""
    render, eye = scene.render, scene.camera.name if scene.camera else "no camera"
    return f"{eye}, {render.resolution_x} × {render.resolution_y}, {scene.frame_start}–{scene.frame_end}"


def tracking_objects() -> dict[str, bpy.types.MovieTrackingObject]:
    return {o.name: o for clip in bpy.data.movieclips for o in clip.tracking.objects}


def markers(tracked: bpy.types.MovieTrackingObject) -> str:
    """Hash of the names and markers of all tracks of a tracking object."""
    return fingerprint([(track.name, [(m.frame, *m.co, m.mute) for m in track.markers]) for track in tracked.tracks])


def fingerprint(content: object) -> str:
    return hashlib.sha256(repr(content).encode()).hexdigest()[:16]


def shape(mesh: bpy.types.Mesh) -> str:
    """Hash of a mesh's coordinates, those of its shape keys included."""
    digest = hashlib.sha256()
    for points in [mesh.vertices, *(block.data for block in (mesh.shape_keys.key_blocks if mesh.shape_keys else []))]:
        coordinates = np.empty(3 * len(points), np.float32)
        points.foreach_get("co", coordinates)
        digest.update(coordinates.tobytes())
    return digest.hexdigest()[:16]


def pixels(picture: bpy.types.Image) -> str:
    """Hash of what an image shows, and where a head wears it."""
    levels = np.empty(len(picture.pixels), np.float32)
    picture.pixels.foreach_get(levels)
    wearers = sorted(obj.name for obj in bpy.data.objects if obj.get("facewright_picture") == picture)
    return f"{hashlib.sha256(levels.tobytes()).hexdigest()[:16]} on {', '.join(wearers)}"


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
# A fresh Blender keeps what it was set to, as a user's does: the extension must still be there when it starts again.
preferences.use_preferences_save = is_fresh()
if is_fresh():
    preferences.view.filebrowser_display_type = "SCREEN"
course = guarded()
bpy.app.timers.register(lambda: next(course, None), persistent=True)
