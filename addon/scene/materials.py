"""Images and simple materials that every exporter reads."""

from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

LINEAR_TEETH = (0.62, 0.55, 0.45, 1.0)
LINEAR_TONGUE = (0.42, 0.14, 0.13, 1.0)
LINEAR_LASHES = (0.02, 0.015, 0.012, 0.3)


@dataclass(frozen=True)
class Look:
    """How a part looks: a picture, or a plain linear colour."""

    name: str
    roughness: float
    colour: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    pictured: bool = False
    # Lashes are a strip whose sheen would show what is no lash.
    specular: float = 0.5


LOOKS = {
    "skin": Look("Face skin", 0.55, pictured=True),
    "eye_left": Look("Face eyes", 0.1, pictured=True),
    "eye_right": Look("Face eyes", 0.1, pictured=True),
    "teeth_upper": Look("Face teeth", 0.25, LINEAR_TEETH),
    "teeth_lower": Look("Face teeth", 0.25, LINEAR_TEETH),
    "tongue": Look("Face tongue", 0.4, LINEAR_TONGUE),
    "lashes": Look("Face lashes", 0.8, LINEAR_LASHES, specular=0.0),
}


def image(name: str, pixels: NDArray[np.uint8]) -> bpy.types.Image:
    """The packed image of a name with these sRGB pixels, (height, width, 4), top row first; opaque."""
    height, width = pixels.shape[:2]
    picture = bpy.data.images.get(name)
    if picture is None:
        picture = bpy.data.images.new(name, width, height, alpha=False)
    elif tuple(picture.size) != (width, height):
        picture.scale(width, height)
    values = np.flipud(pixels).astype(np.float32) / 255.0
    values[..., 3] = 1.0
    picture.pixels.foreach_set(np.ascontiguousarray(values).ravel())
    picture.update()
    picture.pack()
    return picture


def material(look: Look, picture: bpy.types.Image | None) -> bpy.types.Material:
    """The material of a look; one that exists keeps what the artist did to it, and gets the new picture."""
    existing = bpy.data.materials.get(look.name)
    if existing is not None:
        return existing
    made = bpy.data.materials.new(look.name)
    if bpy.app.version < (5, 0):
        made.use_nodes = True
    # Solid view knows no nodes: without this, lashes and tongue are white there.
    made.diffuse_color = look.colour
    tree = made.node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Roughness"].default_value = look.roughness
    shader.inputs["Specular IOR Level"].default_value = look.specular
    shader.inputs["Base Color"].default_value = look.colour
    if picture is not None:
        texture = tree.nodes.new("ShaderNodeTexImage")
        texture.image = picture
        texture.location = (-300, 300)
        tree.links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    if look.colour[3] < 1.0:
        shader.inputs["Alpha"].default_value = look.colour[3]
        made.surface_render_method = "BLENDED"
    return made


def plain(name: str, colour: tuple[float, float, float, float]) -> bpy.types.Material:
    """The material of a name, rough and of one linear colour; one that exists stays as it is."""
    existing = bpy.data.materials.get(name)
    if existing is not None:
        return existing
    made = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):
        made.use_nodes = True
    made.diffuse_color = colour
    shader = next(node for node in made.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = colour
    shader.inputs["Roughness"].default_value = 0.9
    return made
