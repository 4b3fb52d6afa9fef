"""Keys of what is animated, in the layered actions since Blender 4.4 and the flat ones before; poses of objects."""

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
            fill(obj, path, index, frames, column)


def fill(owner: bpy.types.ID, path: str, index: int, frames: NDArray[Any], values: NDArray[np.float64]) -> None:
    """Let a property of an object, or of shape keys, take values at ascending frames, linear in between."""
    fill_curve(curve_of(owner, path, index), frames, values)


def paths_of(owner: bpy.types.ID) -> set[tuple[str, int]]:
    """The properties that keys or strips animate, each with the position within it."""
    found = {(curve.data_path, curve.array_index) for curve in curves(owner) or []}
    strips = [strip for layer in owner.animation_data.nla_tracks for strip in layer.strips if strip.action is not None]
    return found | {(curve.data_path, curve.array_index) for strip in strips for curve in _all_curves(strip.action)}


def frames_of(owner: bpy.types.ID) -> list[float]:
    """First and last frame of the keys that animate something; empty without keys."""
    ranges = [curve.range() for curve in curves(owner) or [] if len(curve.keyframe_points)]
    return [min(first for first, _ in ranges), max(last for _, last in ranges)] if ranges else []


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


def curve_of(owner: bpy.types.ID, path: str, index: int, group: str = "") -> bpy.types.FCurve:
    """The curve of a property, made when it is missing, in a group of its action if one is named."""
    animation = owner.animation_data or owner.animation_data_create()
    if animation.action is None:
        animation.action = bpy.data.actions.new(owner.name)
    action = animation.action
    if hasattr(action, "fcurve_ensure_for_datablock"):
        curve = action.fcurve_ensure_for_datablock(owner, path, index=index)
        # Blender 4.4 and 4.5 take no name of a group there.
        bag = _bag(owner)
        if group and curve.group is None and bag is not None:
            curve.group = bag.groups.get(group) or bag.groups.new(group)
        return curve
    return action.fcurves.find(path, index=index) or action.fcurves.new(path, index=index, action_group=group)


def curves(owner: bpy.types.ID) -> Any:
    """The collection with the curves of what is animated; None without any."""
    animation = owner.animation_data
    if animation is None or animation.action is None:
        return None
    if not hasattr(animation, "action_slot"):
        return animation.action.fcurves
    bag = _bag(owner)
    return bag.fcurves if bag is not None else None


def _bag(owner: bpy.types.ID) -> Any:
    """What of a layered action is the owner's; None without anything."""
    animation = owner.animation_data
    if animation.action_slot is None:
        return None
    strips = (strip for layer in animation.action.layers for strip in layer.strips)
    bags = (strip.channelbag(animation.action_slot) for strip in strips)
    return next((bag for bag in bags if bag is not None), None)


def _all_curves(action: bpy.types.Action) -> list[bpy.types.FCurve]:
    """The curves of an action for whatever it animates."""
    if not hasattr(action, "layers"):
        return list(action.fcurves)
    bags = [bag for layer in action.layers for strip in layer.strips for bag in strip.channelbags]
    return [curve for bag in bags for curve in bag.fcurves]


def fill_curve(curve: bpy.types.FCurve, frames: NDArray[Any], values: NDArray[np.float64]) -> None:
    """Give a curve keys at ascending frames instead of those that it has, linear in between."""
    keys = curve.keyframe_points
    keys.clear()
    keys.add(len(frames))
    keys.foreach_set("co", np.stack([frames, values], axis=-1).astype(np.float32).ravel())
    keys.foreach_set("interpolation", np.full(len(frames), LINEAR, np.int32))
    for side in ("handle_left_type", "handle_right_type"):
        keys.foreach_set(side, np.full(len(frames), AUTO_CLAMPED, np.int32))
    curve.update()
