"""What the buttons of expressions and keys do."""

from dataclasses import dataclass
from typing import Any

from ..engine import FacewrightError
from ..scene import heads, keys
from ..words import say

KEYLESS = "{head} has no shape keys any more: reconstruct this head again, or undo what removed them"
LINKED = "the shape keys of {head} are linked from another file: set them there, or append the head instead"
LINKED_ACTION = "the action {action} of {head} is linked from another file: make it local first"

NEUTRAL = "neutral"
REPLACE, ADD, MIX = "REPLACE", "ADD", "MIX"
# As Blender lists the choices of a property.
BLENDS = [
    (REPLACE, "Replace", "The expression takes the place of the present pose"),
    (ADD, "Add", "The expression comes on top of the present pose, as far as the sliders go"),
    (MIX, "Mix", "The pose goes from the present one towards the expression, by the strength"),
]
AUTO, INSERT, NONE = "AUTO", "INSERT", "NONE"
SWAP, TO_RIGHT, TO_LEFT = "SWAP", "TO_RIGHT", "TO_LEFT"
# How many names a sentence gives before it says how many more there are.
NAMED = 3


@dataclass(frozen=True)
class Keying:
    """Where keyframes go: the frame, and Blender's type of keyframe."""

    frame: float
    kind: str


def face(scene: Any, active: Any) -> Any:
    """The skin object that the buttons act on: of the active object's head, or of the last one made; None without."""
    return heads.current_skin(scene, active, scene.facewright_clip.wanted)


def named_face(scene: Any, active: Any) -> tuple[Any, str]:
    """The same with what tells its head from others; that is empty where there is only one."""
    shown = heads.current(scene, active, scene.facewright_clip.wanted)
    return (shown[0].skin, shown[1]) if shown is not None else (None, "")


def complaint(skin: Any) -> str:
    """Why the keys of a head cannot be set; empty if they can."""
    if skin is None:
        return say("Reconstruct a face first")
    if skin.data.shape_keys is None:
        return say(KEYLESS, head=skin.name)
    if not skin.data.shape_keys.is_editable:
        return say(LINKED, head=skin.name)
    return ""


def keying_complaint(skin: Any) -> str:
    """Why keyframes of a head's keys cannot be changed; empty if they can."""
    if sentence := complaint(skin):
        return sentence
    if action := keys.linked_action(skin):
        return say(LINKED_ACTION, action=action, head=skin.name)
    return ""


def keying(scene: Any, skin: Any, choice: str) -> Keying | None:
    """Where to insert keyframes, by the choice of an operator (AUTO: if auto keying is on); None: nowhere."""
    is_wanted = choice == INSERT or (choice == AUTO and scene.tool_settings.use_keyframe_insert_auto)
    if not is_wanted:
        return None
    if sentence := keying_complaint(skin):
        raise FacewrightError(sentence)
    return Keying(scene.frame_float, scene.tool_settings.keyframe_type)


def names(skin: Any) -> list[str]:
    """The expressions of a head, the one without any first."""
    return [NEUTRAL, *keys.expressions(skin)]


def changed(settings: Any) -> list[str]:
    """Which options of an expression are set to something else than the usual."""
    usual = settings.bl_rna.properties
    return [name for name in ("strength", "blend") if getattr(settings, name) != usual[name].default]


def express(skin: Any, name: str, strength: float, blend: str, keying: Keying | None) -> str:
    """Bring a head's keys to an expression, or from the present pose towards it; keyframe all of them if told where.

    REPLACE takes the expression at its strength, ADD adds that to the present pose, MIX goes by the strength from the
    present pose to the expression. Keys that an artist added, such as a layer of sculpting, keep their values. Gives a
    sentence about keys that could not follow; empty without any.
    """
    if name not in names(skin):
        raise FacewrightError(f"there is no expression {name}: choose one of {', '.join(names(skin))}")
    pose = keys.expressions(skin).get(name, {})
    present = {block.name: block.value for block in keys.of_poses(skin)}
    kept = {REPLACE: 0.0, ADD: 1.0, MIX: 1.0 - strength}[blend]
    values = {key: kept * value + strength * pose.get(key, 0.0) for key, value in present.items()}
    return _pose(skin, values, [block.name for block in keys.every(skin)], keying)


def reset(skin: Any, group: str, keying: Keying | None) -> str:
    """Set the keys of a group to 0, or without one all that poses are made of."""
    blocks = members(skin, group) if group else keys.of_poses(skin)
    values = {block.name: 0.0 for block in blocks}
    return _pose(skin, values, [block.name for block in members(skin, group)], keying)


def mirror(skin: Any, direction: str, group: str, keying: Keying | None) -> str:
    """Exchange left and right of a group, or without one of the face, or copy one side to the other.

    A keyframe goes to all keys of the group, or of the face, so that the frame shows the whole pose.
    """
    inside = [block.name for block in members(skin, group)]
    values = keys.mirrored(skin) if direction == SWAP else keys.copied(skin, direction == TO_RIGHT)
    values = {name: value for name, value in values.items() if name in inside}
    if not values:
        raise FacewrightError(f"no key of {group or skin.name} has another side")
    return _pose(skin, values, inside, keying)


def insert(skin: Any, group: str, keying: Keying) -> str:
    """Insert a keyframe of every key of a group, or of the face; gives a sentence about those that have none."""
    return _pose(skin, {}, [block.name for block in members(skin, group)], keying)


def clear(skin: Any, group: str, frame: float) -> str:
    """Delete the keyframes of a group, or of the face, at a frame; gives a sentence about those that are locked."""
    if sentence := keying_complaint(skin):
        raise FacewrightError(sentence)
    deleted, locked = keys.delete(skin, [block.name for block in members(skin, group)], frame)
    said = f"the keyframes of {_listed(locked)} stay: their channels are locked" if locked else ""
    if not deleted:
        raise FacewrightError(said or f"{skin.name} has no keyframes of its keys at frame {frame:g}")
    return said


def members(skin: Any, group: str) -> list[Any]:
    """The keys of a group; without one, all keys of the face."""
    if not group:
        return keys.every(skin)
    groups = keys.grouped(skin)
    if group not in groups:
        raise FacewrightError(f"{skin.name} has no keys of the group {group}: choose one of {', '.join(groups)}")
    return groups[group]


def groups(skin: Any) -> dict[str, list[Any]]:
    """Every key of a face under the name of its group."""
    return keys.grouped(skin)


def found(skin: Any, text: str) -> list[Any]:
    """The keys that a search finds."""
    return keys.found(skin, text)


def paired(skin: Any) -> set[str]:
    """The names of the keys that have another side."""
    return {block.name for pair in keys.pairs(skin) for block in pair}


def keyable(skin: Any) -> list[Any]:
    """What keyframes of the face can be inserted for: channels of keys, or of the bones that lead them."""
    led = keys.driven(skin)
    found = keys.channels(skin, [block.name for block in keys.every(skin) if block.name not in led])
    return list(dict.fromkeys(channel for own in found.values() for channel in own))


def led(skin: Any) -> set[str]:
    """The keys that handles lead."""
    return keys.led(skin)


def _pose(skin: Any, values: dict[str, float], keyed: list[str], keying: Keying | None) -> str:
    """Set values, then keyframes of keys; drivers' keys stay theirs. Gives a sentence about what could not be done."""
    led = keys.driven(skin)
    wanted = [name for name in keyed if name in led]
    aimed = keys.aimed(skin)
    if wanted and len(wanted) == len(keyed):
        if aimed.issuperset(wanted):
            raise FacewrightError("the gaze follows its target: move that, or set Gaze Follows Target to 0")
        raise FacewrightError(f"drivers set the keys of {skin.name}: move what drives them instead")
    keys.set_values(skin, {name: value for name, value in values.items() if name not in led})
    others = [name for name in wanted if name not in aimed]
    said = [f"drivers set {_listed(others)}: they stay as they are"] if others else []
    said += ["the gaze follows its target and stays as it is"] if len(others) < len(wanted) else []
    if keying is not None:
        refused = keys.insert(skin, [name for name in keyed if name not in led], keying.frame, keying.kind)
        said += [f"no keyframe of {_listed(refused)}: their channels are locked"] if refused else []
    return "; ".join(said)


def _listed(names: list[str]) -> str:
    shown = ", ".join(names[:NAMED])
    return f"{shown} and {len(names) - NAMED} more" if len(names) > NAMED else shown
