"""A small picture of a head, painted from its meshes and pictures without a window, and worn by its collection."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import radians

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from . import heads
from .heads import SKIN
from .looks import shown_picture

# Sides in pixels: of the asset's picture, of the list's, and how many times finer it is painted.
SIDE, ICON_SIDE, FINER = 256, 32, 2
# What of a head is seen with its mouth shut.
SEEN = (SKIN, "eye_left", "eye_right")
# The head is turned a little to its left, as portraits are.
TURN = Matrix.Rotation(radians(-18.0), 4, "Z")
# From the eye, after the turn; and how bright what turns away from it is.
LIGHT = np.array((-0.4, -0.75, 0.53), np.float32)
SHADOW = 0.45
# Of the picture's side: what the head takes.
FILLED = 0.96
# Steps per pixel of a triangle's longest side, so that no pixel is missed; in multiples, to take triangles together.
STEPS, COARSE = 1.3, 4

Floats = NDArray[np.float32]


@dataclass(frozen=True)
class Surface:
    """Triangles: (t, 3, 3) corners after the turn, (t, 3, 2) places in the picture, and the colours of that."""

    corners: Floats
    uvs: Floats
    # (height, width, 4), bottom row first; of one pixel for what has no picture.
    colours: Floats


def portray(scene: bpy.types.Scene, skin: bpy.types.Object) -> None:
    """Let the collection of a skin's head, if it has one of its own, show it as it is now."""
    head = next(head for head in heads.heads(scene) if head.skin == skin)
    if head.home is not None:
        hang(head.home, head.parts)


def hang(home: bpy.types.Collection, parts: dict[str, bpy.types.Object]) -> None:
    """Let a collection show a head in lists and in the asset browser."""
    fine = paint(parts, SIDE * FINER)
    preview = home.preview_ensure()
    preview.image_size, preview.icon_size = (SIDE, SIDE), (ICON_SIDE, ICON_SIDE)
    preview.image_pixels_float.foreach_set(_smaller(fine, FINER).ravel())
    preview.icon_pixels_float.foreach_set(_smaller(fine, SIDE * FINER // ICON_SIDE).ravel())


def paint(parts: dict[str, bpy.types.Object], side: int) -> Floats:
    """A head at rest as (side, side, 4) of sRGB and opacity, bottom row first; nothing of one without a surface."""
    skin = parts[SKIN]
    surfaces = [_surface(parts[name], skin) for name in SEEN if name in parts and parts[name].data.polygons]
    picture, nearest = np.zeros((side * side, 4), np.float32), np.full(side * side, np.inf, np.float32)
    if surfaces:
        every = np.concatenate([surface.corners.reshape(-1, 3) for surface in surfaces])
        low, high = every.min(axis=0), every.max(axis=0)
        scale = FILLED * side / max(float((high - low)[[0, 2]].max()), 1e-6)
        middle = (low + high) / 2.0
        for surface in surfaces:
            _draw(surface, middle, scale, picture, nearest)
    return picture.reshape(side, side, 4)


def _draw(surface: Surface, middle: Floats, scale: float, picture: Floats, nearest: Floats) -> None:
    """Paint what of a surface is turned to the eye and nearer than what is there; the eye looks along y."""
    side = round(len(nearest) ** 0.5)
    edges = surface.corners[:, 1:] - surface.corners[:, :1]
    normals = np.cross(edges[:, 0], edges[:, 1])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-20)
    seen = normals[:, 1] < 0.0
    shades = SHADOW + (1.0 - SHADOW) * np.clip(normals @ LIGHT, 0.0, 1.0)
    light = np.stack([shades, shades, shades, np.ones_like(shades)], axis=-1)
    corners = (surface.corners - middle) * scale + side / 2.0
    for triangles, weights in _samples(corners, seen):
        points = weights @ corners[triangles]
        columns, rows = points[..., 0].astype(np.int64), points[..., 2].astype(np.int64)
        pixels = (np.clip(rows, 0, side - 1) * side + np.clip(columns, 0, side - 1)).ravel()
        depths = points[..., 1].ravel().astype(np.float32)
        np.minimum.at(nearest, pixels, depths)
        front = np.flatnonzero(depths <= nearest[pixels])
        owners, places = np.divmod(front, len(weights))
        uvs = np.einsum("nk,nkc->nc", weights[places], surface.uvs[triangles[owners]])
        picture[pixels[front]] = _colours(surface, uvs) * light[triangles[owners]]


def _samples(corners: Floats, seen: NDArray[np.bool_]) -> Iterator[tuple[NDArray[np.int64], Floats]]:
    """Numbers of triangles with (n, 3) weights of their corners that reach every pixel of them."""
    sides = np.linalg.norm((corners - np.roll(corners, 1, axis=1))[..., [0, 2]], axis=2).max(axis=1)
    steps = COARSE * np.ceil(np.maximum(STEPS * sides, 1.0) / COARSE).astype(np.int64)
    for count in np.unique(steps[seen]):
        at = (np.arange(count, dtype=np.float32) + 0.5) / count
        second, third = (grid.ravel() for grid in np.meshgrid(at, at))
        inside = second + third <= 1.0
        weights = np.stack([1.0 - second - third, second, third], axis=-1)[inside]
        yield np.flatnonzero(seen & (steps == count)), weights


def _colours(surface: Surface, uvs: Floats) -> Floats:
    height, width = surface.colours.shape[:2]
    columns = np.clip((uvs[..., 0] * width).astype(np.int64), 0, width - 1)
    rows = np.clip((uvs[..., 1] * height).astype(np.int64), 0, height - 1)
    colours = surface.colours[rows, columns]
    colours[..., 3] = 1.0
    return colours


def _surface(part: bpy.types.Object, skin: bpy.types.Object) -> Surface:
    mesh = part.data
    mesh.calc_loop_triangles()
    triangles, loops = (_numbers(mesh.loop_triangles, name) for name in ("vertices", "loops"))
    places = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", places)
    matrix = np.array(TURN @ _below(part, skin), np.float32)
    turned = places.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
    uvs, layer = np.zeros(2 * len(mesh.loops), np.float32), mesh.uv_layers.active
    if layer is not None:
        layer.data.foreach_get("uv", uvs)
    return Surface(turned[triangles], uvs.reshape(-1, 2)[loops], _pixels(part))


def _numbers(triangles: bpy.types.bpy_prop_collection, name: str) -> NDArray[np.int32]:
    """(t, 3) numbers of vertices or of corners."""
    numbers = np.empty(3 * len(triangles), np.int32)
    triangles.foreach_get(name, numbers)
    return numbers.reshape(-1, 3)


def _below(part: bpy.types.Object, skin: bpy.types.Object) -> Matrix:
    """Where a part is below the skin, at once: Blender knows the place of new objects only later."""
    matrix, at = Matrix.Identity(4), part
    while at is not None and at != skin:
        matrix, at = at.matrix_parent_inverse @ at.matrix_basis @ matrix, at.parent
    return matrix


def _pixels(part: bpy.types.Object) -> Floats:
    """What a part shows, (height, width, 4), bottom row first."""
    picture = shown_picture(part)
    if picture is None or len(picture.pixels) == 0 or picture.channels != 4:
        worn = part.active_material
        return np.array(worn.diffuse_color if worn is not None else (0.8,) * 4, np.float32).reshape(1, 1, 4)
    values = np.empty(len(picture.pixels), np.float32)
    picture.pixels.foreach_get(values)
    return values.reshape(picture.size[1], picture.size[0], 4)


def _smaller(picture: Floats, times: int) -> Floats:
    """A picture by whole times smaller; colours are means of what is opaque."""
    side = len(picture) // times
    blocks = picture.reshape(side, times, side, times, 4)
    opaque = blocks[..., 3:].sum(axis=(1, 3))
    colours = (blocks[..., :3] * blocks[..., 3:]).sum(axis=(1, 3)) / np.maximum(opaque, 1.0)
    return np.concatenate([np.clip(colours, 0.0, 1.0), opaque / times**2], axis=-1).astype(np.float32)
