"""Images and simple materials that every exporter reads."""

import hashlib
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

# Of an image: what its pixels were when it was made.
MADE = "facewright_made"
LINEAR_TEETH = (0.62, 0.55, 0.45, 1.0)
LINEAR_TONGUE = (0.42, 0.14, 0.13, 1.0)
LINEAR_LASHES = (0.02, 0.015, 0.012, 0.3)


@dataclass(frozen=True)
class Look:
    """How parts look: a picture, or a plain linear colour."""

    name: str
    roughness: float
    colour: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    # Lashes are a strip whose sheen would show what is no lash.
    specular: float = 0.5


SKIN = Look("skin", 0.55)
EYES = Look("eyes", 0.1)
TEETH = Look("teeth", 0.25, LINEAR_TEETH)
TONGUE = Look("tongue", 0.4, LINEAR_TONGUE)
LASHES = Look("lashes", 0.8, LINEAR_LASHES, specular=0.0)

# By the names of a head's parts.
LOOKS = {
    "skin": SKIN,
    "eye_left": EYES,
    "eye_right": EYES,
    "teeth_upper": TEETH,
    "teeth_lower": TEETH,
    "tongue": TONGUE,
    "lashes": LASHES,
}


def new_image(name: str, pixels: NDArray[np.uint8], like: bpy.types.Image | None = None) -> bpy.types.Image:
    """An image of sRGB pixels, (height, width, 4), top row first; opaque, packed into the file.

    What an artist has set on another image, such as its colour space, is so on one that is to be `like` it.
    """
    height, width = pixels.shape[:2]
    # One whose file was lost has nothing that could be given another size.
    if like is not None and len(like.pixels) > 0:
        picture = like.copy()
    else:
        picture = bpy.data.images.new(name, width, height, alpha=False)
    if tuple(picture.size) != (width, height):
        picture.scale(width, height)
    values = np.flipud(pixels).astype(np.float32) / 255.0
    values[..., 3] = 1.0
    picture.pixels.foreach_set(np.ascontiguousarray(values).ravel())
    picture.update()
    picture.pack()
    picture[MADE] = _fingerprint(picture)
    return picture


def copied(picture: bpy.types.Image) -> bpy.types.Image:
    """A copy of an image with all that is painted on it, saved or not."""
    copy = picture.copy()
    values = np.empty(len(picture.pixels), np.float32)
    picture.pixels.foreach_get(values)
    copy.pixels.foreach_set(values)
    copy.update()
    copy.pack()
    return copy


def is_painted(picture: bpy.types.Image) -> bool:
    """Whether an artist has changed the pixels of an image of ours; of an older version's, whether they are unsaved."""
    if MADE not in picture:
        return picture.is_dirty
    # One whose file was lost has no pixels: there is nothing to keep.
    return len(picture.pixels) > 0 and picture[MADE] != _fingerprint(picture)


def _fingerprint(picture: bpy.types.Image) -> str:
    """A short hash of an image's pixels in 8 bits, and of its size."""
    values = np.empty(len(picture.pixels), np.float32)
    picture.pixels.foreach_get(values)
    levels = np.rint(values * 255.0).astype(np.uint8)
    return hashlib.blake2b(levels.tobytes() + repr(tuple(picture.size)).encode(), digest_size=16).hexdigest()


def new_material(name: str, look: Look, picture: bpy.types.Image | None) -> bpy.types.Material:
    """A material of a look, with a picture if it has one."""
    made = bpy.data.materials.new(name)
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


def images(tree: bpy.types.NodeTree | None) -> list[bpy.types.Image]:
    """The images in the nodes of a material, those within groups too."""
    found: list[bpy.types.Image] = []
    for node in tree.nodes if tree is not None else []:
        if node.type == "GROUP":
            found += images(node.node_tree)
        elif node.type == "TEX_IMAGE" and node.image is not None:
            found.append(node.image)
    return found


def exchange(tree: bpy.types.NodeTree, old: bpy.types.Image, new: bpy.types.Image) -> None:
    """Put another image in the place of one; a group that others use too is copied."""
    for node in tree.nodes:
        if node.type == "TEX_IMAGE" and node.image == old:
            node.image = new
        elif node.type == "GROUP" and old in images(node.node_tree):
            if node.node_tree.users > 1:
                node.node_tree = node.node_tree.copy()
            exchange(node.node_tree, old, new)


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
