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
    for slot in [slot for obj in objects.values() for slot in obj.material_slots if slot.material is not None]:
        material = slot.material
        if material not in worn:
            worn[material] = material.copy()
            names.give(worn[material], _titled(title, names.of(material)))
            for picture in set(images(material.node_tree)):
                if picture not in shown:
                    shown[picture] = _packed(picture)
                    names.give(shown[picture], _titled(title, names.of(picture)))
                exchange(worn[material].node_tree, picture, shown[picture])
        slot.material = worn[material]
    for copy in shown.values():
        copy.filepath_raw = f"//{copy.name}{SUFFIXES.get(copy.file_format, '.png')}"


def _titled(title: str, name: str) -> str:
    """A name that begins with the head's."""
    plain = identifier(name)
    return plain if plain.startswith(title) else f"{title}_{plain}"


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
