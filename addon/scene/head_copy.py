"""A copy of a head that shares nothing with it: meshes, keys, drivers, materials, pictures, keyframes are its own."""

import bpy
import numpy as np
from mathutils import Matrix

from . import belongings, heads, portrait
from .head_names import named_alike, stems
from .heads import KEY, Head
from .looks import PICTURE
from .materials import copied, exchange
from .motion_rig import FOLLOW
from .standing import free_place

# What was copied, and its copy.
Copies = dict[bpy.types.ID, bpy.types.ID]


def duplicate(scene: bpy.types.Scene, head: Head) -> Head:
    """Copy a head with all that is in its collection, into one of its own; the copy stands beside what is there.

    What uses a part of the head, as drivers and constraints do, uses the copy's in the copy.
    """
    skin = head.skin
    assert skin is not None, "what is left of a head is not copied"
    within = head.home or next(iter(skin.users_collection), scene.collection)
    begun = heads.begun(scene, within, head.name)
    assert begun.home is not None
    objects = belongings.things(head)
    copies = _copied(objects)
    made = Head(begun.key, copies[skin], {part: copies[obj] for part, obj in head.parts.items()}, begun.home)
    _put(head.home, begun.home, objects, copies)
    for obj in objects:
        _mark(copies[obj], obj in head.objects or heads.key_of(obj) == head.key, made.key)
    # The motion would carry the copy into its original.
    for constraint in [constraint for constraint in copies[skin].constraints if constraint.name == FOLLOW]:
        copies[skin].constraints.remove(constraint)
    _stand_beside(scene, head, objects, copies)
    _name(head, made, copies)
    portrait.hang(begun.home, made.parts)
    return made


def _copied(objects: list[bpy.types.Object]) -> Copies:
    """Copies of objects and of all that they have, which use each other."""
    copies: Copies = {picture: _picture(picture) for picture in belongings.pictures_of(objects)}
    for worn in belongings.materials_of(objects):
        copies[worn] = worn.copy()
        if worn.node_tree is not None:
            copies[worn.node_tree] = copies[worn].node_tree
            for picture in belongings.pictures_of(objects):
                exchange(copies[worn].node_tree, picture, copies[picture])
    for data in belongings.data_of(objects):
        copies[data] = data.copy()
        if getattr(data, "shape_keys", None) is not None:
            copies[data.shape_keys] = copies[data].shape_keys
    for obj in objects:
        copies[obj] = obj.copy()
    for obj in objects:
        _dress(copies[obj], copies)
    _turn_all([copies[obj] for obj in objects], copies)
    return copies


def _picture(picture: bpy.types.Image) -> bpy.types.Image:
    # Blender copies what is packed or on disk, not what was painted since.
    return copied(picture) if picture.is_dirty else picture.copy()


def _dress(obj: bpy.types.Object, copies: Copies) -> None:
    """Give the copy of an object the copies of its data, materials and picture."""
    if obj.data is not None:
        obj.data = copies[obj.data]
    for slot in obj.material_slots:
        slot.material = copies.get(slot.material, slot.material)
    if obj.get(PICTURE) is not None:
        obj[PICTURE] = copies[obj[PICTURE]]


def _turn_all(objects: list[bpy.types.Object], copies: Copies) -> None:
    """Let all that copies use be copies: parents, constraints, modifiers, drivers, actions."""
    for obj in objects:
        bones = list(obj.pose.bones) if obj.pose is not None else []
        constraints = [constraint for owner in (obj, *bones) for constraint in owner.constraints]
        targets = [target for constraint in constraints for target in getattr(constraint, "targets", ())]
        for struct in [obj, *bones, *constraints, *targets, *obj.modifiers]:
            _turn(struct, copies)
    animations = belongings.animations(objects)
    for animation in animations:
        for curve in animation.drivers:
            for target in [target for variable in curve.driver.variables for target in variable.targets]:
                if target.id in copies:
                    target.id = copies[target.id]
    for action in belongings.actions_of(objects):
        copies[action] = action.copy()
    for animation in animations:
        _own_actions(animation, copies)


def _turn(struct: bpy.types.bpy_struct, copies: Copies) -> None:
    """Let the pointers of a struct, and its custom properties, point to copies."""
    for declared in struct.bl_rna.properties:
        if declared.type == "POINTER" and not declared.is_readonly:
            value = getattr(struct, declared.identifier)
            if isinstance(value, bpy.types.ID) and value in copies:
                setattr(struct, declared.identifier, copies[value])
    for name in struct.keys() if isinstance(struct, (bpy.types.Object, bpy.types.NodesModifier)) else ():
        if isinstance(struct[name], bpy.types.ID) and struct[name] in copies:
            struct[name] = copies[struct[name]]


def _own_actions(animation: bpy.types.AnimData, copies: Copies) -> None:
    """Give what is animated, and its strips, the copies of its actions, each with the slot that it had."""
    animation.use_tweak_mode = False
    strips = [strip for track in animation.nla_tracks for strip in track.strips]
    for holder in [animation, *strips]:
        if holder.action is None:
            continue
        slot = getattr(holder, "action_slot", None)
        holder.action = copies[holder.action]
        if slot is not None:
            holder.action_slot = next(own for own in holder.action.slots if own.handle == slot.handle)


def _put(
    old: bpy.types.Collection | None, new: bpy.types.Collection, objects: list[bpy.types.Object], copies: Copies
) -> None:
    """Put copies into a collection, and into copies of the collections within the original's."""
    placed: set[bpy.types.Object] = set()

    def fill(old: bpy.types.Collection, new: bpy.types.Collection) -> None:
        for obj in [obj for obj in old.objects if obj in copies]:
            new.objects.link(copies[obj])
            placed.add(obj)
        for child in [child for child in old.children if any(obj in copies for obj in child.all_objects)]:
            inner = bpy.data.collections.new(child.name)
            new.children.link(inner)
            fill(child, inner)

    if old is not None:
        fill(old, new)
    for obj in objects:
        if obj not in placed:
            new.objects.link(copies[obj])


def _mark(copy: bpy.types.Object, is_ours: bool, key: str) -> None:
    """Make a copy one of its head's; what is only in the collection carries no marks of ours but to other copies."""
    if is_ours:
        copy[KEY] = key
        return
    kept = belongings.pointers(copy)
    for name in [name for name in list(copy.keys()) if name.startswith("facewright_") and name not in kept]:
        del copy[name]


def _stand_beside(scene: bpy.types.Scene, head: Head, objects: list[bpy.types.Object], copies: Copies) -> None:
    """Move what does not hang on another copy, all by as much, so that the skin is beside what is there."""
    skin = head.skin
    assert skin is not None
    for layer in scene.view_layers:
        layer.update()
    positions = np.empty(3 * len(skin.data.vertices), np.float32)
    skin.data.vertices.foreach_get("co", positions)
    turned = positions.reshape(-1, 3) @ np.array(skin.matrix_world.to_3x3(), np.float32).T
    skins = [other.skin for other in heads.heads(scene) if other.skin not in (None, copies[skin])]
    by = free_place(scene, turned, skins, set(copies.values())) - skin.matrix_world.translation
    for obj in [obj for obj in objects if obj.parent not in copies]:
        if obj.parent is None and not obj.constraints:
            copies[obj].location += by
        else:
            copies[obj].matrix_world = Matrix.Translation(by) @ obj.matrix_world


def _name(head: Head, made: Head, copies: Copies) -> None:
    """Call a copy after its collection, and its data as the original's are called after it."""
    assert head.skin is not None and made.skin is not None and made.home is not None
    before, name = stems(head), made.home.name
    for data, copy in copies.items():
        if called := named_alike(data.name, before, name):
            copy.name = called
    made.skin.name = made.skin.data.name = name
    made.skin[heads.NAME] = made.skin.name
