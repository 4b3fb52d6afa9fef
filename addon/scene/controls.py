"""Controls of a head: an armature with neck, head, jaw, a gaze target and a panel of handles that lead ARKit's keys.

The armature hangs on the skin and lies in the head's collection. The head's pose, keys and keyframes are the same
before and after controls are added.
"""

import bpy

from ..engine import FacewrightError
from . import controls_bones, controls_carry, controls_drivers, controls_limits, controls_measure, controls_mesh, heads
from . import controls_shapes as shapes
from .controls_find import CONTROLS, LED, REACH, bones, led, of, our_drivers
from .controls_layout import LINKS
from .heads import KEY, SKIN, Head
from .keys import asked, expressions

TITLE = "Controls"
# What is nearer to a head, in depth and height or sideways, is where its panel would be, metres.
_NEAR, _WIDE = 0.3, 0.45


def complaint(head: Head) -> str:
    """Why a head cannot get controls; empty if it can."""
    skin = head.skin
    if skin is None:
        return "Reconstruct a face first"
    if not head.is_local:
        return f"{skin.name} is linked from another file: append it instead"
    if skin.data.shape_keys is None:
        return f"{skin.name} has no shape keys any more: reconstruct this head again, or undo what removed them"
    if "generic_position" not in skin.data.attributes:
        return f"{skin.name} has lost its attribute generic_position: reconstruct this head again"
    return controls_mesh.conflict(head)


def has(head: Head) -> bool:
    """Whether a head has controls, or what is left of deleted ones."""
    skin = head.skin
    return skin is not None and (of(skin) is not None or bool(our_drivers(skin)))


def add(head: Head) -> tuple[bpy.types.Object, list[str]]:
    """Give a head controls, or bring those that it has up to date.

    Gives the armature, and sentences about keys that were left alone.
    """
    if sentence := complaint(head):
        raise FacewrightError(sentence)
    skin = head.skin
    assert skin is not None, "a head without a skin was refused"
    blocks, ours = skin.data.shape_keys.key_blocks, led(skin)
    refused = _refused(skin)
    new = [name for name in LINKS if name in blocks and name not in ours and name not in refused]
    if not new and not ours:
        name, reason = next(iter(refused.items()), ("", "is missing"))
        raise FacewrightError(f"bones can lead no key of {skin.name}: {name or 'each'} {reason}")
    armature = of(skin) or _new_armature(head, skin)
    _let_go(skin)
    anatomy = _place(head, armature)
    controls_carry.to_bones(skin, armature, new)
    for name in [name for name in LINKS if name in ours or name in new]:
        controls_drivers.drive(blocks[name], armature, bones(armature), anatomy.aims)
    armature.update_tag()
    return armature, [f"{name} {reason} and stays as it is" for name, reason in refused.items()]


def update(head: Head) -> None:
    """Bring the controls of a head, if it has any, to its new shape; pose and keyframes stay."""
    if head.skin is None or of(head.skin) is None:
        return
    armature = of(head.skin)
    anatomy = _place(head, armature)
    blocks = head.skin.data.shape_keys.key_blocks
    ours = led(head.skin)
    for name in [name for name in LINKS if name in ours]:
        controls_drivers.drive(blocks[name], armature, bones(armature), anatomy.aims)


def remove(head: Head) -> None:
    """Take the controls of a head away; its keys keep the pose, and get keyframes of what they did."""
    skin = head.skin
    if skin is None or not has(head):
        raise FacewrightError("this head has no controls")
    armature = of(skin)
    if armature is not None:
        controls_carry.from_bones(head)
    _let_go(skin)
    controls_limits.narrow(skin, head.objects, armature)
    controls_mesh.unbind(head, armature)
    if armature is not None:
        _delete(armature)
    if CONTROLS in skin:
        del skin[CONTROLS]


def _refused(skin: bpy.types.Object) -> dict[str, str]:
    """Why keys that nothing of ours leads yet have to be left alone."""
    blocks, known = skin.data.shape_keys.key_blocks, our_drivers(skin)
    missing = [name for name in LINKS if name in blocks and name not in known]
    return {name: reason for name in missing if (reason := controls_carry.refusal(blocks[name]))}


def _free_side(skin: bpy.types.Object) -> str:
    """On which side of a head a panel is in no other head."""
    others = [other.skin for other in heads.heads(bpy.context.scene) if other.skin not in (None, skin)]
    there = [skin.matrix_world.inverted() @ other.matrix_world.translation for other in others if other is not None]
    beside = [place.x for place in there if abs(place.y) < _NEAR and abs(place.z) < _NEAR]
    for side, sign in ((controls_bones.LEFT, 1.0), (controls_bones.RIGHT, -1.0)):
        if not any(0.0 < sign * across < _WIDE for across in beside):
            return side
    return controls_bones.ABOVE


def _place(head: Head, armature: bpy.types.Object) -> controls_measure.Anatomy:
    """Bones at the joints, meshes that follow them."""
    _house(head, armature)
    anatomy = controls_measure.measure(head)
    controls_bones.place(armature, anatomy, _free_side(head.parts[SKIN]))
    controls_mesh.bind(head, armature)
    controls_limits.widen(head.parts[SKIN], head.objects, armature)
    return anatomy


def _new_armature(head: Head, skin: bpy.types.Object) -> bpy.types.Object:
    """An armature without bones, which hangs on the skin."""
    armature = bpy.data.objects.new(f"{head.name} {TITLE}", bpy.data.armatures.new(f"{head.name} {TITLE}"))
    (head.home or skin.users_collection[0]).objects.link(armature)
    armature.parent = skin
    armature[LED] = skin
    skin[CONTROLS] = armature
    armature.show_in_front = True
    blocks, most = skin.data.shape_keys.key_blocks, asked(expressions(skin).values())
    armature.data[REACH] = {name: max(min(most[name], blocks[name].slider_max), 1.0) for name in most if name in blocks}
    return armature


def _house(head: Head, armature: bpy.types.Object) -> None:
    """Keep an armature in its head's collection, which a copied head gets with a run."""
    if head.home is None or armature in head.home.all_objects.values():
        return
    head.home.objects.link(armature)
    for other in armature.users_collection:
        if other != head.home and KEY in other:
            other.objects.unlink(armature)


def _let_go(skin: bpy.types.Object) -> None:
    """Take away drivers of ours that read no armature, or another head's: of deleted controls, or of a copied head."""
    blocks, ours = skin.data.shape_keys.key_blocks, led(skin)
    for name in our_drivers(skin).keys() - ours:
        now = blocks[name].value
        blocks[name].driver_remove("value")
        blocks[name].value = now


def _delete(armature: bpy.types.Object) -> None:
    """Delete an armature with what only it uses."""
    data, animation = armature.data, armature.animation_data
    action = animation.action if animation is not None else None
    shapes.forget(armature)
    bpy.data.objects.remove(armature)
    if not data.users:
        bpy.data.armatures.remove(data)
    if action is not None and not action.users and action.library is None:
        bpy.data.actions.remove(action)
