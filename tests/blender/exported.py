"""What tests of exports compare: how a head moves, what a file is like after it was read back, and all of a scene."""

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from conftest import snapshot
from numpy.typing import NDArray
from people import head_of

# (vertices, frames × 3) places of vertices in the world at all compared frames.
Paths = NDArray[np.float64]
FRAMES = (1, 20, 40)
MOVED = ("jawOpen", "eyeBlinkLeft", "eyeLookInLeft", "tongueOut", "mouthFunnel")

READERS: dict[str, Callable[[str], Any]] = {
    # A ball that would show bones is no part of a file.
    ".glb": lambda path: bpy.ops.import_scene.gltf(filepath=path, disable_bone_shape=True),
    # Both of Blender's FBX importers take time 0 for frame 1 unless they are told.
    ".fbx": lambda path: bpy.ops.import_scene.fbx(filepath=path, anim_offset=0.0),
    ".usdc": lambda path: bpy.ops.wm.usd_import(filepath=path),
    ".usdz": lambda path: bpy.ops.wm.usd_import(filepath=path),
    ".abc": lambda path: bpy.ops.wm.alembic_import(filepath=path, as_background_job=False),
}


def animate(skin: bpy.types.Object) -> None:
    """Keys on some of the skin's shape keys, and on its place and rotation, at the compared frames."""
    blocks = skin.data.shape_keys.key_blocks
    for frame, value, turn in zip(FRAMES, (0.0, 1.0, 0.3), (0.0, 0.5, -0.2)):
        for name in MOVED:
            blocks[name].value = value
            blocks[name].keyframe_insert("value", frame=frame)
        skin.location, skin.rotation_euler = (turn, 0.2 * turn, 0.1), (0.1, 0.2 * turn, turn)
        skin.keyframe_insert("location", frame=frame)
        skin.keyframe_insert("rotation_euler", frame=frame)


def paths(skin: bpy.types.Object) -> dict[str, Paths]:
    """How the parts of a head move; the frame stays."""
    now = bpy.context.scene.frame_current
    found = _paths(head_of(skin).parts)
    bpy.context.scene.frame_set(now)
    return found


def read_back(file: Path) -> dict[str, Paths]:
    """How the meshes of a file move, by their names; the file is read into an empty scene."""
    bpy.ops.wm.read_homefile(use_empty=True)
    assert READERS[file.suffix](str(file)) == {"FINISHED"}
    return _paths({obj.data.name: obj for obj in bpy.data.objects if obj.type == "MESH"})


def _paths(objects: dict[str, bpy.types.Object]) -> dict[str, Paths]:
    at: dict[str, list[Paths]] = {name: [] for name in objects}
    for frame in FRAMES:
        bpy.context.scene.frame_set(frame)
        for name, obj in objects.items():
            at[name].append(world(obj))
    return {name: np.concatenate(places, axis=1) for name, places in at.items()}


def world(obj: bpy.types.Object) -> Paths:
    """(n, 3) vertices of an object as it is now, in the world."""
    shown = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = shown.to_mesh()
    flat = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", flat)
    place = np.array(shown.matrix_world, np.float64)
    return flat.reshape(-1, 3) @ place[:3, :3].T + place[:3, 3]


def apart_mm(found: Paths, truth: Paths) -> float:
    """How far a vertex of either is at most from the one of the other that moves most as it does."""
    return 1e3 * max(_farthest(found, truth), _farthest(truth, found))


def _farthest(some: Paths, others: Paths) -> float:
    return max(float(_nearest(part, others).max()) for part in np.array_split(some, len(some) // 256 + 1))


def _nearest(some: Paths, others: Paths) -> NDArray[np.float64]:
    squared = (some**2).sum(axis=1)[:, None] + (others**2).sum(axis=1) - 2.0 * some @ others.T
    gaps = np.abs(some - others[squared.argmin(axis=1)]).reshape(len(some), -1, 3)
    return np.linalg.norm(gaps, axis=2).max(axis=1)


def everything() -> dict[str, Any]:
    """All that an export must leave as it is."""
    context = bpy.context
    context.view_layer.update()
    kinds = ("scenes", "objects", "meshes", "materials", "images", "actions", "shape_keys", "node_groups")
    return snapshot() | {
        "names": {kind: sorted((data.name, data.users) for data in getattr(bpy.data, kind)) for kind in kinds},
        "shown": (context.window.scene.name, context.scene.name, context.window.view_layer.name, context.mode),
        "frames": [(s.frame_current, s.frame_start, s.frame_end) for s in bpy.data.scenes],
        "selected": sorted(obj.name for obj in context.view_layer.objects if obj.select_get()),
        "active": context.view_layer.objects.active,
        "objects": {obj.name: _object(obj) for obj in bpy.data.objects},
        "keys": {key.name: _keys(key) for key in bpy.data.shape_keys},
        "pictures": {image.name: _picture(image) for image in bpy.data.images if image.type != "RENDER_RESULT"},
        "nodes": {m.name: [(n.name, getattr(n, "image", None)) for n in m.node_tree.nodes] for m in bpy.data.materials},
    }


def _object(obj: bpy.types.Object) -> tuple[Any, ...]:
    place = [tuple(row) for row in obj.matrix_world]
    held = [*(m.name for m in obj.modifiers), *(c.name for c in obj.constraints), *sorted(obj.keys())]
    seen = (obj.hide_viewport, obj.hide_get(), obj.parent, obj.data, [slot.material for slot in obj.material_slots])
    return place, held, seen, obj.animation_data and obj.animation_data.action


def _keys(keys: bpy.types.Key) -> tuple[Any, ...]:
    values = [(b.name, b.value, b.mute, b.vertex_group, b.slider_max, _hash(b.data, "co")) for b in keys.key_blocks]
    animation = keys.animation_data
    curves = animation.drivers if animation is not None else []
    read = [(c.data_path, t.id, t.data_path) for c in curves for v in c.driver.variables for t in v.targets]
    return values, read, animation and animation.action


def _picture(image: bpy.types.Image) -> tuple[Any, ...]:
    packed = image.packed_file
    pixels = np.empty(4 * image.size[0] * image.size[1], np.float32)
    image.pixels.foreach_get(pixels)
    data = hashlib.sha256(packed.data).hexdigest() if packed is not None else None
    return hashlib.sha256(pixels.tobytes()).hexdigest(), data, image.filepath_raw, image.is_dirty, image.source


def _hash(points: Any, name: str) -> str:
    flat = np.empty(3 * len(points), np.float32)
    points.foreach_get(name, flat)
    return hashlib.sha256(flat.tobytes()).hexdigest()
