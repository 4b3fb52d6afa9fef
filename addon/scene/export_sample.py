"""What a head does over time: values of its keys and places of its parts, by frame."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from . import pose_keys
from .controls_find import of
from .export_bones import Skeleton
from .heads import Head

# Values of keys and places, in metres, that differ by less are the same.
SAME = 1e-6


@dataclass(frozen=True)
class Track:
    """A part over time."""

    # (frames, keys) values of all shape keys but the first.
    values: NDArray[np.float64]
    # (frames, 4, 4) places in the world.
    places: NDArray[np.float64]


def animated_range(head: Head) -> tuple[int, int] | None:
    """First and last frame of the keys that move a head; None where nothing does."""
    found: list[float] = []
    for owner in _moving(head):
        animation = owner.animation_data
        found += pose_keys.frames_of(owner)
        strips = [strip for layer in animation.nla_tracks for strip in layer.strips]
        found += [frame for strip in strips for frame in (strip.frame_start, strip.frame_end)]
    return (math.floor(min(found)), math.ceil(max(found))) if found else None


def over_time(
    scene: bpy.types.Scene,
    objects: dict[str, bpy.types.Object],
    frames: NDArray[np.int64],
    skeleton: Skeleton | None = None,
) -> dict[str, Track]:
    """What objects of a scene that no window shows do over time, by name, and a skeleton with them.

    Blender writes animated values back into data when it evaluates what a context shows. It does not for the state that
    a view layer has: so nothing of the artist's changes.
    """
    samples: dict[str, list[tuple[list[float], NDArray[np.float64]]]] = {name: [] for name in objects}
    for frame in frames.tolist():
        scene.frame_set(frame)
        state = scene.view_layers[0].depsgraph
        for name, obj in objects.items():
            samples[name].append(_now(obj, state))
        if skeleton is not None:
            skeleton.look(state)
    return {name: _track(found) for name, found in samples.items()}


def at_present(
    objects: dict[str, bpy.types.Object], state: bpy.types.Depsgraph, skeleton: Skeleton | None = None
) -> dict[str, Track]:
    """How objects are in the artist's scene, with changes that have no keys, and a skeleton with them."""
    if skeleton is not None:
        skeleton.look(state)
    return {name: _track([_now(obj, state)]) for name, obj in objects.items()}


def _now(obj: bpy.types.Object, state: bpy.types.Depsgraph) -> tuple[list[float], NDArray[np.float64]]:
    keys = obj.data.shape_keys
    blocks = list(keys.evaluated_get(state).key_blocks)[1:] if keys is not None else []
    return [0.0 if b.mute else b.value for b in blocks], np.array(obj.evaluated_get(state).matrix_world, np.float64)


def _track(samples: list[tuple[list[float], NDArray[np.float64]]]) -> Track:
    return Track(np.array([values for values, _ in samples], np.float64), np.array([place for _, place in samples]))


def _moving(head: Head) -> Iterator[bpy.types.ID]:
    """What can move a head and is animated: its objects, keys and controls, what carries them, what drivers read."""
    waiting: list[bpy.types.ID | None] = list(head.objects)
    if head.skin is not None and (armature := of(head.skin)) is not None:
        waiting.append(armature)
    seen: set[bpy.types.ID] = set()
    while waiting:
        owner = waiting.pop()
        if owner is None or owner in seen:
            continue
        seen.add(owner)
        if isinstance(owner, bpy.types.Object):
            waiting += [owner.parent, *(getattr(constraint, "target", None) for constraint in owner.constraints)]
            posed = [constraint for pose in owner.pose.bones for constraint in pose.constraints] if owner.pose else []
            waiting += [getattr(constraint, "target", None) for constraint in posed]
            waiting.append(getattr(owner.data, "shape_keys", None))
        animation = getattr(owner, "animation_data", None)
        if animation is not None:
            curves = animation.drivers
            waiting += [t.id for curve in curves for variable in curve.driver.variables for t in variable.targets]
            yield owner
