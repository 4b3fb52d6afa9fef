"""The shape of a head's part and its keys, as a run makes them; what an artist did to them since stays.

An artist's sculpting is a difference to what the last run made: of the vertices at rest, of a key's offsets. What the
last run made is remembered in the mesh: the vertices as an attribute, the keys' offsets by a few of their sums.
"""

import json

import bpy
import numpy as np
from numpy.typing import NDArray

from ..engine import Reconstruction
from . import pose_keys
from .axes import to_blender
from .keys import asked

BASIS = "Basis"
# Of a mesh: where the last run put its vertices, and the traits of the keys that it made.
MADE = "made_position"
TRAITS = "facewright_keys"
# Metres: more than single precision moves a vertex by, less than an artist does.
SCULPTED = 1e-6
# What single precision does to the traits of a key.
TRAIT_ERROR = 2e-5

Positions = NDArray[np.float32]


def build(mesh: bpy.types.Mesh, head: Reconstruction, vertices: tuple[int, int], quads: tuple[int, int]) -> None:
    """Make a part's mesh: its faces, its places in the texture, and where the generic head has its vertices."""
    corners = head.quads[quads[0] : quads[1]].astype(np.int64) - vertices[0]
    positions = to_blender(head.positions[vertices[0] : vertices[1]])
    mesh.from_pydata(positions.tolist(), [], corners.tolist())
    mesh.shade_smooth()
    layer = mesh.uv_layers.new(name="UVMap")
    layer.data.foreach_set("uv", np.ascontiguousarray(head.uvs[quads[0] : quads[1]], np.float32).ravel())
    generic = mesh.attributes.new("generic_position", "FLOAT_VECTOR", "POINT")
    generic.data.foreach_set("vector", to_blender(head.generic_positions[vertices[0] : vertices[1]]).ravel())
    mesh.validate()


def shape(obj: bpy.types.Object, head: Reconstruction, vertices: tuple[int, int], is_skin: bool) -> list[str]:
    """Give a part its shape at rest and its keys; values and animation of keys that exist stay.

    An artist's own keys go with what they are relative to. Gives what else of an artist's was kept.
    """
    mesh, before = obj.data, _with_rest(obj)
    sculpted = _sculpted(mesh, before)
    made = to_blender(head.positions[vertices[0] : vertices[1]])
    offsets = _offsets(head, vertices, is_skin)
    own = _sculpted_keys(mesh, before, set(offsets))
    after = {BASIS: made + sculpted}
    after |= {name: after[BASIS] + own.get(name, offset) for name, offset in offsets.items()}
    after |= _followed(mesh, before, after)
    ends = asked(dict(weights) for _, weights in head.expressions)
    for name, positions in after.items():
        _set_block(obj, name, positions, ends.get(name, 1.0))
    mesh.vertices.foreach_set("co", np.ascontiguousarray(after[BASIS]).ravel())
    _remember(mesh, made, {name: _traits(offset) for name, offset in offsets.items()})
    mesh.update()
    return _kept(obj.name, int((np.abs(sculpted).max(axis=1) > 0.0).sum()), list(own))


def named_by_artist(mesh: bpy.types.Mesh) -> dict[str, str]:
    """Give the keys that an artist has renamed the names of a run again; gives the artist's by those.

    A key is known by its offsets, the shape at rest by being the first.
    """
    before, traits = _blocks(mesh), json.loads(mesh.get(TRAITS, "{}"))
    if not before:
        return {}
    first = next(iter(before))
    theirs = {BASIS: first} if BASIS not in before and first not in traits else {}
    others = {name: _traits(places - before[first]) for name, places in before.items() if name not in {first, *traits}}
    for name in [name for name in traits if name not in before and any(traits[name])]:
        same = [other for other, found in others.items() if _is_near(found, traits[name])]
        theirs |= {name: same[0]} if same else {}
    name_keys(mesh, {other: name for name, other in theirs.items()})
    return theirs


def name_keys(mesh: bpy.types.Mesh, names: dict[str, str]) -> None:
    """Rename keys, by their present names; what animates and drives them follows."""
    for present, name in names.items():
        mesh.shape_keys.key_blocks[present].name = name


def _is_near(traits: list[float], others: list[float]) -> bool:
    return bool(np.abs(np.subtract(traits, others)).max() <= TRAIT_ERROR)


def _kept(name: str, vertices: int, keys: list[str]) -> list[str]:
    sculpting = [f"the sculpting of {vertices} vertices of {name}"] if vertices else []
    return sculpting + [f"the shape of {key} of {name}" for key in keys]


def _offsets(head: Reconstruction, vertices: tuple[int, int], is_skin: bool) -> dict[str, Positions]:
    """The offsets of a part's keys; the skin has every key, the others those that move them."""
    first, end = vertices
    found = {}
    for name, indices, offsets in head.keys:
        inside = (indices >= first) & (indices < end)
        if inside.any() or is_skin:
            moved = np.zeros((end - first, 3), np.float32)
            moved[indices[inside] - first] = offsets[inside]
            found[name] = to_blender(moved)
    return found


def _sculpted(mesh: bpy.types.Mesh, before: dict[str, Positions]) -> Positions:
    """What an artist added to the vertices at rest; zero where that is not known, as of an older version's."""
    made = mesh.attributes.get(MADE)
    if made is None or BASIS not in before:
        return np.zeros((len(mesh.vertices), 3), np.float32)
    added = before[BASIS] - _read(made.data, "vector")
    added[np.abs(added).max(axis=1) <= SCULPTED] = 0.0
    return added


def _sculpted_keys(mesh: bpy.types.Mesh, before: dict[str, Positions], ours: set[str]) -> dict[str, Positions]:
    """The offsets of those keys of ours that an artist has changed."""
    traits = json.loads(mesh.get(TRAITS, "{}"))
    offsets = {name: before[name] - before[BASIS] for name in before if name in ours & traits.keys()}
    return {name: offset for name, offset in offsets.items() if not _is_near(_traits(offset), traits[name])}


def _followed(mesh: bpy.types.Mesh, before: dict[str, Positions], after: dict[str, Positions]) -> dict[str, Positions]:
    """An artist's own keys, moved as far as the keys that they are relative to."""
    found: dict[str, Positions] = {}
    for block in mesh.shape_keys.key_blocks if before else []:
        if block.name not in after:
            name = block.relative_key.name
            change = after[name] - before[name] if name in after and name in before else 0.0
            found[block.name] = before[block.name] + change
    return found


def _with_rest(obj: bpy.types.Object) -> dict[str, Positions]:
    """Where every key has the vertices; a shape at rest that was deleted is the first key again."""
    before = _blocks(obj.data)
    if before and BASIS not in before:
        rest = obj.data.attributes.get(MADE)
        places = _read(rest.data, "vector") if rest is not None else _read(obj.data.vertices, "co")
        _set_first(obj, places)
        before = {BASIS: places, **before}
    return before


def _set_first(obj: bpy.types.Object, places: Positions) -> None:
    """Make the first key the shape at rest, and a new one of what it was: Blender puts no key before the first."""
    keys = obj.data.shape_keys
    first = keys.key_blocks[0]
    name, before = first.name, _read(first.data, "co")
    first.name = BASIS
    _set_block(obj, BASIS, places)
    _set_block(obj, name, before)
    new = keys.key_blocks[name]
    new.value = first.value
    # What animates and drives a key has gone along with its name.
    drivers = keys.animation_data.drivers if keys.animation_data is not None else []
    for curve in [*(pose_keys.curves(keys) or []), *drivers]:
        if curve.data_path == first.path_from_id("value"):
            curve.data_path = new.path_from_id("value")


def _remember(mesh: bpy.types.Mesh, made: Positions, traits: dict[str, list[float]]) -> None:
    attribute = mesh.attributes.get(MADE) or mesh.attributes.new(MADE, "FLOAT_VECTOR", "POINT")
    attribute.data.foreach_set("vector", made.ravel())
    mesh[TRAITS] = json.dumps(traits)


def _traits(offsets: Positions) -> list[float]:
    """A few sums that tell whether a key's offsets are what they were."""
    ramp = np.linspace(0.0, 1.0, len(offsets))[:, None]
    exact = offsets.astype(np.float64)
    sums = [exact.sum(axis=0), (exact * ramp).sum(axis=0), [np.linalg.norm(exact, axis=1).sum()]]
    return [round(float(value), 9) for part in sums for value in part]


def _blocks(mesh: bpy.types.Mesh) -> dict[str, Positions]:
    """Where every key has the vertices."""
    keys = mesh.shape_keys
    return {block.name: _read(block.data, "co") for block in keys.key_blocks} if keys else {}


def _read(data: bpy.types.bpy_prop_collection, name: str) -> Positions:
    values = np.empty(3 * len(data), np.float32)
    data.foreach_get(name, values)
    return values.reshape(-1, 3)


def _set_block(obj: bpy.types.Object, name: str, positions: Positions, end: float = 1.0) -> None:
    """Give a key its vertices; a new one has a slider to an end, which is the artist's afterwards."""
    keys = obj.data.shape_keys
    block = keys.key_blocks.get(name) if keys else None
    if block is None:
        block = obj.shape_key_add(name=name, from_mix=False)
        block.value, block.slider_max = 0.0, end
    block.data.foreach_set("co", np.ascontiguousarray(positions, np.float32).ravel())
