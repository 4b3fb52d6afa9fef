"""Where a head's joints are, and what its keys do to its eyes: measured on its meshes.

Places are in its skin's coordinates, metres.
"""

from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from .heads import SKIN, Head

Array = NDArray[np.float64]

# Joints in the generic head, which has its origin between the eyes, looks along -y, z up.
_JOINTS = {
    "base": (0.0, 0.115, -0.175),
    "skull": (0.0, 0.095, -0.055),
    "top": (0.0, 0.09, 0.118),
    "hinge": (0.0, 0.058, -0.055),
    "chin": (0.0, -0.02, -0.115),
    "eye_left": (0.0315, 0.0, 0.0),
    "eye_right": (-0.0315, 0.0, 0.0),
}
# The lines of the neck in the middle plane, of the generic head: places as (y, z), from the front to the back. Below
# the first nothing moves, above the second everything is skull.
_BASE = ((0.05, -0.2), (0.16, -0.165))
_SKULL = ((0.03, -0.127), (0.15, -0.065))


@dataclass(frozen=True)
class Aim:
    """How a key turns an eye: by how much what looks forward goes to the key's side, and loses of looking forward."""

    aside: float
    back: float


@dataclass(frozen=True)
class Anatomy:
    """The joints of a head by name, and the keys of the gaze."""

    joints: dict[str, Array]
    aims: dict[str, Aim]


def measure(head: Head) -> Anatomy:
    """The joints of a head: the generic one's, moved as its skin differs, the eyes' as their keys turn them."""
    skin = head.parts[SKIN]
    generic = generic_positions(skin)
    weights, *_ = np.linalg.lstsq(np.c_[generic, np.ones(len(generic))], positions(skin, 0), rcond=None)
    joints = {name: np.append(place, 1.0) @ weights for name, place in _JOINTS.items()}
    aims: dict[str, Aim] = {}
    for name, side in (("eye_left", "Left"), ("eye_right", "Right")):
        if name in head.parts:
            turned = _turned(head.parts[name], skin, side)
            aims |= {key: _aim(turn, key) for key, (turn, _) in turned.items()}
            joints[name] = _centre(list(turned.values())) if turned else joints[name]
    return Anatomy(joints, aims)


def neck_weights(generic: Array) -> dict[str, Array]:
    """How much each vertex of the skin, by its place in the generic head, goes with each bone; sums are 1."""
    low, high = (np.interp(generic[:, 1], *_extended(line)) for line in (_BASE, _SKULL))
    rise = np.clip((generic[:, 2] - low) / (high - low), 0.0, 1.0)
    # The head's share rises over the whole neck: a nod would fold the throat where it rises faster.
    root, head = 1.0 - _smooth(rise / 0.7), _smooth(rise)
    return {"root": root, "neck": np.clip(1.0 - root - head, 0.0, 1.0), "head": head}


def positions(obj: bpy.types.Object, key: int) -> Array:
    """(n, 3) vertices of a key by its number."""
    data = obj.data.shape_keys.key_blocks[key].data
    flat = np.empty(3 * len(data), np.float32)
    data.foreach_get("co", flat)
    return flat.reshape(-1, 3).astype(np.float64)


def generic_positions(obj: bpy.types.Object) -> Array:
    """(n, 3) places of a part's vertices in the generic head."""
    data = obj.data.attributes["generic_position"].data
    flat = np.empty(3 * len(data), np.float32)
    data.foreach_get("vector", flat)
    return flat.reshape(-1, 3).astype(np.float64)


def local(part: bpy.types.Object, skin: bpy.types.Object) -> Matrix:
    """A part's coordinates in its skin's."""
    if part.parent == skin:
        return part.matrix_parent_inverse @ part.matrix_basis
    return skin.matrix_world.inverted() @ part.matrix_world


def _extended(line: tuple[tuple[float, float], tuple[float, float]]) -> tuple[list[float], list[float]]:
    """A line through two places far beyond them, for interpolation."""
    (y0, z0), (y1, z1) = line
    slope = (z1 - z0) / (y1 - y0)
    return [y0 - 1.0, y1 + 1.0], [z0 - slope, z1 + slope]


def _smooth(rise: Array) -> Array:
    """From 0 to 1 without a bend at either end."""
    t = np.clip(rise, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def _turned(eye: bpy.types.Object, skin: bpy.types.Object, side: str) -> dict[str, tuple[Array, Array]]:
    """Rotation and translation that each key of the gaze is, as one value of it moves the eye."""
    blocks, place = eye.data.shape_keys.key_blocks, np.array(local(eye, skin), np.float64)
    rest = positions(eye, 0) @ place[:3, :3].T + place[:3, 3]
    found = {}
    for way in ("Up", "Down", "In", "Out"):
        number = blocks.find(f"eyeLook{way}{side}")
        if number > 0:
            moved = positions(eye, number) @ place[:3, :3].T + place[:3, 3]
            found[blocks[number].name] = _rigid(rest, moved)
    return found


def _rigid(here: Array, there: Array) -> tuple[Array, Array]:
    """The rotation and translation that bring points nearest to others, by Kabsch."""
    middle, target = here.mean(axis=0), there.mean(axis=0)
    left, _, right = np.linalg.svd((here - middle).T @ (there - target))
    sign = np.sign(np.linalg.det(right.T @ left.T))
    turn = right.T @ np.diag([1.0, 1.0, sign]) @ left.T
    return turn, target - turn @ middle


def _centre(turns: list[tuple[Array, Array]]) -> Array:
    """The place that no rotation moves."""
    sides = np.concatenate([np.eye(3) - turn for turn, _ in turns])
    centre, *_ = np.linalg.lstsq(sides, np.concatenate([by for _, by in turns]), rcond=None)
    return centre


def _aim(turn: Array, key: str) -> Aim:
    forward = np.array([0.0, -1.0, 0.0])
    moved = turn @ forward - forward
    return Aim(abs(moved[0] if "In" in key or "Out" in key else moved[2]), float(moved @ forward))
