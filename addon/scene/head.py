"""A reconstruction as objects: made once, updated ever after."""

import json

import bpy

from ..engine import Reconstruction
from . import heads, looks, shapes
from .axes import to_blender
from .heads import SKIN, Head
from .keys import EXPRESSIONS
from .materials import EYES
from .materials import SKIN as SKIN_LOOK
from .standing import free_place

REPORT = "facewright_report"
# What the last run left as an artist had made it: a JSON list of texts.
KEPT = "facewright_kept"


def place(
    scene: bpy.types.Scene,
    result: Reconstruction,
    clip: str = "",
    head: Head | None = None,
    parent: bpy.types.Collection | None = None,
) -> bpy.types.Object:
    """Bring a head of a scene up to date; None makes a new one, in a collection of its own within another.

    `clip` is what the result was made from, for the head to remember. Gives back the skin object, `Face`.
    """
    others = heads.heads(scene)
    known = heads.begun(scene, parent) if head is None else heads.claimed(scene, head)
    parts = {name: _part(known, name, vertices[1] - vertices[0]) for name, vertices, _ in result.parts}
    named = {name: shapes.named_by_artist(obj.data) for name, obj in parts.items()}
    for name, vertices, quads in result.parts:
        if not parts[name].data.vertices:
            shapes.build(parts[name].data, result, vertices, quads)
    kept = looks.dress(known.name, parts, known.parts, {SKIN_LOOK: result.texture, EYES: result.eyes})
    for name, vertices, _ in result.parts:
        kept += shapes.shape(parts[name], result, vertices, name == SKIN)
    skin = parts[SKIN]
    for name, obj in ({**known.parts, **parts}).items():
        if name != SKIN:
            _hang(obj, skin, known)
            _drive_keys(obj, skin)
    for name, names in named.items():
        shapes.name_keys(parts[name].data, names)
    if not known.parts:
        skins = [other.skin for other in others if other.skin is not None]
        skin.location = free_place(scene, to_blender(result.positions), skins, set(parts.values()))
    heads.remember(known, skin, clip)
    skin[EXPRESSIONS] = json.dumps({name: dict(weights) for name, weights in result.expressions})
    skin[REPORT] = result.report
    skin[KEPT] = json.dumps(kept)
    return skin


def kept(skin: bpy.types.Object) -> list[str]:
    """What the last run on a head left as an artist had made it."""
    return json.loads(skin.get(KEPT, "[]"))


def _part(head: Head, name: str, vertices: int) -> bpy.types.Object:
    """The object of a part; a new one where there is none, or where the artist has made another mesh of it."""
    obj = head.parts.get(name)
    if obj is not None and len(obj.data.vertices) == vertices:
        return obj
    if obj is not None:
        heads.release(obj)
    title = head.name if name == SKIN else f"{head.name} {name}"
    obj = bpy.data.objects.new(title, bpy.data.meshes.new(title))
    heads.mark(obj, name, head.key)
    assert head.home is not None, "a head that is changed has a collection"
    head.home.objects.link(obj)
    return obj


def _hang(obj: bpy.types.Object, skin: bpy.types.Object, before: Head) -> None:
    """Hang a part below the skin if it is new, or has lost its skin, or had the one before."""
    is_new = obj not in before.objects
    if is_new or (skin != before.skin and obj.parent in (None, before.skin)):
        obj.parent = skin


def _drive_keys(obj: bpy.types.Object, skin: bpy.types.Object) -> None:
    """Let the keys of a part follow the skin's of the same name; an artist's own have none there."""
    keys = obj.data.shape_keys
    if keys is None:
        return
    drivers = {curve.data_path: curve.driver for curve in (keys.animation_data.drivers if keys.animation_data else [])}
    for block in [block for block in list(keys.key_blocks)[1:] if block.name in skin.data.shape_keys.key_blocks]:
        driver = drivers.get(block.path_from_id("value"))
        path = f'key_blocks["{block.name}"].value'
        if driver is None:
            driver = block.driver_add("value").driver
            driver.type = "AVERAGE"
            target = driver.variables.new().targets[0]
            target.id_type, target.data_path = "KEY", path
            target.id = skin.data.shape_keys
        for target in _own_targets(driver, path):
            target.id, target.data_path = skin.data.shape_keys, path


def _own_targets(driver: bpy.types.Driver, path: str) -> list[bpy.types.DriverTarget]:
    """What a driver of ours reads; an artist's own driver has none.

    Where the skin's shape at rest was deleted, the key that came first has become that, and its drivers with it.
    """
    targets = [target for variable in driver.variables for target in variable.targets]
    ours = {path, f'key_blocks["{shapes.BASIS}"].value'}
    return [target for target in targets if target.id_type == "KEY" and target.data_path in ours]
