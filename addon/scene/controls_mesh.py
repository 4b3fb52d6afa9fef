"""How a head's meshes follow the bones of neck and head."""

import bpy
import numpy as np

from .controls_find import LED, bones
from .controls_layout import DEFORMING, HEAD
from .controls_measure import Array, generic_positions, neck_weights
from .heads import SKIN, Head

TITLE = "Controls"


def conflict(head: Head) -> str:
    """Why bones would pull at vertices that an artist has grouped; empty where they would not."""
    for obj in head.objects:
        taken = [name for name in DEFORMING if name in obj.vertex_groups]
        if taken and modifier(obj) is None:
            return f"{obj.name} has a vertex group {taken[0]}, as the bone is called: rename the group first"
    return ""


def bind(head: Head, armature: bpy.types.Object) -> None:
    """Let all parts follow the armature; weights that there are stay, as an artist may have painted them."""
    names = {role: pose.name for role, pose in bones(armature).items() if role in DEFORMING}
    for part, obj in head.parts.items():
        found = modifier(obj)
        if found is None:
            found = obj.modifiers.new(TITLE, "ARMATURE")
            # After the keys and before whatever subdivides.
            obj.modifiers.move(len(obj.modifiers) - 1, 0)
        found.object = armature
        if not any(name in obj.vertex_groups for name in names.values()):
            _weigh(obj, names, part == SKIN)


def unbind(head: Head, armature: bpy.types.Object | None) -> None:
    """Take what `bind` gave; of an armature that is gone, the groups that have its bones' first names."""
    known = bones(armature) if armature is not None else {}
    names = [known[role].name if role in known else role for role in DEFORMING]
    for obj in head.objects:
        if (found := modifier(obj)) is not None:
            obj.modifiers.remove(found)
            if _is_followed(obj.data):
                continue
            for group in [obj.vertex_groups[name] for name in names if name in obj.vertex_groups]:
                obj.vertex_groups.remove(group)


def modifier(obj: bpy.types.Object) -> bpy.types.ArmatureModifier | None:
    """What lets a part follow an armature of ours, be that gone or another head's."""
    found = [m for m in obj.modifiers if m.type == "ARMATURE" and (m.object is None or LED in m.object)]
    return next(iter(found), None)


def _is_followed(mesh: bpy.types.Mesh) -> bool:
    """Whether an object of a mesh, as a linked duplicate is, follows an armature of ours: weights are the mesh's."""
    shown = [obj for obj in bpy.data.objects if obj.data == mesh] if mesh.users > 1 else []
    return any(modifier(obj) is not None for obj in shown)


def _weigh(obj: bpy.types.Object, names: dict[str, str], is_skin: bool) -> None:
    count = len(obj.data.vertices)
    weights: dict[str, Array] = {HEAD: np.ones(count)}
    if is_skin:
        weights = neck_weights(generic_positions(obj))
    for role, values in weights.items():
        group = obj.vertex_groups.new(name=names[role])
        for value in np.unique(values[values > 0.0]):
            group.add(np.flatnonzero(values == value).tolist(), float(value), "REPLACE")
