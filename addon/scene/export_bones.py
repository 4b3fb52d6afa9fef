"""The bones of a copied head: those of its controls that move the mesh, each frame's pose as keyframes.

Handles and whatever else leads keys stay where they are: what they do is in the keys.
"""

from dataclasses import dataclass, field

import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import NDArray

from . import pose_keys
from .controls_bones import edited
from .controls_mesh import modifier

Array = NDArray[np.float64]
# Places and turns that differ by less are the same.
_SAME = 1e-6


@dataclass
class Skeleton:
    """Bones of an armature that move meshes, and what they do, frame after frame."""

    armature: bpy.types.Object
    # Where the bones are at rest in the world, at the first frame looked at.
    rests: dict[str, Array] = field(default_factory=dict)
    # What each does to what follows it, in the world.
    moves: dict[str, list[Array]] = field(default_factory=dict)

    def look(self, state: bpy.types.Depsgraph) -> None:
        """Take note of a state."""
        shown = self.armature.evaluated_get(state)
        world = np.array(shown.matrix_world, np.float64)
        for bone in self.bones:
            rest = world @ np.array(bone.matrix_local, np.float64)
            pose = world @ np.array(shown.pose.bones[bone.name].matrix, np.float64)
            self.rests.setdefault(bone.name, rest)
            self.moves.setdefault(bone.name, []).append(pose @ np.linalg.inv(rest))

    @property
    def bones(self) -> list[bpy.types.Bone]:
        """Those that move meshes, a parent before what hangs on it."""
        return [bone for bone in self.armature.data.bones if bone.use_deform]


def skeleton_of(armature: bpy.types.Object | None) -> Skeleton | None:
    """What is to be looked at of controls; None without bones that move meshes."""
    found = Skeleton(armature) if armature is not None else None
    return found if found is not None and found.bones else None


def is_bound(obj: bpy.types.Object) -> bool:
    """Whether an object, or a copy of it, follows the bones of a head."""
    found = modifier(obj)
    return found is not None and found.object is not None and found.show_viewport


def armature(
    scene: bpy.types.Scene, skeleton: Skeleton, skin: Array, frames: NDArray[np.int64], scale: float
) -> bpy.types.Object:
    """An armature that stands where the skin stands, (frames, 4, 4), with the bones of a skeleton and what they do."""
    made = bpy.data.objects.new("Export", bpy.data.armatures.new("Export"))
    _build(made, skeleton, skin, scale)
    scene.collection.objects.link(made)
    _bake(made, skeleton, skin, frames, scale)
    return made


def _build(armature: bpy.types.Object, skeleton: Skeleton, skin: Array, scale: float) -> None:
    """Make the bones of a skeleton in an empty armature."""
    rests = {name: np.linalg.inv(skin[0]) @ rest for name, rest in skeleton.rests.items()}
    with edited(armature) as made:
        for bone in skeleton.bones:
            rest = _plain(rests[bone.name], scale)
            new = made.new(bone.name)
            new.head, new.tail = rest.translation, rest.translation + bone.length * scale * rest.col[1].to_3d()
            new.align_roll(rest.col[2].to_3d())
            new.parent = made.get(parent.name) if (parent := _parent(bone)) is not None else None


def _bake(armature: bpy.types.Object, skeleton: Skeleton, skin: Array, frames: NDArray[np.int64], scale: float) -> None:
    """Give the bones what those of the skeleton do, against a skin that moves."""
    inverse = np.linalg.inv(skin)
    poses = {}
    for bone in skeleton.bones:
        moves = inverse @ np.array(skeleton.moves[bone.name]) @ skin
        moves[:, :3, 3] *= scale
        poses[bone.name] = moves @ np.array(armature.data.bones[bone.name].matrix_local, np.float64)
    for bone in armature.data.bones:
        rest, local = np.array(bone.matrix_local, np.float64), poses[bone.name]
        if bone.parent is not None:
            rest = np.linalg.inv(np.array(bone.parent.matrix_local, np.float64)) @ rest
            local = np.linalg.inv(poses[bone.parent.name]) @ local
        _pose(armature.pose.bones[bone.name], np.linalg.inv(rest) @ local, frames)


def _pose(pose: bpy.types.PoseBone, places: Array, frames: NDArray[np.int64]) -> None:
    pose.rotation_mode = "QUATERNION"
    pose.matrix_basis = Matrix(places[0].tolist())
    if np.ptp(places, axis=0).max() <= _SAME:
        return
    parts = {"location": places[:, :3, 3], "rotation_quaternion": pose_keys.quaternions(places)}
    sizes = np.array([Matrix(place.tolist()).to_scale() for place in places])
    if np.abs(sizes - 1.0).max() > _SAME:
        parts["scale"] = sizes
    for path, values in parts.items():
        for index, column in enumerate(values.T):
            pose_keys.fill(pose.id_data, pose.path_from_id(path), index, frames, column)


def _plain(rest: Array, scale: float) -> Matrix:
    """A place without a size of its own, in the file's units."""
    place = Matrix(rest.tolist()).normalized()
    place.translation = Vector(rest[:3, 3].tolist()) * scale
    return place


def _parent(bone: bpy.types.Bone) -> bpy.types.Bone | None:
    """The nearest bone above that moves meshes too."""
    parent = bone.parent
    while parent is not None and not parent.use_deform:
        parent = parent.parent
    return parent
