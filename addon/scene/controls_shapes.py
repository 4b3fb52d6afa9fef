"""How the bones of a head's controls are drawn: objects of lines, which are in no scene."""

from collections.abc import Sequence
from math import cos, pi, sin

import bpy
from mathutils import Vector

from .controls_find import reach
from .controls_layout import HANDLES, HEAD, JAW, NECK, TRAVEL, Handle

# Of an object: it is one of ours.
SHAPE = "facewright_shape"
Point = tuple[float, float, float]
Lines = tuple[list[Point], list[tuple[int, int]]]

_STEPS = 32
# Of letters, in travels.
_LETTERS, _TITLE = 0.5, 0.8
# The panel's half width and half height, in travels.
_PANEL_SIZE = (9.4, 10.9)


class Shapes:
    """The shapes of one armature: each made when it is first needed."""

    def __init__(self, armature: bpy.types.Object) -> None:
        self._armature = armature
        self._knob: bpy.types.Object | None = None

    def knob(self) -> bpy.types.Object:
        """What is dragged in the panel."""
        self._knob = self._knob or _object("Handle", _joined([_ring(0.42 * TRAVEL), _ring(0.16 * TRAVEL)]))
        return self._knob

    def panel(self) -> bpy.types.Object:
        """The panel's frame, with the ways of the handles and what they are called."""
        width, height = (TRAVEL * size for size in _PANEL_SIZE)
        drawn = [_frame(0.0, 0.0, width, height)]
        for handle in HANDLES:
            drawn += _way(handle, [TRAVEL * reach(self._armature, key) if key else 0.0 for key in handle.keys])
        edge = TRAVEL * (_PANEL_SIZE[1] - 1.1)
        for letter, u in (("R", -TRAVEL * 8.4), ("L", TRAVEL * 8.4)):
            drawn.append(_written(letter, u, edge, TRAVEL * _TITLE))
        return _object("Panel", _joined(drawn))

    def target(self) -> bpy.types.Object:
        """What the eyes look at."""
        rings = [_ring(0.012, (side * 0.0315, 0.0, 0.0)) for side in (-1.0, 1.0)]
        return _object("Target", _joined([_frame(0.0, 0.0, 0.05, 0.018), *rings]))

    def joint(self, role: str, length: float) -> bpy.types.Object:
        """A bone that moves the head, by its role; shapes lie about the bone, which goes from 0 along y."""
        if role == HEAD:
            return _object("Head", _turned(_ring(0.075), (0.0, length + 0.02, 0.0)))
        if role == NECK:
            return _object("Neck", _turned(_ring(0.085), (0.0, 0.4 * length, 0.0)))
        if role == JAW:
            return _object("Jaw", _turned(_ring(0.05, (0.0, -0.01, 0.0), -0.28, 0.28), (0.0, length, 0.0)))
        return _object("Root", _turned(_frame(0.0, 0.0, 0.11, 0.09), (0.0, -0.01, 0.0)))


def forget(armature: bpy.types.Object) -> None:
    """Remove the shapes of an armature's bones that nothing else wears."""
    worn = {pose.custom_shape for pose in armature.pose.bones}
    shapes = [shape for shape in worn if shape is not None and SHAPE in shape]
    for pose in armature.pose.bones:
        if pose.custom_shape in shapes:
            pose.custom_shape = None
    for shape in shapes:
        if not shape.users:
            mesh = shape.data
            bpy.data.objects.remove(shape)
            bpy.data.meshes.remove(mesh)


def _object(name: str, lines: Lines) -> bpy.types.Object:
    mesh = bpy.data.meshes.new(f"Controls {name}")
    mesh.from_pydata(*lines, [])
    shape = bpy.data.objects.new(f"Controls {name}", mesh)
    shape[SHAPE] = True
    return shape


def _joined(parts: list[Lines]) -> Lines:
    points: list[Point] = []
    edges: list[tuple[int, int]] = []
    for places, between in parts:
        edges += [(a + len(points), b + len(points)) for a, b in between]
        points += places
    return points, edges


def _ring(radius: float, centre: Point = (0.0, 0.0, 0.0), first: float = 0.0, last: float = 1.0) -> Lines:
    """A circle, or a part of one, that is seen from the front."""
    turns = [2.0 * pi * (first + (last - first) * step / _STEPS) for step in range(_STEPS + 1)]
    points = [(centre[0] + radius * sin(turn), centre[1] + radius * cos(turn), centre[2]) for turn in turns]
    return points, [(step, step + 1) for step in range(_STEPS)]


def _frame(u: float, v: float, width: float, height: float) -> Lines:
    corners = [(u - width, v - height), (u + width, v - height), (u + width, v + height), (u - width, v + height)]
    return [(x, y, 0.0) for x, y in corners], [(0, 1), (1, 2), (2, 3), (3, 0)]


def _turned(lines: Lines, offset: Point) -> Lines:
    """A shape that lies across its bone."""
    points, edges = lines
    return [(x + offset[0], offset[1], y + offset[2]) for x, y, _ in points], edges


def _way(handle: Handle, ends: Sequence[float]) -> list[Lines]:
    """Where a handle can go, to the right, left, up and down, and what it is called below that."""
    u, v = (TRAVEL * part for part in handle.place)
    right, left, up, down = ends
    middle = (u + (right - left) / 2.0, v + (up - down) / 2.0)
    margin = 0.12 * TRAVEL
    box = _frame(*middle, (right + left) / 2.0 + margin, (up + down) / 2.0 + margin)
    cross = [(u - left, v, 0.0), (u + right, v, 0.0), (u, v - down, 0.0), (u, v + up, 0.0)]
    rest = _ring(0.08 * TRAVEL, (u, v, 0.0))
    lowest = v - max(down, 0.45 * TRAVEL) - 0.75 * TRAVEL
    return [box, (cross, [(0, 1), (2, 3)]), rest, _written(handle.label, u, lowest, TRAVEL * _LETTERS)]


def _written(text: str, u: float, v: float, size: float) -> Lines:
    """A text in outlines, its middle at u, standing on v."""
    curve = bpy.data.curves.new("Letters", "FONT")
    curve.body, curve.size, curve.align_x, curve.fill_mode = text, size, "CENTER", "NONE"
    curve.resolution_u = 2
    letters = bpy.data.objects.new("Letters", curve)
    try:
        mesh = letters.to_mesh()
        shift = Vector((u, v, 0.0))
        points = [tuple(vertex.co + shift) for vertex in mesh.vertices]
        edges = [tuple(edge.vertices) for edge in mesh.edges]
        letters.to_mesh_clear()
    finally:
        bpy.data.objects.remove(letters)
        bpy.data.curves.remove(curve)
    return [(x, y, z) for x, y, z in points], [(a, b) for a, b in edges]
