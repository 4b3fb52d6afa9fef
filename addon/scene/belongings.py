"""What a head has besides its objects: meshes, materials, pictures, actions; and whether others use them too."""

from collections.abc import Iterable

import bpy

from .heads import PART, Head
from .looks import PICTURE
from .materials import images


def things(head: Head) -> list[bpy.types.Object]:
    """The objects of a head, then what an artist has put into its collection; no other head's, and nothing linked."""
    held = list(head.home.all_objects) if head.home is not None else []
    ours = set(head.objects)
    artists = [obj for obj in held if obj not in ours and not obj.get(PART) and obj.library is None]
    return [*head.objects, *artists]


def led(head: Head) -> list[bpy.types.Object]:
    """Of these the ones that are no artist's but made for the head, such as controls: a mark of ours points to it."""
    ours = set(head.objects)
    return [obj for obj in things(head) if obj not in ours and any(obj[name] in ours for name in pointers(obj))]


def pointers(obj: bpy.types.Object) -> list[str]:
    """The marks of ours on an object that are objects."""
    marks = [name for name in list(obj.keys()) if name.startswith("facewright_")]
    return [name for name in marks if isinstance(obj[name], bpy.types.Object)]


def unique(found: Iterable[bpy.types.ID | None]) -> list[bpy.types.ID]:
    """What was found, each once, in its order."""
    return [data for data in dict.fromkeys(found) if data is not None]


def data_of(objects: list[bpy.types.Object]) -> list[bpy.types.ID]:
    """Meshes, and what else objects show."""
    return unique(obj.data for obj in objects)


def keys_of(objects: list[bpy.types.Object]) -> list[bpy.types.Key]:
    return unique(getattr(data, "shape_keys", None) for data in data_of(objects))


def materials_of(objects: list[bpy.types.Object]) -> list[bpy.types.Material]:
    return unique(slot.material for obj in objects for slot in obj.material_slots)


def pictures_of(objects: list[bpy.types.Object]) -> list[bpy.types.Image]:
    """The pictures that objects show, and those that runs paint."""
    painted = [obj.get(PICTURE) for obj in objects]
    return unique([*painted, *(picture for worn in materials_of(objects) for picture in images(worn.node_tree))])


def animations(objects: list[bpy.types.Object]) -> list[bpy.types.AnimData]:
    """What of objects, and of what they show, has keyframes, strips or drivers."""
    worn = materials_of(objects)
    owners = [*objects, *data_of(objects), *keys_of(objects), *worn, *unique(material.node_tree for material in worn)]
    found = [getattr(owner, "animation_data", None) for owner in owners]
    return [animation for animation in found if animation is not None]


def actions_of(objects: list[bpy.types.Object]) -> list[bpy.types.Action]:
    """The actions of all that, those in strips too."""
    owned = animations(objects)
    strips = [strip for animation in owned for track in animation.nla_tracks for strip in track.strips]
    return unique(holder.action for holder in [*owned, *strips])


def everything(objects: list[bpy.types.Object]) -> list[bpy.types.ID]:
    """What goes with objects; shape keys go with their meshes, nodes with materials."""
    dressed = [*materials_of(objects), *groups_of(objects), *pictures_of(objects)]
    return [*data_of(objects), *dressed, *actions_of(objects), *bone_shapes(objects)]


def bone_shapes(objects: list[bpy.types.Object]) -> list[bpy.types.ID]:
    """What bones are drawn as, where that is in no scene: objects and their meshes."""
    bones = [bone for obj in objects if obj.pose is not None for bone in obj.pose.bones]
    shapes = [shape for shape in unique(bone.custom_shape for bone in bones) if not shape.users_scene]
    return [*shapes, *data_of(shapes)]


def groups_of(objects: list[bpy.types.Object]) -> list[bpy.types.NodeTree]:
    """The node groups in materials, the outer ones first."""
    found: dict[bpy.types.NodeTree, None] = {}
    trees = [material.node_tree for material in materials_of(objects) if material.node_tree is not None]
    while trees:
        inner = [node.node_tree for tree in trees for node in tree.nodes if node.type == "GROUP" and node.node_tree]
        trees = [tree for tree in dict.fromkeys(inner) if tree not in found]
        found |= dict.fromkeys(trees)
    return list(found)
