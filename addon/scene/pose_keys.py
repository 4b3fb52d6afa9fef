"""Keys of an object's location and rotation, in the layered actions since Blender 4.4 and the flat ones before."""

from typing import Any

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

PATHS = ("location", "rotation_quaternion")
# Numbers of Blender's enumerations, for arrays of keys.
LINEAR, AUTO_CLAMPED = 1, 4


def write(obj: bpy.types.Object, frames: NDArray[np.int64], poses: NDArray[np.float64]) -> None:
    """Let an object take (n, 4, 4) poses below its parent at ascending frames of the timeline, linear in between.

    Its former keys of location and rotation are replaced; what else is animated stays.
    """
    obj.rotation_mode = "QUATERNION"
    for path, values in zip(PATHS, (poses[:, :3, 3], quaternions(poses))):
        for index, column in enumerate(values.T):
            _fill(_curve(obj, path, index), frames, column)


def clear(obj: bpy.types.Object) -> None:
    """Take an object's keys of location and rotation away, and its action when nothing is left in it."""
    found = curves(obj)
    if found is None:
        return
    for curve in [curve for curve in found if curve.data_path in PATHS]:
        found.remove(curve)
    if len(found) == 0:
        action = obj.animation_data.action
        obj.animation_data.action = None
        if not action.users:
            bpy.data.actions.remove(action)


def quaternions(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 4) rotations of poses; neighbours have signs of the same half, so that none turns the long way round."""
    turns = np.array([Matrix(pose.tolist()).to_quaternion() for pose in poses], np.float64).reshape(-1, 4)
    flips = np.where((turns[1:] * turns[:-1]).sum(axis=1) < 0.0, -1.0, 1.0)
    turns[1:] *= np.cumprod(flips)[:, None]
    return turns


def _curve(obj: bpy.types.Object, path: str, index: int) -> bpy.types.FCurve:
    """The curve of a property, made when it is missing."""
    animation = obj.animation_data or obj.animation_data_create()
    if animation.action is None:
        animation.action = bpy.data.actions.new(obj.name)
    action = animation.action
    if hasattr(action, "fcurve_ensure_for_datablock"):
        return action.fcurve_ensure_for_datablock(obj, path, index=index)
    return action.fcurves.find(path, index=index) or action.fcurves.new(path, index=index)


def curves(data: bpy.types.ID) -> Any:
    """The collection with the curves of the action of an object, or other data; None without any."""
    animation = data.animation_data
    if animation is None or animation.action is None:
        return None
    if not hasattr(animation, "action_slot"):
        return animation.action.fcurves
    if animation.action_slot is None:
        return None
    strips = (strip for layer in animation.action.layers for strip in layer.strips)
    bags = (strip.channelbag(animation.action_slot) for strip in strips)
    return next((bag.fcurves for bag in bags if bag is not None), None)


def _fill(curve: bpy.types.FCurve, frames: NDArray[np.int64], values: NDArray[np.float64]) -> None:
    keys = curve.keyframe_points
    keys.clear()
    keys.add(len(frames))
    keys.foreach_set("co", np.stack([frames, values], axis=-1).astype(np.float32).ravel())
    keys.foreach_set("interpolation", np.full(len(frames), LINEAR, np.int32))
    for side in ("handle_left_type", "handle_right_type"):
        keys.foreach_set(side, np.full(len(frames), AUTO_CLAMPED, np.int32))
    curve.update()
