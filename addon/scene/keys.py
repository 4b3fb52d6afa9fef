"""The shape keys of a face: their groups and sides, their values and keyframes, and its named expressions.

Where bones lead a key, its value is set and keyed there.
"""

import json
import math
import re
from collections.abc import Iterable, Mapping

import bpy

from . import controls_pose
from .channels import Channel
from .controls_find import aimed, led, of
from .controls_layout import GAZE

EXPRESSIONS = "facewright_expressions"
OTHER = "Other"
# What part of the face a key moves, by ARKit's names and those of the visemes; what else there is, is the artist's.
GROUPS = {
    "Brows": re.compile("brow[A-Z]"),
    "Lids": re.compile("eye(Blink|Squint|Wide)[A-Z]"),
    "Gaze": re.compile("eyeLook[A-Z]"),
    "Cheeks": re.compile("cheek[A-Z]"),
    "Nose": re.compile("nose[A-Z]"),
    "Jaw": re.compile("jaw[A-Z]"),
    "Mouth": re.compile("mouth[A-Z]"),
    "Tongue": re.compile("tongue[A-Z]"),
    "Visemes": re.compile("viseme_"),
}
# These move the whole jaw or mouth to a side: there is no half of the face that they are of.
SIDEWAYS = {"jawLeft", "jawRight", "mouthLeft", "mouthRight"}


def expressions(skin: bpy.types.Object) -> dict[str, dict[str, float]]:
    """Named poses of a head: values of its keys."""
    return json.loads(skin.get(EXPRESSIONS, "{}"))


def asked(poses: Iterable[Mapping[str, float]]) -> dict[str, float]:
    """The most that poses ask of keys of which they ask more than 1, as they do of weak ones."""
    weights = [pair for pose in poses for pair in pose.items()]
    return {name: max(weight for other, weight in weights if other == name) for name, most in weights if most > 1.0}


def every(skin: bpy.types.Object) -> list[bpy.types.ShapeKey]:
    """All keys of a face; its shape at rest is none."""
    return list(skin.data.shape_keys.key_blocks)[1:]


def of_poses(skin: bpy.types.Object) -> list[bpy.types.ShapeKey]:
    """The keys that a pose is made of; those that an artist added, such as a layer of sculpting, are not among them."""
    named = {name for pose in expressions(skin).values() for name in pose}
    return [block for block in every(skin) if block.name in named or group_of(block.name) != OTHER]


def group_of(name: str) -> str:
    """The group of a key."""
    return next((group for group, pattern in GROUPS.items() if pattern.match(name)), OTHER)


def grouped(skin: bpy.types.Object) -> dict[str, list[bpy.types.ShapeKey]]:
    """Every key of a face under its group, in the face's order; no group is empty."""
    groups: dict[str, list[bpy.types.ShapeKey]] = {group: [] for group in (*GROUPS, OTHER)}
    for block in every(skin):
        groups[group_of(block.name)].append(block)
    return {group: blocks for group, blocks in groups.items() if blocks}


def found(skin: bpy.types.Object, text: str) -> list[bpy.types.ShapeKey]:
    """The keys with all words of a text in their names or in those of their groups."""
    words = text.lower().split()
    return [b for b in every(skin) if all(word in f"{b.name} {group_of(b.name)}".lower() for word in words)]


def driven(skin: bpy.types.Object) -> set[str]:
    """The names of the keys that drivers set; not those that handles lead, but those of eyes that follow a target."""
    animation = skin.data.shape_keys.animation_data
    paths = {curve.data_path for curve in animation.drivers} if animation is not None else set()
    if not paths:
        return set()
    found = {block.name for block in every(skin) if block.path_from_id("value") in paths}
    return found - led(skin) | aimed(skin)


def pairs(skin: bpy.types.Object) -> list[tuple[bpy.types.ShapeKey, bpy.types.ShapeKey]]:
    """The left and the right key of each pair of a face, by their names: …Left and …Right, or as Blender has sides."""
    by_name = {block.name: block for block in every(skin)}
    others = {name: bpy.utils.flip_name(name) for name in by_name}
    lefts = [name for name, other in others.items() if others.get(other) == name and _is_left(name, other)]
    return [(by_name[name], by_name[others[name]]) for name in lefts]


def mirrored(skin: bpy.types.Object) -> dict[str, float]:
    """The values of the paired keys with left and right exchanged."""
    both = pairs(skin)
    return {a.name: b.value for a, b in both} | {b.name: a.value for a, b in both}


def copied(skin: bpy.types.Object, to_right: bool) -> dict[str, float]:
    """The values of the keys of one half of a face, given to those of the other half."""
    both = [pair if to_right else pair[::-1] for pair in pairs(skin)]
    return {target.name: source.value for source, target in both if target.name not in SIDEWAYS}


def set_values(skin: bpy.types.Object, values: Mapping[str, float]) -> None:
    """Set keys of a face, each within the limits of its slider; those that are not named stay."""
    blocks, ours = skin.data.shape_keys.key_blocks, led(skin)
    # The sliders of the gaze were made longer for its target alone.
    ends = {name: min(blocks[name].slider_max, 1.0 if name in ours & set(GAZE) else math.inf) for name in values}
    within = {name: min(max(value, blocks[name].slider_min), ends[name]) for name, value in values.items()}
    for name in within.keys() - ours:
        blocks[name].value = within[name]
    controls_pose.set_values(skin, {name: value for name, value in within.items() if name in ours})


def key_channel(block: bpy.types.ShapeKey) -> Channel:
    """What keyframes of a key set, where no bone leads it."""
    return Channel(block, "value", -1, group_of(block.name))


def channels(skin: bpy.types.Object, names: Iterable[str]) -> dict[str, list[Channel]]:
    """What keyframes of each key set: the key, or the bone that leads it."""
    wanted, blocks = list(names), skin.data.shape_keys.key_blocks
    return {name: [key_channel(blocks[name])] for name in wanted} | controls_pose.channels(skin, wanted)


def insert(skin: bpy.types.Object, names: Iterable[str], frame: float, kind: str = "KEYFRAME") -> list[str]:
    """Insert a keyframe of the present value of each key; gives the names of those that refuse: locked channels."""
    found = channels(skin, names)
    # Opposite keys share an axis.
    done = {channel: channel.insert(frame, kind) for channel in _each(found)}
    return [name for name, own in found.items() if not all(done[channel] for channel in own)]


def delete(skin: bpy.types.Object, names: Iterable[str], frame: float) -> tuple[int, list[str]]:
    """Delete the keyframes of keys at a frame; gives how many went, and the names of those in locked channels."""
    found = channels(skin, names)
    done = {channel: channel.delete(frame) for channel in _each(found) if channel.has_keyframe(frame)}
    kept = [name for name, own in found.items() if not all(done.get(channel, True) for channel in own)]
    return sum(done.values()), kept


def linked_action(skin: bpy.types.Object) -> str:
    """The name of the action of a face's keys, or of what leads them, if it is another file's; else empty."""
    armature = of(skin)
    held = [skin.data.shape_keys, *([armature] if armature is not None else [])]
    actions = [owner.animation_data.action for owner in held if owner.animation_data is not None]
    return next((action.name for action in actions if action is not None and not action.is_editable), "")


def _each(found: Mapping[str, list[Channel]]) -> list[Channel]:
    """All channels, each once."""
    return list(dict.fromkeys(channel for own in found.values() for channel in own))


def _is_left(name: str, other: str) -> bool:
    """Whether the first letter in which two sides' names differ is that of left."""
    return next((a.lower() == "l" for a, b in zip(name, other) if a != b), False)
