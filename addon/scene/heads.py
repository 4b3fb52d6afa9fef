"""Which heads a scene has, and which objects are whose.

A head is a skin with its parts, all marked with the head's key, and a collection of its own with the same mark: names,
parents and collections are the artist's to change. Blender copies marks, so a copied head has the key of its original
until a run gives it another; until then parents and drivers, which Blender turns to the copies, tell whose a part is.
"""

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from uuid import uuid4

import bpy

from .footage import PICTURES

# Of objects: which part of a head they are, and of which head, as of its collection. Older versions had no keys.
PART = "facewright_part"
KEY = "facewright_head"
# Of a skin: the clip it was made from, as of its collection, for when the skin is deleted; and its name when it was
# made, by which an original is told from its copies.
CLIP = "facewright_made_of"
NAME = "facewright_name"
SKIN = "skin"
TITLE = "Face"
# What is wanted of a run, in the place of a head's key: another head. Empty: the one that the clip has made.
NEW = "new"


@dataclass(frozen=True)
class Head:
    """A head as it is in a scene; without a skin, what is left of one: `parts` by name, the skin's among them."""

    key: str
    skin: bpy.types.Object | None
    parts: dict[str, bpy.types.Object]
    home: bpy.types.Collection | None

    @property
    def objects(self) -> list[bpy.types.Object]:
        return list(self.parts.values())

    @property
    def name(self) -> str:
        """The name of its skin; of the collection, or of a part, where there is none."""
        named = self.skin or self.home or self.objects[0]
        return named.name

    @property
    def title(self) -> str:
        """What tells it from others, whether the artist has renamed its skin or its collection."""
        home = self.home.name if self.home is not None else self.name
        return self.name if home == self.name else f"{self.name} in {home}"

    @property
    def is_local(self) -> bool:
        """Whether it may be changed: neither linked from another file nor an override of what is."""
        held = [*self.objects, *(obj.data for obj in self.objects), *([self.home] if self.home is not None else [])]
        return all(data.library is None and data.override_library is None for data in held)

    @property
    def clip(self) -> str | None:
        """The clip it was made from, as it was given; None where that is not known."""
        memory = self.skin or self.home
        return memory.get(CLIP) if memory is not None else None


def heads(scene: bpy.types.Scene) -> list[Head]:
    """The heads of a scene: those with a skin, an original before its copies; then what is left of others."""
    marked = [obj for obj in scene.objects if obj.type == "MESH" and obj.get(PART)]
    homes = [c for c in scene.collection.children_recursive if c.get(KEY)]
    skins = _skins(marked)
    whole = {skin: {SKIN: skin} for same in skins.values() for skin in same}
    rest: dict[str, dict[str, bpy.types.Object]] = {key_of(c): {} for c in homes if key_of(c) not in skins}
    others = [(obj, skins.get(key_of(obj), [])) for obj in marked if obj[PART] != SKIN]
    owners = {obj: _owner(obj, same) for obj, same in others}
    # What hangs on a skin goes before what only has its key, as the parts of a deleted original have a copy's.
    for obj, same in sorted(others, key=lambda other: owners[other[0]] is None):
        owner = owners[obj] or next(iter(same), None)
        parts = whole[owner] if owner is not None else rest.setdefault(key_of(obj), {})
        parts.setdefault(str(obj[PART]), obj)
    found = [(key_of(skin), skin, parts) for skin, parts in whole.items()]
    found += [(key, None, parts) for key, parts in rest.items()]
    known = [Head(key, skin, parts, _home(key, parts.values(), homes)) for key, skin, parts in found]
    # Of a head that is deleted nothing is left when what is in its collection is another's.
    return [head for head in known if head.parts or head.home is not None]


def current(scene: bpy.types.Scene, active: bpy.types.Object | None, key: str) -> tuple[Head, str] | None:
    """The head that an artist works on: that of the active object, or that of a key, or the last one of the scene.

    After it comes what tells it from the others of the scene; empty where there are none.
    """
    found = [head for head in heads(scene) if head.skin is not None]
    head = worked_on(found, active, key)
    return None if head is None else (head, head.title if len(found) > 1 else "")


def current_skin(scene: bpy.types.Scene, active: bpy.types.Object | None, key: str) -> bpy.types.Object | None:
    """The skin of the same; at once where that is active, as buttons ask at every redraw and a scene may be large."""
    is_skin = active is not None and active.type == "MESH" and active.get(PART) == SKIN
    # Where a linked object has the same name, the other one may be found, and all are looked through.
    if active is not None and is_skin and scene.objects.get(active.name) == active:
        return active
    shown = current(scene, active, key)
    return shown[0].skin if shown is not None else None


def worked_on(found: list[Head], active: bpy.types.Object | None, key: str) -> Head | None:
    """Of heads with skins the one that an object is of, or hangs on; else that of a key, or the last."""
    while active is not None:
        for head in found:
            if active in head.objects:
                return head
        active = active.parent
    return of_key(found, key) or (found[-1] if found else None)


def of_key(found: list[Head], key: str) -> Head | None:
    """The head of a key: the original, where copies share it."""
    return next((head for head in found if key and head.key == key), None)


def made_of(found: list[Head], clip: str) -> Head | None:
    """The last head that was made from a clip, or else by a version that did not remember the clip; no copy of it."""
    known = [head for head in found if head.clip and same_clip(head.clip, clip)]
    older = [head for head in found if head.clip is None and (head.skin is not None or not head.key)]
    if known:
        return next(head for head in known if head.key == known[-1].key)
    return older[-1] if older else None


def to_update(found: list[Head], clip: str, wanted: str) -> Head | None:
    """Which of the heads a run on a clip brings up to date, where a key or `NEW` is wanted; None for a new one."""
    return None if wanted == NEW else of_key(found, wanted) or made_of(found, clip)


def same_clip(a: str, b: str) -> bool:
    """Whether two paths are one clip: a video, a folder of frames, or any frame of it."""
    # Where systems do not tell capitals from small letters, nor do paths.
    return os.path.normcase(_clip(a)) == os.path.normcase(_clip(b))


def own_key(scene: bpy.types.Scene, head: Head) -> str:
    """The key of a head, which gets one that no other has if need be."""
    same = [other for other in heads(scene) if other.key == head.key]
    if head.key and len(same) == 1:
        return head.key
    key = uuid4().hex
    for obj in head.objects:
        obj[KEY] = key
    # A copy may lie in the collection of its original, which comes first.
    if head.home is not None and head.skin == next(other.skin for other in same if other.home == head.home):
        head.home[KEY] = key
    return key


def claimed(scene: bpy.types.Scene, head: Head) -> Head:
    """A head that is about to be changed, with a key and a collection that are its own."""
    key = own_key(scene, head)
    head = next(other for other in heads(scene) if other.key == key)
    if head.home is not None:
        return head
    before = next(c for c in _tree(scene) if head.objects[0] in c.objects.values())
    home = _new_home(scene, before, head.name, key)
    for obj in head.objects:
        if obj in before.objects.values():
            home.objects.link(obj)
            before.objects.unlink(obj)
    return Head(key, head.skin, head.parts, home)


def begun(scene: bpy.types.Scene, parent: bpy.types.Collection | None, title: str = TITLE) -> Head:
    """A head without objects, in a new collection within another, or beside a head's (None: the scene's own)."""
    key = uuid4().hex
    return Head(key, None, {}, _new_home(scene, parent or scene.collection, title, key))


def key_of(marked: bpy.types.Object | bpy.types.Collection) -> str:
    """The key of the head that an object or a collection is of; empty for an older version's."""
    return str(marked.get(KEY, ""))


def mark(obj: bpy.types.Object, part: str, key: str) -> None:
    """Make an object a part of a head."""
    obj[PART], obj[KEY] = part, key


def remember(head: Head, skin: bpy.types.Object, clip: str) -> None:
    """Let a head know its skin by its name, and the clip it was made from (empty: as before)."""
    skin[NAME] = skin.name
    if clip:
        skin[CLIP] = clip
        if head.home is not None:
            head.home[CLIP] = clip


def release(obj: bpy.types.Object) -> None:
    """Make a part an ordinary object of the artist's."""
    for name in (PART, KEY, NAME, CLIP):
        if name in obj:
            del obj[name]


def _skins(marked: list[bpy.types.Object]) -> dict[str, list[bpy.types.Object]]:
    """The skins by their keys, an original first."""
    found: dict[str, list[bpy.types.Object]] = {}
    for obj in marked:
        if obj[PART] == SKIN:
            found.setdefault(key_of(obj), []).append(obj)
    return {key: sorted(same, key=lambda skin: skin.get(NAME) != skin.name) for key, same in found.items()}


def _owner(part: bpy.types.Object, skins: list[bpy.types.Object]) -> bpy.types.Object | None:
    """Which of the skins with its key a part hangs on: by parents, or else by the drivers of its keys."""
    parent = part.parent
    while parent is not None:
        if parent in skins:
            return parent
        parent = parent.parent
    driving = _driving(part) if skins else []
    return next((skin for skin in skins if skin.data.shape_keys in driving), None)


def _driving(part: bpy.types.Object) -> list[bpy.types.ID]:
    """What the drivers of a part's keys read."""
    keys = part.data.shape_keys
    curves = keys.animation_data.drivers if keys is not None and keys.animation_data is not None else []
    return [target.id for curve in curves for variable in curve.driver.variables for target in variable.targets]


def _home(
    key: str, objects: Iterable[bpy.types.Object], homes: list[bpy.types.Collection]
) -> bpy.types.Collection | None:
    """The collection with a head's key: one that holds it, or else one that holds nothing of another head."""
    own, ours = [home for home in homes if key and key_of(home) == key], list(objects)
    holding = [home for obj in ours for home in own if obj in home.all_objects.values()]
    empty = [home for home in own if not any(obj.get(PART) for obj in home.all_objects)]
    return next(iter([*holding, *empty]), None)


def _tree(scene: bpy.types.Scene) -> list[bpy.types.Collection]:
    return [scene.collection, *scene.collection.children_recursive]


def _new_home(scene: bpy.types.Scene, within: bpy.types.Collection, name: str, key: str) -> bpy.types.Collection:
    home = bpy.data.collections.new(name)
    home[KEY] = key
    _outside(scene, within).children.link(home)
    return home


def _outside(scene: bpy.types.Scene, within: bpy.types.Collection) -> bpy.types.Collection:
    """The collection itself, or the nearest around it that is of no head; the scene's own where nothing can be put."""
    parents = {child: parent for parent in _tree(scene) for child in parent.children}
    place = at = within
    while at in parents:
        if at.get(KEY):
            place = parents[at]
        at = parents[at]
    reachable = at == scene.collection and place.library is None and place.override_library is None
    return place if reachable else scene.collection


def _clip(path: str) -> str:
    place = Path(os.path.abspath(bpy.path.abspath(path)))
    return str(place.parent if place.suffix.lower() in PICTURES else place)
