"""Whether a file is one that an artist could go on with: what is wrong with its heads, as sentences, and its state."""

import hashlib
import json
from collections.abc import Iterator
from types import MethodType, SimpleNamespace
from typing import Any

import bpy
import numpy as np
from conftest import PACKAGE
from consistent_controls import of_controls, of_list, of_strip
from tracking import Layout, module

KEY, PART, PICTURE = "facewright_head", "facewright_part", "facewright_picture"
TEXTS = ("facewright_report", "facewright_expressions", "facewright_kept")


def faults(vertices: dict[str, int]) -> list[str]:
    """What is wrong in the open file; `vertices` says how many each part of a head has."""
    found = [sentence for scene in bpy.data.scenes for sentence in _of_scene(scene, vertices)]
    found += [f"{key.name} is a key without a mesh" for key in bpy.data.shape_keys if key.user is None]
    return found + list(_of_panels())


def _of_scene(scene: bpy.types.Scene, vertices: dict[str, int]) -> Iterator[str]:
    heads = module("scene.heads").heads(scene)
    whole = [head for head in heads if head.skin is not None]
    for head in whole:
        yield from _of_texts(head.skin)
        for name, obj in head.parts.items():
            yield from _of_part(obj, vertices[name])
            if obj != head.skin:
                yield from _of_drivers(obj, head.skin)
        yield from of_controls(head)
    parts = [obj for head in heads for obj in head.objects]
    yield from (f"{obj.name} is of two heads" for obj in set(parts) if parts.count(obj) > 1)
    yield from of_list(scene)
    yield from of_strip(scene)


def _of_texts(skin: bpy.types.Object) -> Iterator[str]:
    for name in TEXTS:
        try:
            json.loads(skin[name])
        except (KeyError, ValueError) as error:
            yield f"{skin.name} has no {name} that can be read: {error!r}"


def _of_part(obj: bpy.types.Object, vertices: int) -> Iterator[str]:
    """Mesh, keys and looks of a part."""
    mesh, keys = obj.data, obj.data.shape_keys
    if len(mesh.vertices) != vertices:
        yield f"{obj.name} has {len(mesh.vertices)} vertices, not {vertices}"
    if keys is None:
        yield f"{obj.name} has no shape keys"
        return
    if any(len(block.data) != vertices for block in keys.key_blocks):
        yield f"{obj.name} has keys of another number of vertices"
    # In Edit Mode the mesh holds what the mode began with.
    if obj.mode != "EDIT" and np.abs(_places(mesh.vertices) - _places(keys.key_blocks[0].data)).max() > 1e-6:
        yield f"the mesh of {obj.name} is not its shape at rest"
    if not all(np.isfinite(_places(block.data)).all() for block in keys.key_blocks):
        yield f"{obj.name} has vertices that are nowhere"
    shown = [p for worn in mesh.materials if worn is not None for p in module("scene.materials").images(worn.node_tree)]
    yield from (f"{picture.name} on {obj.name} has no pixels" for picture in shown if not len(picture.pixels))
    picture = obj.get(PICTURE)
    is_painted = any(map(module("scene.materials").is_painted, shown))
    if picture is not None and shown and picture not in shown and not is_painted:
        yield f"{obj.name} shows {shown[0].name}, but what was made for it is {picture.name}"


def _of_drivers(obj: bpy.types.Object, skin: bpy.types.Object) -> Iterator[str]:
    """The keys of a part follow those of its own skin."""
    keys, led = obj.data.shape_keys, skin.data.shape_keys
    curves = keys.animation_data.drivers if keys is not None and keys.animation_data is not None else []
    followed = {target.id for c in curves for variable in c.driver.variables for target in variable.targets}
    # A part of a copy whose skin was deleted is this head's, and follows it with the next run.
    if obj.parent != skin and not any(_is_worn(key) for key in followed):
        return
    # Blender forgets what a local copy of a linked part follows: it links no keys.
    if obj.data.library != skin.data.library:
        return
    strange = [key.name_full if key is not None else "nothing" for key in followed - {led}]
    yield from (f"{obj.name} follows {name} and not {skin.name}" for name in strange)
    if not strange and obj.visible_get() and skin.visible_get():
        yield from _of_values(obj, skin, curves)


def _of_values(obj: bpy.types.Object, skin: bpy.types.Object, curves: Any) -> Iterator[str]:
    """What the artist sees of a part's keys is what the skin's have; one that was deleted there leads no more."""
    graph = bpy.context.evaluated_depsgraph_get()
    seen, led = (shown.evaluated_get(graph).data.shape_keys for shown in (obj, skin))
    for curve in curves if seen is not None and led is not None else []:
        path = curve.driver.variables[0].targets[0].data_path
        mine, value = _value(seen, curve.data_path), _value(led, path)
        if mine is not None and value is not None and abs(mine - value) > 1e-4:
            yield f"{curve.data_path} of {obj.name} does not follow {path} of {skin.name}"


def _value(keys: bpy.types.Key, path: str) -> float | None:
    try:
        return keys.path_resolve(path)
    except ValueError:
        return None


def _is_worn(key: bpy.types.Key | None) -> bool:
    """Whether a key is that of an object in any scene."""
    return key is not None and any(obj.data == key.user for scene in bpy.data.scenes for obj in scene.objects)


def loose(skin: bpy.types.Object) -> list[str]:
    """Keys that a run has just made of parts and that follow none of the skin's."""
    head = next(head for head in module("scene.heads").heads(bpy.context.scene) if head.skin == skin)
    found = []
    for obj in [obj for obj in head.objects if obj != skin]:
        animation = obj.data.shape_keys.animation_data
        led = {curve.data_path for curve in animation.drivers if curve.driver.is_valid} if animation else set()
        made = json.loads(obj.data["facewright_keys"])
        blocks = [block for block in obj.data.shape_keys.key_blocks if block.name in made]
        found += [f"{b.name} of {obj.name}" for b in blocks if b.path_from_id("value") not in led]
    return found


def shared(skin: bpy.types.Object) -> list[str]:
    """Pictures that a head has just been given, and other heads of its scene show; linked duplicates may."""
    heads = module("scene.heads").heads(bpy.context.scene)
    head = next(head for head in heads if head.skin == skin)
    meshes = {obj.data for obj in head.objects}
    others = [obj for other in heads for obj in other.objects if other.skin != skin and obj.data not in meshes]
    return [f"{head.name} shares {picture.name}" for picture in _pictures(head.objects) & _pictures(others)]


def _pictures(objects: list[bpy.types.Object]) -> set[bpy.types.Image]:
    worn = {m for obj in objects for m in obj.data.materials if m is not None}
    shown = {picture for material in worn for picture in module("scene.materials").images(material.node_tree)}
    return shown | {obj[PICTURE] for obj in objects if obj.get(PICTURE) is not None}


class _Drawn(Layout):
    """A layout with every panel in it open; whatever else there is in a layout gives a layout."""

    def panel(self, _name: str, **_more: Any) -> tuple["_Drawn", "_Drawn"]:
        return self, self

    def panel_prop(self, data: Any, name: str) -> tuple["_Drawn", "_Drawn"]:
        self.prop(data, name)
        return self, self

    def __getattr__(self, _name: str) -> Any:
        return lambda *_given, **_more: self


class _Panel:
    """A panel of a class, as Blender draws it."""

    def __init__(self, cls: type) -> None:
        self.layout, self._cls = _Drawn(), cls

    def __getattr__(self, name: str) -> Any:
        found = getattr(self._cls, name)
        return MethodType(found, self) if callable(found) else found


class _Context:
    """Blender's context with what there is none of without a window: the region of a side bar, and its scale."""

    region = SimpleNamespace(width=300, height=600)
    preferences = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))

    def __getattr__(self, name: str) -> Any:
        return getattr(bpy.context, name)


def _of_panels() -> Iterator[str]:
    """All panels of the 3D view can be drawn."""
    context = _Context()
    for cls in module("registration").CLASSES:
        if issubclass(cls, bpy.types.Panel) and cls.bl_space_type == "VIEW_3D":
            try:
                if _is_shown(cls, context):
                    cls.draw(_Panel(cls), context)
            except Exception as error:  # noqa: BLE001 — whatever it is, the artist's panel would be empty
                yield f"the panel {cls.__name__} cannot be drawn: {error!r}"


def _is_shown(cls: Any, context: _Context) -> bool:
    """Whether a panel is there, and the one that it lies in."""
    panels: list[Any] = [cls, getattr(bpy.types, getattr(cls, "bl_parent_id", ""), None)]
    return all(panel.poll(context) for panel in panels if hasattr(panel, "poll"))


def state() -> dict[str, str]:
    """All that an artist would call the file's content; what is a pure matter of order or of the view is left out."""
    found: dict[str, Any] = {}
    for obj in bpy.data.objects:
        place = [round(value, 5) for row in obj.matrix_basis for value in row]
        homes = sorted(home.name for home in obj.users_collection)
        data = obj.data.name if obj.data is not None else ""
        about = (obj.type, data, obj.parent.name if obj.parent else "", place, homes, obj.hide_viewport, obj.mode)
        groups = [group.name for group in obj.vertex_groups], [modifier.type for modifier in obj.modifiers]
        found[_title("object", obj)] = (*about, *groups, _properties(obj), _pose(obj))
    for mesh in bpy.data.meshes:
        found[_title("mesh", mesh)] = (_hash_of_mesh(mesh), [m.name if m else "" for m in mesh.materials])
    for picture in [picture for picture in bpy.data.images if picture.type != "RENDER_RESULT"]:
        found[_title("image", picture)] = (tuple(picture.size), _hash_of_pixels(picture), picture.users > 0)
    for material in bpy.data.materials:
        shown = module("scene.materials").images(material.node_tree)
        found[_title("material", material)] = sorted(picture.name for picture in shown)
    for home in bpy.data.collections:
        found[_title("collection", home)] = (sorted(c.name for c in home.children), _properties(home))
    for scene in bpy.data.scenes:
        settings = scene.facewright_clip
        wanted = (settings.path, settings.wanted, settings.use_range, settings.first, settings.last, settings.left_out)
        found[_title("scene", scene)] = (sorted(c.name for c in scene.collection.children), wanted)
    for text in bpy.data.texts:
        found[_title("text", text)] = (hashlib.blake2b(text.as_string().encode(), digest_size=8).hexdigest(),)
    for action in bpy.data.actions:
        found[_title("action", action)] = [_curve(curve) for curve in module("scene.pose_keys")._all_curves(action)]
    return {name: repr(value) for name, value in found.items()}


def difference(before: dict[str, str], after: dict[str, str]) -> str:
    """What two states differ in; empty if in nothing."""
    names = [name for name in sorted({*before, *after}) if before.get(name) != after.get(name)]
    return "; ".join(f"{name}: {before.get(name)} → {after.get(name)}" for name in names[:4])


def _title(kind: str, data: bpy.types.ID) -> str:
    return f"{kind} {data.name}" + (f" of {data.library.name}" if data.library is not None else "")


def _properties(data: bpy.types.ID) -> dict[str, str]:
    """Custom properties of ours, pointers by name."""
    ours = {name: data[name] for name in list(data.keys()) if name.startswith(PACKAGE.rpartition(".")[2])}
    return {name: value.name if isinstance(value, bpy.types.ID) else str(value) for name, value in ours.items()}


def _pose(obj: bpy.types.Object) -> list[Any]:
    """Bones, with their places and our properties, but for what keyframes set."""
    keyed = {(curve.data_path, curve.array_index) for curve in module("scene.pose_keys").curves(obj) or []}
    found: list[Any] = []
    for pose in obj.pose.bones if obj.pose is not None else []:
        ours = sorted((name, value) for name, value in pose.items() if not _is_keyed(pose, name, keyed))
        found.append((pose.name, ours))
        for channel in ("location", "rotation_euler"):
            path = pose.path_from_id(channel)
            found += [round(value, 5) for k, value in enumerate(getattr(pose, channel)) if (path, k) not in keyed]
    return found


def _is_keyed(pose: bpy.types.PoseBone, name: str, keyed: set[tuple[str, int]]) -> bool:
    return (f'{pose.path_from_id()}["{name}"]', 0) in keyed


def _hash_of_mesh(mesh: bpy.types.Mesh) -> str:
    """Of vertices, keys, and the values of keys that no driver and no keyframe sets."""
    keys = mesh.shape_keys
    blocks = list(keys.key_blocks) if keys is not None else []
    curves = keys.animation_data.drivers if keys is not None and keys.animation_data is not None else []
    animated = module("scene.pose_keys").curves(keys) if keys is not None else None
    led = {curve.data_path for curve in [*curves, *(animated or [])]}
    values = [(b.name, round(b.value, 5)) for b in blocks if b.path_from_id("value") not in led]
    digest = hashlib.blake2b(repr((values, sorted(led))).encode(), digest_size=8)
    for points in [mesh.vertices, *(block.data for block in blocks)]:
        digest.update(_places(points).tobytes())
    return digest.hexdigest()


def _hash_of_pixels(picture: bpy.types.Image) -> str:
    values = np.empty(len(picture.pixels), np.float32)
    picture.pixels.foreach_get(values)
    return hashlib.blake2b(np.rint(values * 255.0).astype(np.uint8).tobytes(), digest_size=8).hexdigest()


def _curve(curve: bpy.types.FCurve) -> tuple[str, int, list[tuple[float, float]]]:
    return curve.data_path, curve.array_index, [(point.co.x, round(point.co.y, 4)) for point in curve.keyframe_points]


def _places(points: Any) -> Any:
    flat = np.empty(3 * len(points), np.float32)
    points.foreach_get("co", flat)
    return flat
