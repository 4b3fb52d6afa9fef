"""The bones of a head's controls: where they are, how they look, what of them may be moved."""

from collections.abc import Iterator
from contextlib import contextmanager

import bpy
from mathutils import Vector

from . import controls_shapes as shapes
from .controls_find import FOLLOW, ROLE, bones, reach
from .controls_layout import (
    AIMS,
    DEFORMING,
    EYES,
    HANDLES,
    HEAD,
    JAW,
    LINKS,
    NECK,
    PANEL,
    ROOT,
    ROTATION,
    TRAVEL,
    Handle,
    axes,
)
from .controls_measure import Anatomy

# Roles in the order in which bones are made: a parent before what hangs on it.
_PARENTS = {ROOT: "", NECK: ROOT, HEAD: NECK, JAW: HEAD, EYES: ROOT, PANEL: ROOT} | dict.fromkeys(AIMS.values(), HEAD)
_PARENTS |= {handle.role: PANEL for handle in HANDLES}
# How far before the eyes their target is at first, metres.
_TARGET_AWAY = 0.4
# Where the panel's middle is from the middle of the face, or from the top of the head, metres.
_PANEL_ASIDE, _PANEL_ABOVE = 0.23, 0.19
# Of an armature's data: where its panel is.
_SIDE = "facewright_panel"
LEFT, RIGHT, ABOVE = "left", "right", "above"
_UP = Vector((0.0, 0.0, 1.0))
# Groups of bones, which an artist shows and hides.
_GROUPS = {"Head": [ROOT, NECK, HEAD, JAW, EYES], "Face Panel": [handle.role for handle in HANDLES] + [PANEL]}
_MECHANISM = "Mechanism"
# Colours as on ships, of the person's left and right.
_COLOURS = {"L": (0.9, 0.25, 0.25), "R": (0.25, 0.8, 0.35), "": (0.95, 0.8, 0.25)}
_HEADS_COLOUR, _PANELS_COLOUR = (0.35, 0.6, 1.0), (0.75, 0.75, 0.75)
_LIMITS = "Facewright Limits"
_AIMED = "Facewright Aim"


def place(armature: bpy.types.Object, anatomy: Anatomy, side: str) -> None:
    """Make the bones of a head, or bring those that there are to its joints; the artist's own stay.

    A new panel is on a side of the head: LEFT, RIGHT or ABOVE.
    """
    armature.data[_SIDE] = side = armature.data.get(_SIDE, side)
    names = {role: pose.name for role, pose in bones(armature).items()}
    made: dict[str, str] = {}
    with edited(armature) as found:
        for role, (head, tail) in _places(anatomy, side).items():
            bone = found.get(names.get(role, ""))
            if bone is None:
                bone = found.new(role)
                bone.parent = found.get(made.get(_PARENTS[role], ""))
                bone.use_deform, bone.use_connect = role in DEFORMING, False
            bone.head, bone.tail = head, tail
            bone.align_roll(Vector((1.0, 0.0, 0.0)).cross(bone.vector))
            made[role] = bone.name
    for role, name in made.items():
        if role not in names:
            armature.data.bones[name][ROLE] = role
    new = {role: pose for role, pose in bones(armature).items() if role not in names}
    _dress(armature, new)


def _places(anatomy: Anatomy, side: str) -> dict[str, tuple[Vector, Vector]]:
    """Where each bone begins and ends, in the order of making."""
    at = {name: Vector(place.tolist()) for name, place in anatomy.joints.items()}
    eyes = (at["eye_left"] + at["eye_right"]) / 2.0
    target = eyes - Vector((0.0, _TARGET_AWAY, 0.0))
    panel = _panel_place(at, side)
    found = {
        ROOT: (at["base"] - 0.03 * _UP, at["base"]),
        NECK: (at["base"], at["skull"]),
        HEAD: (at["skull"], at["top"]),
        JAW: (at["hinge"], at["chin"]),
        EYES: (target, target + 0.02 * _UP),
        PANEL: (panel, panel + 0.02 * _UP),
        AIMS["Left"]: (at["eye_left"], at["eye_left"] + 0.01 * _UP),
        AIMS["Right"]: (at["eye_right"], at["eye_right"] + 0.01 * _UP),
    }
    for handle in HANDLES:
        u, v = handle.place
        centre = panel + TRAVEL * Vector((u, 0.0, v))
        found[handle.role] = (centre, centre + 0.5 * TRAVEL * _UP)
    return found


def _panel_place(at: dict[str, Vector], side: str) -> Vector:
    """The middle of the panel: beside the face, as deep as the eyes, or above the head."""
    eyes = (at["eye_left"] + at["eye_right"]) / 2.0
    if side == ABOVE:
        return Vector((eyes.x, eyes.y, at["top"].z + _PANEL_ABOVE))
    return Vector((eyes.x + (_PANEL_ASIDE if side == LEFT else -_PANEL_ASIDE), eyes.y, (eyes.z + at["chin"].z) / 2.0))


@contextmanager
def edited(armature: bpy.types.Object) -> Iterator[bpy.types.ArmatureEditBones]:
    """The bones in Edit Mode, which Blender enters in a scene only: in one of our own, whatever the artist's shows."""
    scene = bpy.data.scenes.new("Bones")
    hidden = armature.hide_viewport
    armature.hide_viewport = False
    scene.collection.objects.link(armature)
    layer = scene.view_layers[0]
    layer.objects.active = armature
    try:
        with bpy.context.temp_override(
            scene=scene, view_layer=layer, object=armature, active_object=armature, selected_objects=[armature]
        ):
            bpy.ops.object.mode_set(mode="EDIT")
            try:
                yield armature.data.edit_bones
            finally:
                bpy.ops.object.mode_set(mode="OBJECT")
        layer.update()
    finally:
        bpy.data.scenes.remove(scene)
        armature.hide_viewport = hidden


def _dress(armature: bpy.types.Object, new: dict[str, bpy.types.PoseBone]) -> None:
    """Give new bones their looks, limits and properties."""
    for group, roles in {**_GROUPS, _MECHANISM: list(AIMS.values())}.items():
        wanted = [new[role].bone for role in roles if role in new]
        known = armature.data.collections.get(group)
        collection = known or (armature.data.collections.new(group) if wanted else None)
        if collection is None:
            continue
        if known is None:
            collection.is_visible = group != _MECHANISM
        for bone in wanted:
            collection.assign(bone)
    handles = {handle.role: handle for handle in HANDLES}
    looks = shapes.Shapes(armature)
    for role, pose in new.items():
        pose.use_custom_shape_bone_size = False
        if role in handles:
            _dress_handle(pose, handles[role], looks)
        else:
            _dress_joint(pose, role, looks)
    for key, link in LINKS.items():
        if link.axis.role in new:
            _add_rest(new[link.axis.role], key)


def _dress_handle(pose: bpy.types.PoseBone, handle: Handle, looks: shapes.Shapes) -> None:
    side = handle.role[-1] if handle.role.endswith((".L", ".R")) else ""
    pose.custom_shape = looks.knob()
    _colour(pose, _COLOURS[side])
    free = {axis.index for axis in axes() if axis.role == handle.role}
    pose.lock_location = [index not in free for index in range(3)]
    _lock_turns(pose)
    limits = pose.constraints.new("LIMIT_LOCATION")
    limits.name, limits.owner_space, limits.use_transform_limit = _LIMITS, "LOCAL", True
    right, left, up, down = handle.keys
    for letter, (plus, minus) in zip("xyz", ((right, left), (up, down), ("", ""))):
        for end, key in (("min", minus), ("max", plus)):
            setattr(limits, f"use_{end}_{letter}", True)
            way = TRAVEL * reach(pose.id_data, key) if key else 0.0
            setattr(limits, f"{end}_{letter}", -way if end == "min" else way)


def _dress_joint(pose: bpy.types.PoseBone, role: str, looks: shapes.Shapes) -> None:
    _colour(pose, _PANELS_COLOUR if role == PANEL else _HEADS_COLOUR)
    if role == PANEL:
        pose.custom_shape, pose.bone.hide_select = looks.panel(), True
    elif role == EYES:
        pose.custom_shape = looks.target()
        _lock_turns(pose)
        pose[FOLLOW] = 0.0
        pose.id_properties_ui(FOLLOW).update(
            min=0.0, max=1.0, subtype="FACTOR", description="How far both eyes look at this target, 0 to 1"
        )
        pose.property_overridable_library_set(f'["{FOLLOW}"]', True)
    elif role in AIMS.values():
        pose.bone.hide_select = True
        target = pose.constraints.new("COPY_LOCATION")
        target.name, target.target = _AIMED, pose.id_data
        target.subtarget = bones(pose.id_data)[EYES].name
    else:
        pose.custom_shape = looks.joint(role, pose.bone.length)
        pose.rotation_mode = "XYZ"
        pose.lock_location = [role != ROOT] * 3
        pose.lock_scale = [True] * 3
    if role == JAW:
        pose.lock_location, pose.lock_rotation = [True, False, True], [False, True, False]
        _limit_jaw(pose)


def _limit_jaw(pose: bpy.types.PoseBone) -> None:
    """Where the keys end, so does the jaw."""
    turn, way = pose.constraints.new("LIMIT_ROTATION"), pose.constraints.new("LIMIT_LOCATION")
    for constraint in (turn, way):
        constraint.name, constraint.owner_space, constraint.use_transform_limit = _LIMITS, "LOCAL", True
    for key in ("jawOpen", "jawLeft", "jawRight", "jawForward"):
        link = LINKS[key]
        letter = "xyz"[link.axis.index]
        constraint = turn if link.axis.channel == ROTATION else way
        end = "max" if link.full > 0.0 else "min"
        if link.axis.channel == ROTATION:
            setattr(turn, f"use_limit_{letter}", True)
        else:
            way.use_min_y = way.use_max_y = True
        setattr(constraint, f"{end}_{letter}", link.full)


def _add_rest(pose: bpy.types.PoseBone, key: str) -> None:
    """A property for what of a key the bone's place cannot say."""
    pose[key] = 0.0
    about = f"Added to what the place of this bone gives {key}: for what the place alone cannot say"
    # As far as sliders of keys can be set to go: Blender holds animated values within these.
    pose.id_properties_ui(key).update(min=-10.0, max=10.0, soft_min=0.0, soft_max=1.0, description=about)
    pose.property_overridable_library_set(f'["{key}"]', True)


def _lock_turns(pose: bpy.types.PoseBone) -> None:
    pose.rotation_mode = "XYZ"
    pose.lock_rotation, pose.lock_scale = [True] * 3, [True] * 3


def _colour(pose: bpy.types.PoseBone, colour: tuple[float, float, float]) -> None:
    chosen = pose.bone.color
    chosen.palette = "CUSTOM"
    chosen.custom.normal = colour
    chosen.custom.select = [min(1.0, part + 0.35) for part in colour]
    chosen.custom.active = (1.0, 1.0, 1.0)
