"""A reconstruction as objects: made once, updated ever after."""

import json

import bpy
import numpy as np

from ..engine import Reconstruction
from .axes import to_blender
from .materials import LOOKS, image, material

PART = "facewright_part"
EXPRESSIONS = "facewright_expressions"
REPORT = "facewright_report"
SKIN = "skin"


def face(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """The head's skin object in a scene."""
    return part_objects(scene).get(SKIN)


def part_objects(scene: bpy.types.Scene) -> dict[str, bpy.types.Object]:
    """The objects of the head in a scene by part name."""
    found = {o.get(PART): o for o in scene.objects if o.type == "MESH" and o.get(PART)}
    return {str(name): found[name] for name in found}


def place(
    scene: bpy.types.Scene, head: Reconstruction, collection: bpy.types.Collection | None = None
) -> bpy.types.Object:
    """Put a head into a collection of a scene (None: its own), or bring the one that is in the scene up to date.

    Gives back the skin object, `Face`.
    """
    objects = part_objects(scene)
    pictures = {"Face skin": image("Face skin", head.texture), "Face eyes": image("Face eyes", head.eyes)}
    skin = objects.get(SKIN)
    for name, vertices, quads in head.parts:
        obj = objects.get(name)
        is_other = obj is not None and len(obj.data.vertices) != vertices[1] - vertices[0]
        if obj is None or (is_other and name == SKIN):
            obj = _new_object(collection or scene.collection, name, skin)
            _build_mesh(obj.data, head, vertices, quads)
        elif is_other:
            _renew_mesh(obj, head, vertices, quads)
        look = LOOKS[name]
        if not obj.data.materials:
            obj.data.materials.append(material(look, pictures.get(look.name)))
        _set_shape(obj, head, vertices)
        if name == SKIN:
            skin = obj
    assert skin is not None, "the first part is the skin"
    for obj in part_objects(scene).values():
        if obj is not skin:
            _adopt(obj, skin, objects.get(SKIN))
            _drive_keys(obj, skin)
    skin[EXPRESSIONS] = json.dumps({name: dict(weights) for name, weights in head.expressions})
    skin[REPORT] = head.report
    return skin


def expressions(skin: bpy.types.Object) -> dict[str, dict[str, float]]:
    """Named poses of a head: values of its keys."""
    return json.loads(skin.get(EXPRESSIONS, "{}"))


def set_keys(skin: bpy.types.Object, values: dict[str, float], frame: float | None) -> None:
    """Set every key of a head, to 0 where none is named; insert keyframes at a frame if one is given."""
    blocks = skin.data.shape_keys.key_blocks
    for block in list(blocks)[1:]:
        value = min(values.get(block.name, 0.0), block.slider_max)
        if frame is not None and (block.value != value or value != 0.0):
            block.value = value
            block.keyframe_insert("value", frame=frame)
        block.value = value


def _new_object(collection: bpy.types.Collection, name: str, skin: bpy.types.Object | None) -> bpy.types.Object:
    title = "Face" if name == SKIN else f"Face {name}"
    obj = bpy.data.objects.new(title, bpy.data.meshes.new(title))
    obj[PART] = name
    collection.objects.link(obj)
    if skin is not None:
        obj.parent = skin
    return obj


def _adopt(obj: bpy.types.Object, skin: bpy.types.Object, before: bpy.types.Object | None) -> None:
    """Hang a part that has lost its skin, or had the one before, below the skin."""
    if skin != before and obj.parent in (None, before):
        obj.parent = skin


def _build_mesh(mesh: bpy.types.Mesh, head: Reconstruction, vertices: tuple[int, int], quads: tuple[int, int]) -> None:
    corners = head.quads[quads[0] : quads[1]].astype(np.int64) - vertices[0]
    positions = to_blender(head.positions[vertices[0] : vertices[1]])
    mesh.from_pydata(positions.tolist(), [], corners.tolist())
    mesh.shade_smooth()
    layer = mesh.uv_layers.new(name="UVMap")
    layer.data.foreach_set("uv", np.ascontiguousarray(head.uvs[quads[0] : quads[1]], np.float32).ravel())
    generic = mesh.attributes.new("generic_position", "FLOAT_VECTOR", "POINT")
    generic.data.foreach_set("vector", to_blender(head.generic_positions[vertices[0] : vertices[1]]).ravel())
    mesh.validate()


def _renew_mesh(obj: bpy.types.Object, head: Reconstruction, vertices: tuple[int, int], quads: tuple[int, int]) -> None:
    """Give a part another mesh (the paper's eyes for eyeballs); the object and its materials stay."""
    before, name = obj.data, obj.data.name
    obj.data = bpy.data.meshes.new(name)
    for look in before.materials:
        obj.data.materials.append(look)
    if before.users == 0:
        bpy.data.meshes.remove(before)
    obj.data.name = name
    _build_mesh(obj.data, head, vertices, quads)


def _set_shape(obj: bpy.types.Object, head: Reconstruction, vertices: tuple[int, int]) -> None:
    """Basis and keys; values and animation of keys that exist stay."""
    first, end = vertices
    basis = head.positions[first:end]
    _set_block(obj, "Basis", basis)
    for name, indices, offsets in head.keys:
        inside = (indices >= first) & (indices < end)
        if not inside.any() and obj[PART] != SKIN:
            continue
        moved = basis.copy()
        moved[indices[inside] - first] += offsets[inside]
        _set_block(obj, name, moved)
    obj.data.vertices.foreach_set("co", to_blender(basis).ravel())
    obj.data.update()


def _set_block(obj: bpy.types.Object, name: str, positions: np.ndarray) -> None:
    keys = obj.data.shape_keys
    block = keys.key_blocks.get(name) if keys else None
    if block is None:
        block = obj.shape_key_add(name=name, from_mix=False)
        block.value = 0.0
    block.data.foreach_set("co", to_blender(positions).ravel())


def _drive_keys(obj: bpy.types.Object, skin: bpy.types.Object) -> None:
    """Let the keys of a part follow the skin's of the same name."""
    keys = obj.data.shape_keys
    if keys is None:
        return
    drivers = {curve.data_path: curve.driver for curve in (keys.animation_data.drivers if keys.animation_data else [])}
    for block in list(keys.key_blocks)[1:]:
        driver = drivers.get(block.path_from_id("value"))
        path = f'key_blocks["{block.name}"].value'
        if driver is None:
            driver = block.driver_add("value").driver
            driver.type = "AVERAGE"
            target = driver.variables.new().targets[0]
            target.id_type, target.data_path = "KEY", path
            target.id = skin.data.shape_keys
        for target in _own_targets(driver, path):
            target.id = skin.data.shape_keys


def _own_targets(driver: bpy.types.Driver, path: str) -> list[bpy.types.DriverTarget]:
    """What a driver of ours reads; an artist's own driver has none."""
    targets = [target for variable in driver.variables for target in variable.targets]
    return [target for target in targets if target.id_type == "KEY" and target.data_path == path]
