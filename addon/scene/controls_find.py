"""Which armature leads a head, and which of its keys: known by pointers and marks, never by names.

A skin points to its armature and that to the skin: Blender turns both to the copies where a head is copied. Bones are
known by their roles, which they have as a custom property: an artist may rename them.
"""

import bpy

from .controls_layout import EYES, GAZE, LINKS

# Of a skin: its armature; of an armature: its skin.
CONTROLS, LED = "facewright_controls", "facewright_led"
# Of a bone: what it is for.
ROLE = "facewright_role"
# Of the gaze target: how far the eyes follow it.
FOLLOW = "follow"
# Of an armature's data: how far its handles bring keys of which expressions ask for more than 1, by the keys' names.
REACH = "facewright_reach"


def of(skin: bpy.types.Object) -> bpy.types.Object | None:
    """The armature of a head; None without. A head that was copied without it has none: it is the original's."""
    armature = skin.get(CONTROLS)
    is_own = isinstance(armature, bpy.types.Object) and armature.get(LED) == skin and bool(armature.users_scene)
    return armature if is_own else None


def bones(armature: bpy.types.Object) -> dict[str, bpy.types.PoseBone]:
    """The bones of an armature that are of ours, by their roles."""
    # Blender gives an armature a pose when it has bones.
    posed = armature.pose.bones if armature.pose is not None else []
    return {str(pose.bone[ROLE]): pose for pose in posed if ROLE in pose.bone}


def reach(armature: bpy.types.Object, key: str) -> float:
    """How far a handle alone brings a key."""
    return float(armature.data[REACH].get(key, 1.0)) if REACH in armature.data else 1.0


def is_ours(curve: bpy.types.FCurve) -> bool:
    """Whether a driver of a key is one of ours; also where its armature is gone."""
    targets = [target for variable in curve.driver.variables for target in variable.targets]
    reads_bones = all(target.bone_target or target.data_path.startswith('pose.bones["') for target in targets)
    return bool(targets) and reads_bones and all(target.id is None or LED in target.id for target in targets)


def our_drivers(skin: bpy.types.Object) -> dict[str, bpy.types.FCurve]:
    """Our drivers by the keys that they set."""
    keys = skin.data.shape_keys
    if keys is None or keys.animation_data is None or not len(keys.animation_data.drivers):
        return {}
    found = {curve.data_path: curve for curve in keys.animation_data.drivers}
    paths = {name: keys.key_blocks[name].path_from_id("value") for name in LINKS if name in keys.key_blocks}
    return {name: found[path] for name, path in paths.items() if path in found and is_ours(found[path])}


def led(skin: bpy.types.Object) -> set[str]:
    """The keys that a head's own armature leads."""
    armature = of(skin)
    if armature is None:
        return set()
    drivers, there = our_drivers(skin), bones(armature)
    return {
        name
        for name, curve in drivers.items()
        if LINKS[name].axis.role in there
        and all(target.id == armature for variable in curve.driver.variables for target in variable.targets)
    }


def follow(armature: bpy.types.Object) -> float:
    """How far the eyes follow their target."""
    target = bones(armature).get(EYES)
    return float(target.get(FOLLOW, 0.0)) if target is not None else 0.0


def aimed(skin: bpy.types.Object) -> set[str]:
    """The keys that the gaze target sets at present."""
    armature = of(skin)
    return led(skin) & set(GAZE) if armature is not None and follow(armature) > 0.0 else set()
