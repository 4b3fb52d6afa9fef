"""An artist's keyframes: from the keys to what leads them, and back."""

from collections.abc import Iterable

import bpy
import numpy as np
from numpy.typing import NDArray

from . import export_sample, pose_keys
from .controls_find import bones, led, of, reach
from .controls_layout import LINKS, Axis, axes
from .controls_pose import ROUNDING, channels_of, set_axis, split, value_of
from .export_sample import SAME
from .heads import Head
from .keys import key_channel

Curves = dict[str, bpy.types.FCurve]
# What of a keyframe is the artist's besides its place.
_TRAITS = (
    "interpolation",
    "easing",
    "back",
    "period",
    "type",
    "handle_left_type",
    "handle_right_type",
)
_CURVE_TRAITS = ("extrapolation", "color_mode", "color", "hide", "lock")
# Between keyframes a curve is looked at so often for each frame.
_LOOKS = 4


def refusal(block: bpy.types.ShapeKey) -> str:
    """Why an animated key cannot be led by bones without a loss; empty if it can."""
    keys, channel = block.id_data, key_channel(block)
    animation = keys.animation_data
    if animation is None:
        return ""
    paths = {curve.data_path for curve in animation.drivers}
    if channel.full_path in paths:
        return "has a driver"
    if any(len(track.strips) for track in animation.nla_tracks):
        return "is animated by strips"
    curve = channel.curve
    if curve is not None and (curve.mute or len(curve.modifiers) or not len(curve.keyframe_points)):
        return "has a muted channel, or one with modifiers or samples"
    return ""


def to_bones(skin: bpy.types.Object, armature: bpy.types.Object, names: Iterable[str]) -> None:
    """Give bones the values and keyframes of keys that they are about to lead, which lose theirs."""
    taken = set(names)
    blocks, found = skin.data.shape_keys.key_blocks, bones(armature)
    _own_action(skin.data.shape_keys)
    for axis, keys in axes().items():
        ours = {key: blocks[key].value for key in keys if key in taken}
        if not ours:
            continue
        curves = {key: curve for key in ours if (curve := key_channel(blocks[key]).curve) is not None}
        _carry(found[axis.role], axis, keys, ours, curves)
        for curve in curves.values():
            pose_keys.curves(skin.data.shape_keys).remove(curve)
    _forget_empty(skin.data.shape_keys)


def from_bones(head: Head) -> None:
    """Give the keys that bones lead their present values, and keyframes of those over time; no driver sets them."""
    skin = head.skin
    assert skin is not None, "a head that is led has a skin"
    armature = of(skin)
    assert armature is not None, "a head that is led has an armature"
    names, blocks = sorted(led(skin)), skin.data.shape_keys.key_blocks
    frames, values = _over_time(skin, armature, export_sample.animated_range(head), names)
    now = {name: blocks[name].value for name in names}
    for number, name in enumerate(names):
        blocks[name].driver_remove("value")
        blocks[name].value = now[name]
        column = values[:, number] if len(frames) else np.zeros(0)
        pose = bones(armature)[LINKS[name].axis.role]
        is_keyed = any(channel.curve is not None for channel in channels_of(pose, name))
        if len(column) and (is_keyed or np.ptp(column) > SAME):
            kept = _needed(column)
            channel = key_channel(blocks[name])
            curve = pose_keys.curve_of(skin.data.shape_keys, channel.full_path, 0, channel.group)
            pose_keys.fill_curve(curve, frames[kept], column[kept])


def _carry(
    pose: bpy.types.PoseBone, axis: Axis, keys: tuple[str, str], values: dict[str, float], curves: Curves
) -> None:
    """Keyframes of two opposite keys to the axis that leads them."""
    place = channels_of(pose, next(key for key in values))[0]
    if place.curve is not None:
        # It leads the opposite key already.
        for key in values:
            _to_rest(pose, key, values[key], curves.get(key))
        return
    moving = {key: curve for key, curve in curves.items() if _range(curve) != (0.0, 0.0)}
    leading = next(iter(moving or curves), None)
    is_alone = len(moving) <= 1 and all(values[key] == 0.0 for key in values if key not in curves)
    if leading is None:
        set_axis(pose, axis, keys, values)
    elif is_alone and _fits(curves[leading], reach(pose.id_data, leading)):
        set_axis(pose, axis, keys, values)
        target = pose_keys.curve_of(pose.id_data, place.full_path, axis.index, pose.name)
        _copy(curves[leading], target, LINKS[leading].full)
    elif len(curves) == 1 or any(curve.extrapolation != "CONSTANT" for curve in curves.values()):
        for key in values:
            _to_rest(pose, key, values[key], curves.get(key))
    else:
        _sample(pose, axis, keys, values, curves)


def _to_rest(pose: bpy.types.PoseBone, key: str, value: float, curve: bpy.types.FCurve | None) -> None:
    """A key's keyframes as they are, to its own property of the bone."""
    pose[key] = value - (value_of(pose, key) - float(pose[key]))
    if curve is not None:
        rest = channels_of(pose, key)[1]
        _copy(curve, pose_keys.curve_of(pose.id_data, rest.full_path, 0, pose.name), 1.0)


def _sample(
    pose: bpy.types.PoseBone, axis: Axis, keys: tuple[str, str], values: dict[str, float], curves: Curves
) -> None:
    """Two opposite keys that take turns: one axis for every frame, and what it cannot say."""
    frames = _frames(curves.values())
    columns = {key: [value] * len(frames) for key, value in values.items()}
    columns |= {key: [curve.evaluate(f) for f in frames] for key, curve in curves.items()}
    said = [split(pose.id_data, keys, dict(zip(columns, row))) for row in zip(*columns.values())]
    set_axis(pose, axis, keys, values)
    for channel in (channels_of(pose, next(iter(values)))[0], *(channels_of(pose, key)[1] for key in values)):
        name = channel.path.strip('[]"')
        column = np.array([rests.get(name, place) for place, rests in said], np.float64)
        if name not in values or np.any(column):
            kept = _needed(column)
            curve = pose_keys.curve_of(pose.id_data, channel.full_path, max(channel.index, 0), pose.name)
            pose_keys.fill_curve(curve, frames[kept], column[kept])


def _copy(source: bpy.types.FCurve, target: bpy.types.FCurve, scale: float) -> None:
    """A curve as it is, with other values."""
    points = target.keyframe_points
    points.clear()
    points.add(len(source.keyframe_points))
    for old, new in zip(source.keyframe_points, points):
        for trait in _TRAITS:
            setattr(new, trait, getattr(old, trait))
        new.amplitude = old.amplitude * abs(scale)
        for place in ("co", "handle_left", "handle_right"):
            frame, value = getattr(old, place)
            setattr(new, place, (frame, value * scale))
    for trait in _CURVE_TRAITS:
        setattr(target, trait, getattr(source, trait))
    target.update()


def _range(curve: bpy.types.FCurve) -> tuple[float, float]:
    """The least and the greatest value of a curve, between its keyframes too."""
    first, last = curve.range()
    looks = np.linspace(first, last, max(2, round(_LOOKS * (last - first)) + 1))
    values = [curve.evaluate(float(frame)) for frame in looks] + [point.co.y for point in curve.keyframe_points]
    return min(values), max(values)


def _fits(curve: bpy.types.FCurve, end: float) -> bool:
    """Whether a handle can say all that a curve does: from 0 to its end, before and after its keyframes too."""
    low, high = _range(curve)
    return low >= 0.0 and high <= end + ROUNDING and curve.extrapolation == "CONSTANT"


def _frames(curves: Iterable[bpy.types.FCurve]) -> NDArray[np.float64]:
    """Every frame of curves from the first keyframe to the last, and keyframes between frames."""
    at = [point.co.x for curve in curves for point in curve.keyframe_points]
    whole = np.arange(np.floor(min(at)), np.ceil(max(at)) + 1.0)
    return np.unique(np.concatenate([whole, np.array(at, np.float64)])) if at else np.zeros(0)


def _needed(column: NDArray[np.float64]) -> NDArray[np.int64]:
    """The numbers of samples that are needed where the others lie between equal ones."""
    same = np.abs(np.diff(column)) <= SAME
    inner = np.concatenate([[False], same[:-1] & same[1:], [False]]) if len(column) > 2 else np.zeros(len(column), bool)
    return np.flatnonzero(~inner)


def _over_time(
    skin: bpy.types.Object, armature: bpy.types.Object, span: tuple[int, int] | None, names: list[str]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Frames, and the values of keys at them; none where nothing moves."""
    if span is None or not names:
        return np.zeros(0), np.zeros((0, len(names)))
    at = [point.co.x for curve in pose_keys.curves(armature) or [] for point in curve.keyframe_points]
    frames = np.unique(np.concatenate([np.arange(span[0], span[1] + 1.0), np.array(at, np.float64)]))
    scene = bpy.data.scenes.new("Sample")
    try:
        scene.collection.objects.link(skin)
        rows = []
        for frame in frames.tolist():
            whole = int(np.floor(frame))
            scene.frame_set(whole, subframe=frame - whole)
            blocks = skin.data.shape_keys.evaluated_get(scene.view_layers[0].depsgraph).key_blocks
            rows.append([blocks[name].value for name in names])
    finally:
        bpy.data.scenes.remove(scene)
    return frames, np.array(rows, np.float64)


def _own_action(keys: bpy.types.Key) -> None:
    """Let keys have an action that nothing else uses, so that what is taken out of it is missed nowhere."""
    animation = keys.animation_data
    if animation is None or animation.action is None:
        return
    action = animation.action
    if action.users == 1 and action.is_editable:
        return
    slot = animation.action_slot.identifier if getattr(animation, "action_slot", None) is not None else None
    animation.action = action.copy()
    if slot is not None:
        animation.action_slot = animation.action.slots[slot]


def _forget_empty(keys: bpy.types.Key) -> None:
    """Take away an action with nothing in it."""
    found = pose_keys.curves(keys)
    if found is not None and len(found) == 0:
        action = keys.animation_data.action
        keys.animation_data.action = None
        if not action.users:
            bpy.data.actions.remove(action)
