"""A copy of a head for exporters, in a scene of its own, which goes when the export ends.

Exporters know neither drivers nor constraints nor other files: on the copy, keys and places are keyframes.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ..engine import FacewrightError
from . import controls_find, controls_mesh, export_bones, export_sample, pose_keys
from .export_check import check
from .export_looks import dress
from .export_names import Names, identifier, set_aside
from .export_sample import SAME, Track
from .heads import SKIN, Head

# What a copy is made of, and what exporters may leave behind.
KINDS = ("scenes", "collections", "objects", "meshes", "shape_keys", "armatures", "actions")
KINDS += ("materials", "images", "node_groups")
# What the library notes in a mesh, of no use elsewhere.
NOTES = ("generic_position", "made_position")


@dataclass(frozen=True)
class Wanted:
    """What is copied of a head."""

    # First and last frame; None: as it is now.
    frames: tuple[int, int] | None
    joined: bool = False
    # Whether evaluated meshes are wanted, so that modifiers stay.
    evaluated: bool = False
    # How many of the file's units a metre has.
    scale: float = 1.0


@dataclass
class Copy:
    """A copied head: what is in its scene, by part; of a joined one, its skin."""

    scene: bpy.types.Scene
    objects: dict[str, bpy.types.Object]
    names: Names
    # Modifiers of the artist's that were left out.
    left_out: list[str] = field(default_factory=list)

    @property
    def skin(self) -> bpy.types.Object:
        return self.objects[SKIN]


@contextmanager
def copied(context: bpy.types.Context, head: Head, wanted: Wanted) -> Iterator[Copy]:
    """A copy of a head in a scene of its own; afterwards the file is as it was, whatever happened."""
    before, names = _all(), Names()
    try:
        yield _made(context, head, wanted, names)
    finally:
        bpy.data.batch_remove(_all() - before)
        names.give_back()


def _made(context: bpy.types.Context, head: Head, wanted: Wanted, names: Names) -> Copy:
    frames = np.arange(wanted.frames[0], wanted.frames[1] + 1) if wanted.frames else np.array([0])
    now = context.scene.frame_current
    scene = _scene(context.scene, wanted.frames or (now, now))
    title = identifier(head.name)
    names.give(scene, title)
    objects = {name: _duplicate(scene, obj) for name, obj in head.parts.items()}
    skeleton = export_bones.skeleton_of(controls_find.of(head.parts[SKIN]))
    if wanted.frames:
        tracks = export_sample.over_time(scene, objects, frames, skeleton)
    else:
        tracks = export_sample.at_present(head.parts, context.evaluated_depsgraph_get(), skeleton)
    copy = Copy(scene, objects, names)
    for obj in objects.values():
        _free(obj)
        if not wanted.evaluated:
            copy.left_out += _leave_out(obj, skeleton is not None)
        _plain_keys(obj)
    dress(objects, title, names)
    check(head, tracks, wanted.joined, skeleton is not None)
    if skeleton is None:
        root = copy.skin if wanted.joined else _root(scene, title, names)
    else:
        root = export_bones.armature(scene, skeleton, tracks[SKIN].places, frames, wanted.scale)
        _bind(copy, root, title)
    _bake(root, objects, tracks, frames, wanted.scale)
    if wanted.joined:
        _join(copy)
    for name, obj in copy.objects.items():
        called = title if wanted.joined else f"{title}_{name}"
        names.give(obj, called)
        names.give(obj.data, called)
    scene.frame_set(scene.frame_start)
    return copy


def _bind(copy: Copy, root: bpy.types.Object, title: str) -> None:
    """Let the bones of the copy, and no longer the artist's, move its meshes."""
    for data in (root, root.data):
        copy.names.give(data, f"{title}_armature")
    for bound in [controls_mesh.modifier(obj) for obj in copy.objects.values()]:
        if bound is not None:
            bound.object = root


def _scene(artists: bpy.types.Scene, frames: tuple[int, int]) -> bpy.types.Scene:
    """A scene in metres with the artist's time."""
    scene = bpy.data.scenes.new("Export")
    scene.render.fps, scene.render.fps_base = artists.render.fps, artists.render.fps_base
    scene.frame_start, scene.frame_end = frames
    scene.frame_current = frames[0]
    return scene


def _duplicate(scene: bpy.types.Scene, obj: bpy.types.Object) -> bpy.types.Object:
    """A visible copy of an object with a mesh of its own; it still hangs on what the original does."""
    copy = obj.copy()
    copy.data = obj.data.copy()
    # A copy of what is linked has its name.
    set_aside(copy)
    set_aside(copy.data)
    copy.hide_viewport = copy.hide_render = copy.hide_select = False
    copy.show_only_shape_key = False
    for held in (copy, copy.data):
        for name in list(held.keys()):
            del held[name]
    for name in NOTES:
        # One at a time: removing one moves those after it in memory.
        if name in copy.data.attributes:
            copy.data.attributes.remove(copy.data.attributes[name])
    scene.collection.objects.link(copy)
    return copy


def _leave_out(obj: bpy.types.Object, has_bones: bool) -> list[str]:
    """Take the modifiers of a copy away, but for what lets it follow bones; gives the names of those that showed."""
    kept = controls_mesh.modifier(obj) if has_bones and export_bones.is_bound(obj) else None
    rest = [modifier for modifier in obj.modifiers if modifier != kept]
    shown = [modifier.name for modifier in rest if modifier.show_viewport]
    for modifier in rest:
        obj.modifiers.remove(modifier)
    return shown


def _free(obj: bpy.types.Object) -> None:
    """Take away whatever moves an object."""
    obj.constraints.clear()
    obj.animation_data_clear()
    if obj.data.shape_keys is not None:
        obj.data.shape_keys.animation_data_clear()
    obj.parent = None
    for axis in ("delta_location", "delta_rotation_euler", "delta_rotation_quaternion", "delta_scale"):
        obj.property_unset(axis)
    for locks in ("lock_location", "lock_rotation", "lock_scale"):
        obj.property_unset(locks)


def _plain_keys(obj: bpy.types.Object) -> None:
    """Shape keys as other programs have them: differences from the first, for all vertices, none of them muted."""
    keys = obj.data.shape_keys
    if keys is None:
        return
    if not keys.use_relative:
        raise FacewrightError("the shape keys of the head are absolute, as no other program has them: turn on Relative")
    first, *blocks = keys.key_blocks
    rest, shapes = _positions(first), {block.name: _positions(block) for block in keys.key_blocks}
    for block in blocks:
        block.mute, group = False, block.vertex_group
        if block.relative_key == first and not group:
            continue
        offset = (shapes[block.name] - shapes[block.relative_key.name]) * _weights(obj, group)[:, None]
        block.relative_key, block.vertex_group = first, ""
        block.data.foreach_set("co", (rest + offset).astype(np.float32).ravel())


def _positions(block: bpy.types.ShapeKey) -> NDArray[np.float64]:
    flat = np.empty(3 * len(block.data), np.float32)
    block.data.foreach_get("co", flat)
    return flat.reshape(-1, 3).astype(np.float64)


def _weights(obj: bpy.types.Object, group: str) -> NDArray[np.float64]:
    """How much each vertex is of a group; 1 without one."""
    index = obj.vertex_groups.find(group)
    if index < 0:
        return np.ones(len(obj.data.vertices))
    found = [next((g.weight for g in v.groups if g.group == index), 0.0) for v in obj.data.vertices]
    return np.array(found, np.float64)


def _root(scene: bpy.types.Scene, title: str, names: Names) -> bpy.types.Object:
    """What carries the parts, and is no mesh: three.js gives values of a mesh's keys to all meshes below it."""
    root = bpy.data.objects.new("Export", None)
    names.give(root, title)
    scene.collection.objects.link(root)
    return root


def _bake(
    root: bpy.types.Object,
    objects: dict[str, bpy.types.Object],
    tracks: dict[str, Track],
    frames: NDArray[np.int64],
    scale: float,
) -> None:
    """Values and places as keyframes where they change; the parts hang on the root, which moves as the skin does."""
    carried = tracks[SKIN].places
    _place(root, carried, frames, scale)
    for name, obj in objects.items():
        if obj != root:
            obj.parent = root
            obj.matrix_parent_inverse = Matrix.Identity(4)
            _place(obj, np.linalg.inv(carried) @ tracks[name].places, frames, scale)
        if scale != 1.0:
            obj.data.transform(Matrix.Scale(scale, 4), shape_keys=True)
        if obj.data.shape_keys is not None:
            _set_values(obj.data.shape_keys, tracks[name].values, frames)


def _place(obj: bpy.types.Object, places: NDArray[np.float64], frames: NDArray[np.int64], scale: float) -> None:
    places = places.copy()
    places[:, :3, 3] *= scale
    obj.rotation_mode = "QUATERNION"
    obj.matrix_basis = Matrix(places[0].tolist())
    if np.ptp(places, axis=0).max() <= SAME:
        return
    pose_keys.write(obj, frames, places)
    sizes = np.array([Matrix(place.tolist()).to_scale() for place in places])
    if np.ptp(sizes, axis=0).max() > SAME:
        for index, column in enumerate(sizes.T):
            pose_keys.fill(obj, "scale", index, frames, column)


def _set_values(keys: bpy.types.Key, values: NDArray[np.float64], frames: NDArray[np.int64]) -> None:
    for block, column in zip(keys.key_blocks[1:], values.T):
        block.slider_min, block.slider_max = min(block.slider_min, 0.0), max(block.slider_max, 1.0)
        block.value = column[0]
        if np.ptp(column) > SAME:
            pose_keys.fill(keys, block.path_from_id("value"), -1, frames, column)


def _join(copy: Copy) -> None:
    """Put all parts into the mesh of the skin: keys of one name become one."""
    objects = list(copy.objects.values())
    layer = copy.scene.view_layers[0]
    layer.objects.active = copy.skin
    given = {"active_object": copy.skin, "object": copy.skin, "selected_objects": objects}
    given["selected_editable_objects"] = objects
    with bpy.context.temp_override(scene=copy.scene, view_layer=layer, **given):
        bpy.ops.object.join()
    copy.objects = {SKIN: copy.skin}


def _all() -> set[bpy.types.ID]:
    return {data for kind in KINDS for data in getattr(bpy.data, kind)}
