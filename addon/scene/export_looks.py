"""Materials and pictures of a copied head."""

import bpy
import numpy as np

from ..engine import FacewrightError
from .export_names import Names, identifier
from .materials import exchange, images

# Endings of pictures by Blender's names of their formats.
SUFFIXES = {"PNG": ".png", "JPEG": ".jpg", "TARGA": ".tga", "TIFF": ".tif", "OPEN_EXR": ".exr"}


def dress(objects: dict[str, bpy.types.Object], title: str, names: Names) -> None:
    """Give the copies materials and packed pictures of their own, named as files are."""
    worn: dict[bpy.types.Material, bpy.types.Material] = {}
    shown: dict[bpy.types.Image, bpy.types.Image] = {}
    for slot in [slot for obj in objects.values() for slot in obj.material_slots]:
        material = slot.material
        if material is None:
            continue
        if material not in worn:
            worn[material] = material.copy()
            names.give(worn[material], _titled(title, material.name, worn))
            for picture in set(images(material.node_tree)):
                shown[picture] = shown.get(picture) or _packed(picture)
                exchange(worn[material].node_tree, picture, shown[picture])
        slot.material = worn[material]
    for picture, copy in shown.items():
        name = _titled(title, picture.name, {})
        names.give(copy, name)
        copy.filepath_raw = f"//{name}{SUFFIXES.get(copy.file_format, '.png')}"


def _titled(title: str, name: str, taken: dict[bpy.types.Material, bpy.types.Material]) -> str:
    """A name that begins with the head's; different from those that are taken."""
    plain = identifier(name)
    wanted = plain if plain.startswith(title) else f"{title}_{plain}"
    count = sum(copy.name.startswith(wanted) for copy in taken.values())
    return wanted if count == 0 else f"{wanted}_{count}"


def _packed(picture: bpy.types.Image) -> bpy.types.Image:
    """A packed copy of a picture as it is shown, with strokes that the artist has not saved."""
    if picture.is_dirty:
        return _painted(picture)
    copy = picture.copy()
    if picture.source == "FILE" and picture.packed_file is None:
        copy.filepath_raw = bpy.path.abspath(picture.filepath_raw, library=picture.library)
        try:
            copy.pack()
        except RuntimeError as error:
            raise FacewrightError(
                f"the picture {picture.name} cannot be read: find it, or take it out of the material"
            ) from error
    return copy


def _painted(picture: bpy.types.Image) -> bpy.types.Image:
    # Of 24 or 96 bits: a picture without alpha must not get one, as readers take it for what is transparent.
    alpha = picture.depth in (32, 128)
    copy = bpy.data.images.new(picture.name, *picture.size, alpha=alpha, float_buffer=picture.is_float)
    copy.colorspace_settings.name = picture.colorspace_settings.name
    pixels = np.empty(4 * picture.size[0] * picture.size[1], np.float32)
    picture.pixels.foreach_get(pixels)
    copy.pixels.foreach_set(pixels)
    copy.update()
    copy.pack()
    return copy
