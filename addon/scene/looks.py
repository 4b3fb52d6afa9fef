"""The materials and pictures of a head: its own, found by its objects and never by their names in the file."""

import bpy
import numpy as np
from numpy.typing import NDArray

from .heads import PART
from .materials import LOOKS, Look, copied, exchange, images, is_painted, new_image, new_material

# Of an object: the picture that runs paint.
PICTURE = "facewright_picture"
# What older versions, which found pictures by their names, called them.
OLDER = "Face"

Parts = dict[str, bpy.types.Object]


def dress(title: str, parts: Parts, before: Parts, pictures: dict[Look, NDArray[np.uint8]]) -> list[str]:
    """Give a head new pictures, and those of its parts that have none a material.

    What the head had `before`, or its parts have, is kept, and so are pictures that an artist painted on. `title`
    begins the names of what is new. Gives what of an artist's was kept.
    """
    kept: list[str] = []
    for name, obj in parts.items():
        _inherit(obj, [*_like(name, before), *_like(name, parts)])
    for look, pixels in pictures.items():
        kept += _paint(title, look, [obj for name, obj in parts.items() if LOOKS[name] == look], pixels)
    made: dict[Look, bpy.types.Material] = {}
    for name, obj in parts.items():
        if not _materials([obj]):
            look = LOOKS[name]
            if look not in made:
                made[look] = new_material(f"{title} {look.name}", look, obj.get(PICTURE))
            _wear(obj, made[look])
    return kept


def _wear(obj: bpy.types.Object, material: bpy.types.Material) -> None:
    """Give a part that has no material one: a slot remains of one that was deleted."""
    if obj.material_slots:
        obj.material_slots[0].material = material
    else:
        obj.data.materials.append(material)


def _like(name: str, parts: Parts) -> list[bpy.types.Object]:
    """The parts that look as one of this name, itself first."""
    same = [obj for other, obj in parts.items() if LOOKS.get(other) == LOOKS[name]]
    return sorted(same, key=lambda obj: obj != parts.get(name))


def _inherit(obj: bpy.types.Object, like: list[bpy.types.Object]) -> None:
    """Give a part what it lacks, material or picture, of the first that looks like it and has it."""
    worn = _materials(like)
    if not _materials([obj]) and worn:
        _wear(obj, worn[0])
    painted = [other[PICTURE] for other in like if other.get(PICTURE) is not None]
    if obj.get(PICTURE) is None and painted:
        obj[PICTURE] = painted[0]


def _paint(title: str, look: Look, wearers: list[bpy.types.Object], pixels: NDArray[np.uint8]) -> list[str]:
    """Give some parts a new picture in the place of the one they have; gives what was kept.

    Never new pixels to one that is there: Blender would not undo that. One that another head has too stays for that,
    and one that an artist painted on is shown as before.
    """
    old = _picture(wearers, look)
    new = new_image(f"{title} {look.name}", pixels, like=old)
    kept = []
    if old is not None:
        others = _others(wearers, old)
        is_shared, is_kept = bool(others) or old.library is not None, is_painted(old)
        # A painting that another head shows too is this one's own from now on.
        shown = new if not is_kept else copied(old) if is_shared else old
        if is_shared:
            _repaint(wearers, others, old, shown)
        elif not is_kept:
            _replace(old, new)
        kept = [f"the painting on {shown.name} (the new picture is {new.name})"] if is_kept else []
    for obj in _sharing(wearers):
        obj[PICTURE] = new
    return kept


def _sharing(wearers: list[bpy.types.Object]) -> list[bpy.types.Object]:
    """Some parts, and their linked duplicates: what a run makes of a mesh is theirs too."""
    meshes = {obj.data for obj in wearers}
    return [obj for obj in bpy.data.objects if obj.library is None and obj.get(PART) and obj.data in meshes]


def _replace(old: bpy.types.Image, new: bpy.types.Image) -> None:
    """Put a new picture, under the same name, wherever an old one is."""
    name = old.name
    old.user_remap(new)
    bpy.data.images.remove(old)
    new.name = name


def shown_picture(obj: bpy.types.Object) -> bpy.types.Image | None:
    """The picture that a part shows: one in its materials, ours before others; else the one that runs paint."""
    shown = [picture for worn in _materials([obj]) for picture in images(worn.node_tree)]
    ours = obj.get(PICTURE)
    return ours if ours in shown else next(iter(shown), ours)


def _picture(wearers: list[bpy.types.Object], look: Look) -> bpy.types.Image | None:
    """The picture of some parts; of an older version's, the one of its name in their materials, or the only one."""
    for obj in wearers:
        if obj.get(PICTURE) is not None:
            return obj[PICTURE]
    shown = [picture for worn in _materials(wearers) for picture in images(worn.node_tree)]
    named = [picture for picture in shown if picture.name.startswith(f"{OLDER} {look.name}")]
    return next(iter(named), shown[0] if len(set(shown)) == 1 else None)


def _others(wearers: list[bpy.types.Object], picture: bpy.types.Image) -> list[bpy.types.Object]:
    """Parts of other heads with the same picture; a linked copy shares all and is none."""
    meshes = {obj.data for obj in wearers}
    heads = [obj for obj in bpy.data.objects if obj.get(PART) and obj.type == "MESH" and obj.data not in meshes]
    return [obj for obj in heads if obj.get(PICTURE) == picture or _shows(obj, picture)]


def _shows(obj: bpy.types.Object, picture: bpy.types.Image) -> bool:
    return any(picture in images(worn.node_tree) for worn in _materials([obj]))


def _repaint(
    wearers: list[bpy.types.Object], others: list[bpy.types.Object], old: bpy.types.Image, new: bpy.types.Image
) -> None:
    """Put a new picture into materials; those that others wear too are copied, with all that the artist did to them."""
    theirs, own = set(_materials(others)), {}
    for slot in [slot for obj in wearers for slot in obj.material_slots]:
        worn = slot.material
        if worn is None or old not in images(worn.node_tree):
            continue
        if worn in theirs or worn.library is not None:
            own[worn] = own.get(worn) or worn.copy()
            slot.material = worn = own[worn]
        exchange(worn.node_tree, old, new)


def _materials(objects: list[bpy.types.Object]) -> list[bpy.types.Material]:
    return [slot.material for obj in objects for slot in obj.material_slots if slot.material is not None]
