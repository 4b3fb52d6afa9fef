"""A head while it is being made: drawn into the 3D views, no data of the file.

Nothing is left of it when the work ends or is cancelled, and undo knows nothing of it.
"""

import time
from typing import Any, ClassVar

import bpy
import gpu
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import NDArray

from ..engine import Reconstruction
from .axes import to_blender

# Seconds that a shape takes to become the next one.
TURN_SECONDS = 0.4
# sRGB of plain skin, and of an eye: its front's parts …
SKIN = (0.80, 0.64, 0.55)
WHITE, IRIS, PUPIL = (0.92, 0.91, 0.90), (0.30, 0.22, 0.17), (0.04, 0.03, 0.03)
# … which are so far from its middle, as parts of an eyeball's radius: 6 and 2 of 12 mm.
IRIS_RADIUS, PUPIL_RADIUS = 0.5, 0.17
# Where the light comes from in the head's own axes, and the part of it that comes from everywhere.
LIGHT = np.array([-0.35, -0.80, 0.50], np.float32) / np.linalg.norm([0.35, 0.80, 0.50])
AMBIENT = 0.35

Positions = NDArray[np.float32]


class Sketch:
    """The shape that is drawn, in the 3D views of one scene; at most one of them is."""

    drawn: ClassVar["Sketch | None"] = None

    def __init__(self, scene: bpy.types.Scene, generic: Reconstruction, place: Vector) -> None:
        """A head of the generic one's faces, which is the first shape, standing at a place of the scene."""
        # Lashes are strips that only their pictures make hair of.
        drawn = [range(*quads) for name, _, quads in generic.parts if name != "lashes"]
        quads = generic.quads[np.concatenate(drawn)].astype(np.int32)
        self._triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
        self._colours = _colours(generic)
        # By its number, which undo leaves as it is: the scene may be gone.
        self._scene, self._place = scene.session_uid, place.copy()
        self._before = self._after = to_blender(generic.positions)
        self._since = 0.0
        self._handle: Any = None

    def show(self, positions: Positions) -> None:
        """Turn into a shape: (n, 3) in the head frame, metres."""
        self._before, self._after, self._since = self._shape(), to_blender(positions), time.monotonic()
        if self._handle is None:
            Sketch.drawn = self
            self._handle = bpy.types.SpaceView3D.draw_handler_add(self._draw, (), "WINDOW", "POST_VIEW")

    def end(self) -> None:
        """Draw nothing more."""
        if self._handle is not None:
            bpy.types.SpaceView3D.draw_handler_remove(self._handle, "WINDOW")
            self._handle = None
            Sketch.drawn = None

    def _shape(self) -> Positions:
        part = min((time.monotonic() - self._since) / TURN_SECONDS, 1.0)
        return self._before + np.float32(part) * (self._after - self._before)

    def _draw(self) -> None:
        if bpy.context.scene.session_uid != self._scene:
            return
        shape = self._shape()
        shader = gpu.shader.from_builtin("SMOOTH_COLOR")
        batch = _batch(shader, shape, self._triangles, lit(shape, self._triangles, self._colours))
        gpu.state.depth_test_set("LESS_EQUAL")
        gpu.state.depth_mask_set(True)
        gpu.state.face_culling_set("BACK")
        with gpu.matrix.push_pop():
            gpu.matrix.multiply_matrix(Matrix.Translation(self._place))
            batch.draw(shader)
        gpu.state.face_culling_set("NONE")
        gpu.state.depth_mask_set(False)
        gpu.state.depth_test_set("NONE")


def forget() -> None:
    """Draw nothing, whatever work goes on."""
    if Sketch.drawn is not None:
        Sketch.drawn.end()


def lit(positions: Positions, triangles: NDArray[np.int32], colours: Positions) -> Positions:
    """Colours of vertices in the light, (n, 4), by the normals of the (m, 3) triangles around them."""
    corners = positions[triangles]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(positions)
    for corner in range(3):
        for axis in range(3):
            normals[:, axis] += np.bincount(triangles[:, corner], faces[:, axis], len(positions))
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    facing = np.clip((normals / np.maximum(lengths, 1e-12)) @ LIGHT, 0.0, 1.0)
    shade = (AMBIENT + (1.0 - AMBIENT) * facing)[:, None].astype(np.float32)
    return np.concatenate([colours * shade, np.ones((len(colours), 1), np.float32)], axis=1)


def _colours(generic: Reconstruction) -> Positions:
    colours = np.tile(np.array(SKIN, np.float32), (len(generic.positions), 1))
    for name, (first, end), _ in generic.parts:
        if name.startswith("eye"):
            colours[first:end] = _eye(generic.positions[first:end])
    return colours


def _eye(positions: Positions) -> Positions:
    """Colours of an eyeball that looks straight ahead, along z."""
    middle = (positions.min(axis=0) + positions.max(axis=0)) / 2.0
    aside = np.linalg.norm((positions - middle)[:, :2], axis=1) / np.ptp(positions[:, 0]) * 2.0
    rings = np.where(aside < PUPIL_RADIUS, 2, np.where(aside < IRIS_RADIUS, 1, 0))
    rings[positions[:, 2] < middle[2]] = 0
    return np.array([WHITE, IRIS, PUPIL], np.float32)[rings]


def _batch(
    shader: gpu.types.GPUShader, positions: Positions, triangles: NDArray[np.int32], colours: Positions
) -> gpu.types.GPUBatch:
    vertices = gpu.types.GPUVertBuf(shader.format_calc(), len(positions))
    vertices.attr_fill("pos", np.ascontiguousarray(positions, np.float32))
    vertices.attr_fill("color", np.ascontiguousarray(colours, np.float32))
    faces = gpu.types.GPUIndexBuf(type="TRIS", seq=np.ascontiguousarray(triangles))
    return gpu.types.GPUBatch(type="TRIS", buf=vertices, elem=faces)
