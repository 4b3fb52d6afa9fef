"""What must hold of controls, of the list of heads and of the strip of frames: what is wrong, as sentences."""

from collections.abc import Iterator
from typing import Any

import bpy
import numpy as np
from tracking import module

# Of values, and of sums of weights.
SAME, WHOLE = 1e-4, 1e-3


def of_controls(head: Any) -> Iterator[str]:
    """The armature and the skin point to each other, drivers are simple and right, every vertex follows."""
    find, skin = module("scene.controls_find"), head.skin
    armature = find.of(skin)
    if armature is None or skin.data.shape_keys is None:
        return
    if armature.type != "ARMATURE":
        yield f"the controls of {skin.name} are a {armature.type}"
        return
    drivers, led = find.our_drivers(skin), find.led(skin)
    for name in sorted(led):
        driver = drivers[name].driver
        if not driver.is_simple_expression:
            yield f"the driver of {name} of {skin.name} is a script: {driver.expression}"
        if not driver.is_valid:
            yield f"the driver of {name} of {skin.name} is not valid"
    keyed = {curve.data_path for curve in module("scene.pose_keys").curves(skin.data.shape_keys) or []}
    yield from (f"{name} of {skin.name} is led, and keyed" for name in led if drivers[name].data_path in keyed)
    paths = [curve.data_path for curve in skin.data.shape_keys.animation_data.drivers] if led else []
    yield from (f"{path} of {skin.name} has two drivers" for path in set(paths) if paths.count(path) > 1)
    yield from _of_poses(skin, armature, led)
    for obj in head.objects:
        yield from _of_weights(obj, armature)


def _of_poses(skin: bpy.types.Object, armature: bpy.types.Object, led: set[str]) -> Iterator[str]:
    """Keys have the values that their handles give."""
    if not (skin.visible_get() and armature.visible_get()) or armature.mode == "EDIT":
        return
    find, shown = module("scene.controls_find"), values(skin)
    posed = armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
    bones, links = find.bones(posed), module("scene.controls_layout").LINKS
    for name in led - find.aimed(skin):
        wanted = module("scene.controls_pose").value_of(bones[links[name].axis.role], name)
        if abs(shown[name] - wanted) > SAME:
            yield f"{name} of {skin.name} is {shown[name]}, its handle says {wanted}"
    yield from (f"{name} of {skin.name} is {value}" for name, value in shown.items() if not np.isfinite(value))


def _of_weights(obj: bpy.types.Object, armature: bpy.types.Object) -> Iterator[str]:
    """A part that follows the armature does so once, with all of its vertices."""
    ours = [m for m in obj.modifiers if m.type == "ARMATURE" and m.object == armature]
    if len(ours) > 1:
        yield f"{obj.name} follows {armature.name} {len(ours)} times"
    names = {bone.name for bone in armature.data.bones if bone.use_deform}
    groups = {group.index for group in obj.vertex_groups if group.name in names}
    if not ours or not names or obj.mode == "EDIT":
        return
    sums = [sum(g.weight for g in vertex.groups if g.group in groups) for vertex in obj.data.vertices]
    if (wrong := sum(abs(total - 1.0) > WHOLE for total in sums)) > 0:
        yield f"{wrong} vertices of {obj.name} follow bones by less or more than wholly"


def values(skin: bpy.types.Object) -> dict[str, float]:
    """What the artist sees of the keys of a skin."""
    bpy.context.view_layer.update()
    graph = bpy.context.evaluated_depsgraph_get()
    keys = skin.evaluated_get(graph).data.shape_keys if skin.visible_get() else skin.data.shape_keys
    return {block.name: block.value for block in keys.key_blocks} if keys is not None else {}


def of_list(scene: bpy.types.Scene) -> Iterator[str]:
    """Every head with a skin has one row, at most one is made next, and the buttons' one is among them."""
    actions = module("heads.actions")
    listed, whole = actions.listed(scene), [h for h in module("scene.heads").heads(scene) if h.skin is not None]
    rows = [row.obj for row in listed.rows if row.head is not None]
    if sorted(obj.name_full for obj in rows) != sorted(head.skin.name_full for head in whole):
        yield f"the list of {scene.name} shows {rows}, not {[head.skin for head in whole]}"
    if sum(row.is_next for row in listed.rows) > 1:
        yield f"two heads of {scene.name} are made next"
    number = scene.facewright_heads.index
    if rows and (number < 0 or scene.objects[number] not in [row.obj for row in listed.rows]):
        yield f"object {number} of {scene.name} is chosen in the list, and is no head"


def of_strip(scene: bpy.types.Scene) -> Iterator[str]:
    """First and last frame, and those left out, are of the clip, and the strip shows what becomes of them."""
    settings, source, clip = scene.facewright_clip, module("scene.source"), module("clip.actions")
    if not settings.path or not (count := source.length(source.source_of(settings))):
        return
    frames = source.source_of(settings)
    if settings.frames not in (-1, count):
        yield f"the clip of {scene.name} has {count} frames, not {settings.frames}"
    if settings.use_range and not 0 <= settings.first <= settings.last < count:
        yield f"{scene.name} uses frames {settings.first} to {settings.last} of {count}"
    if settings.left_out != source.text_of(source.overlap(frames.left_out, 0, count - 1)):
        yield f"{scene.name} leaves out {settings.left_out} of {count} frames"
    if (strip := clip.strip_of(settings)) is None:
        return
    shown = [strip.number(look) for look in strip.shown()]
    stood_for = [number for at in shown for number in range(strip.stretch(at)[0], strip.stretch(at)[1] + 1)]
    if len(stood_for) != len(set(stood_for)) or not set(shown) <= set(stood_for) or max(stood_for) >= count:
        yield f"the frames {shown} of the strip stand for {stood_for}"
