"""Values of keys as places of handles, and back: any set of values can be had.

A key is what its handle gives it, from 0 to 1 or as far as expressions ask, and a custom property of that bone, named
after the key: what the handle cannot say, such as two opposite keys at once.
"""

from collections.abc import Iterable, Mapping

import bpy

from .channels import Channel
from .controls_find import aimed, bones, led, of, reach
from .controls_layout import LINKS, Axis, axes

# What single precision does to a value.
ROUNDING = 1e-7


def set_values(skin: bpy.types.Object, values: Mapping[str, float]) -> None:
    """Let the bones of a head give keys their values; keys that these do not lead are left out."""
    armature, names = of(skin), led(skin)
    if armature is None:
        return
    found, blocks = bones(armature), skin.data.shape_keys.key_blocks
    for axis, keys in axes().items():
        ours = [key for key in keys if key in names]
        if axis.role not in found or not any(key in values for key in ours):
            continue
        pose = found[axis.role]
        wanted = {key: values.get(key, value_of(pose, key)) for key in ours}
        set_axis(pose, axis, keys, wanted)
        for key in ours:
            # As the driver will: readers need not wait for it.
            blocks[key].value = wanted[key]
    armature.update_tag()


def set_axis(pose: bpy.types.PoseBone, axis: Axis, keys: tuple[str, str], wanted: Mapping[str, float]) -> None:
    """Bring a bone where its axis gives two opposite keys their values, and put the rest into its properties."""
    place, rests = split(pose.id_data, keys, wanted)
    getattr(pose, axis.channel)[axis.index] = place
    for key, rest in rests.items():
        pose[key] = rest


def split(
    armature: bpy.types.Object, keys: tuple[str, str], wanted: Mapping[str, float]
) -> tuple[float, dict[str, float]]:
    """Where an axis is for the values of its two keys (empty: none), and what is left for each."""
    plus, minus = (wanted.get(key, 0.0) for key in keys)
    highest, lowest = (reach(armature, key) if key in wanted else 0.0 for key in keys)
    net = min(max(plus - minus, -lowest), highest)
    rests = {keys[0]: plus - max(net, 0.0), keys[1]: minus - max(-net, 0.0)}
    full = abs(next(LINKS[key].full for key in keys if key))
    return net * full, {key: rest if abs(rest) > ROUNDING else 0.0 for key, rest in rests.items() if key in wanted}


def value_of(pose: bpy.types.PoseBone, key: str) -> float:
    """What a bone gives a key, the gaze target aside."""
    link = LINKS[key]
    place = getattr(pose, link.axis.channel)[link.axis.index] / link.full
    return min(max(place, 0.0), reach(pose.id_data, key)) + float(pose.get(key, 0.0))


def channels(skin: bpy.types.Object, names: Iterable[str]) -> dict[str, list[Channel]]:
    """What is keyed for each key that bones lead: the axis, and the key's own property."""
    armature = of(skin)
    if armature is None:
        return {}
    ours, found = led(skin) - aimed(skin), bones(armature)
    there = [(name, LINKS[name].axis) for name in names if name in ours and LINKS[name].axis.role in found]
    return {name: channels_of(found[axis.role], name) for name, axis in there}


def channels_of(pose: bpy.types.PoseBone, key: str) -> list[Channel]:
    axis = LINKS[key].axis
    rest = Channel(pose, f'["{key}"]', -1, pose.name)
    return [Channel(pose, axis.channel, axis.index, pose.name), rest]
