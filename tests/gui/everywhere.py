"""Runs inside the window's Blender: what is under the mouse in any window, and what the hour's test asks."""

import json
from collections.abc import Iterator
from typing import Any

import bpy
import numpy as np
from mathutils import Vector

Place = tuple[bpy.types.Window, bpy.types.Area, bpy.types.Region]


def places() -> Iterator[Place]:
    """Every region that is seen, in every window."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions:
                if region.width > 1 and region.height > 1:
                    yield window, area, region


def hovered() -> str:
    """The Python command of the button under the mouse, or the path of its property; empty over anything else."""
    return next((found for place in places() if (found := hovered_in(*place))), "")


def hovered_in(window: bpy.types.Window, area: bpy.types.Area, region: bpy.types.Region) -> str:
    with bpy.context.temp_override(window=window, area=area, region=region):
        if bpy.ops.ui.copy_python_command_button.poll():
            bpy.ops.ui.copy_python_command_button()
        elif bpy.ops.ui.copy_data_path_button.poll():
            bpy.ops.ui.copy_data_path_button(full_path=True)
        else:
            return ""
    return bpy.context.window_manager.clipboard


def seen_everywhere() -> dict[str, Any]:
    """What the windows show beside the editor of the test, and what the heads are set to."""
    files = [area.spaces.active.params for _, area, _ in places() if area.type == "FILE_BROWSER"]
    return {
        "regions": {f"{area.type} {region.type}": rectangle(window, region) for window, area, region in places()},
        "section": bpy.context.preferences.active_section,
        "windows": len(bpy.context.window_manager.windows),
        "file": bpy.data.filepath,
        "is_saved": bool(bpy.data.filepath) and not bpy.data.is_dirty,
        "folder": files[0].directory.decode() if files and files[0] else "",
        "file_name": files[0].filename if files and files[0] else "",
        "frame": bpy.context.scene.frame_current,
        "auto_keying": bpy.context.scene.tool_settings.use_keyframe_insert_auto,
        "active": bpy.context.view_layer.objects.active.name if bpy.context.view_layer.objects.active else "",
        "heads_at": {skin.name: at for skin in skins() if (at := on_screen(skin))},
        "values": {skin.name: values(skin) for skin in skins()},
        "poses": {skin.name: json.loads(skin.get("facewright_expressions", "{}")) for skin in skins()},
    }


def rectangle(window: bpy.types.Window, region: bpy.types.Region) -> list[int]:
    """Left, bottom, width and height of a region on the screen, from its lower left corner."""
    return [window.x + region.x, window.y + region.y, region.width, region.height]


def skins() -> list[bpy.types.Object]:
    return [obj for obj in bpy.data.objects if obj.get("facewright_part") == "skin"]


def on_screen(skin: bpy.types.Object) -> list[int] | None:
    """Where a head is on the screen, from its lower left corner; None where the first 3D view does not show it."""
    views = [(w, a, r) for w, a, r in places() if a.type == "VIEW_3D" and r.type == "WINDOW"]
    if not views:
        return None
    window, area, region = views[0]
    middle = skin.matrix_world @ (sum((Vector(corner) for corner in skin.bound_box), Vector()) / 8)
    at = area.spaces.active.region_3d.perspective_matrix @ middle.to_4d()
    # From -1 to 1 in the view.
    if at.w <= 0.0 or abs(at.x) > at.w or abs(at.y) > at.w:
        return None
    x, y = (1.0 + at.x / at.w) / 2.0, (1.0 + at.y / at.w) / 2.0
    return [window.x + region.x + int(x * region.width), window.y + region.y + int(y * region.height)]


def values(skin: bpy.types.Object) -> dict[str, float]:
    """The values of a face's shape keys."""
    keys = skin.data.shape_keys
    return {block.name: block.value for block in keys.key_blocks[1:]} if keys else {}


def heads_at_this_frame() -> dict[str, list[float]]:
    """The box around each part of the heads as it is now, in the world: least and greatest x, y and z in metres."""
    graph = bpy.context.evaluated_depsgraph_get()
    return {obj.name: box(obj.evaluated_get(graph)) for obj in bpy.data.objects if obj.get("facewright_part")}


def box(shown: bpy.types.Object) -> list[float]:
    mesh = shown.to_mesh()
    flat = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", flat)
    place = np.array(shown.matrix_world, np.float64)
    points = flat.reshape(-1, 3) @ place[:3, :3].T + place[:3, 3]
    shown.to_mesh_clear()
    return [*points.min(axis=0).tolist(), *points.max(axis=0).tolist()]


def worn() -> dict[str, str]:
    """The materials of each part of the heads, with the pictures that they show."""
    parts = [obj for obj in bpy.data.objects if obj.get("facewright_part")]
    return {f"worn by {obj.name}": ", ".join(map(shown_by, obj.data.materials)) for obj in parts}


def shown_by(material: bpy.types.Material) -> str:
    pictures = [node.image for node in material.node_tree.nodes if node.type == "TEX_IMAGE" and node.image]
    return f"{material.name} with {[picture.name for picture in pictures]}"
