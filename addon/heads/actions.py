"""What the list of heads does."""

import os
from dataclasses import dataclass
from typing import Any

from ..engine import FacewrightError
from ..scene import head_copy, head_names, head_removal, heads, portrait, view
from ..scene.heads import Head
from ..words import say

ASSET = "{head} is an asset: save this file in a folder of an asset library (Preferences, File Paths)"
NONE_YET = "There is no head yet: choose a clip and reconstruct, or append the collection of one"
INSTANCE = "{head} is an instance of {collection}, which is shown and never changed: to change it, add the collection \
without Instance"
LINKED = "{head} is linked from {file}, which is shown and never changed: to change it, append it instead"
OVERRIDDEN = "{head} is a library override, which is shown and never changed: to change it, append it instead"
# Nearer, in metres, a copy stands in its original.
SAME_PLACE = 1e-3


@dataclass(frozen=True)
class Row:
    """A head in the list: a head of the scene, or an Empty that shows an instance of one."""

    obj: Any
    head: Head | None
    # Whether the next run brings it up to date.
    is_next: bool = False

    @property
    def home(self) -> Any:
        """The collection with the head's picture."""
        return self.head.home if self.head is not None else self.obj.instance_collection

    @property
    def is_asset(self) -> bool:
        return self.home is not None and self.home.asset_data is not None

    @property
    def complaint(self) -> str:
        """Why it cannot be changed; empty if it can."""
        if self.head is None:
            return _complaint([], self.obj)
        held = [*self.head.objects, *(obj.data for obj in self.head.objects), self.head.home]
        return "" if self.head.is_local else _complaint(held, self.obj)


@dataclass(frozen=True)
class Listed:
    """What the list shows of a scene: rows, and what is left of heads without a skin, which a run can make anew."""

    rows: list[Row]
    left: list[Head]

    def current(self, active: Any, wanted: str) -> Row | None:
        """The head that the buttons act on: of the active object, or that of a key, or the last; None without any."""
        whole = [row.head for row in self.rows if row.head is not None]
        head = heads.worked_on(whole, active, wanted)
        instance = next((row for row in self.rows if row.head is None and row.obj == active), None)
        # Without a whole head, the first instance.
        return instance or next((row for row in self.rows if row.head is head), None)


def listed(scene: Any) -> Listed:
    """The heads of a scene with a skin and then instances of heads; and what is left of others."""
    found, settings = heads.heads(scene), scene.facewright_clip
    local = [head for head in found if head.is_local]
    following = heads.to_update(local, settings.path, settings.wanted)
    whole = [Row(head.skin, head, head is following) for head in found if head.skin is not None]
    empties = [Row(obj, None) for obj in scene.objects if _shows_instance(obj)]
    return Listed(whole + empties, [head for head in local if head.skin is None])


def current(scene: Any, active: Any) -> Row | None:
    """The head that the buttons act on; None without any."""
    return listed(scene).current(active, scene.facewright_clip.wanted)


def complaint(scene: Any, active: Any) -> str:
    """Why the buttons cannot act, as far as it can be told at every redraw: of the skin, or the instance, alone."""
    obj = active if _shows_instance(active) else heads.current_skin(scene, active, scene.facewright_clip.wanted)
    if obj is None:
        row = current(scene, active)
        return say(NONE_YET) if row is None else row.complaint
    return _complaint([obj, obj.data], obj)


def number(scene: Any, active: Any) -> int:
    """Which of a scene's objects stands for the head that the buttons act on; -1 without any."""
    obj = active if _shows_instance(active) else heads.current_skin(scene, active, scene.facewright_clip.wanted)
    if obj is None:
        row = current(scene, active)
        obj = row.obj if row is not None else None
    return -1 if obj is None else next(k for k, other in enumerate(scene.objects) if other == obj)


def _shows_instance(obj: Any) -> bool:
    """Whether an object is an Empty that shows a head's collection."""
    return bool(obj is not None and obj.instance_collection is not None and heads.key_of(obj.instance_collection))


def _complaint(held: list[Any], obj: Any) -> str:
    """Why what a row shows cannot be changed, where that holds of any of the data; empty if it can."""
    if _shows_instance(obj):
        return say(INSTANCE, head=obj.name, collection=obj.instance_collection.name)
    held = [data for data in held if data is not None]
    files = [data.library.filepath for data in held if data.library is not None]
    if files:
        return say(LINKED, head=obj.name, file=os.path.basename(files[0]))
    if any(data.override_library is not None for data in held):
        return say(OVERRIDDEN, head=obj.name)
    return ""


def choose(scene: Any, layer: Any, number: int) -> None:
    """Make the head for which one of a scene's objects stands the active object, and the one that is updated next."""
    obj = scene.objects[number]
    row = next((row for row in listed(scene).rows if row.obj == obj), None)
    if row is None or (layer.objects.active is not None and layer.objects.active.mode != "OBJECT"):
        return
    if not view.select(layer, obj):
        # The head that is not to be seen shall be the one that is chosen all the same.
        layer.objects.active = None
    if row.head is not None and row.head.is_local:
        scene.facewright_clip.wanted = heads.own_key(scene, row.head)


def make_next(scene: Any, key: str) -> str:
    """Let the next run make the head of a key anew, or another head for an empty one; gives the message."""
    scene.facewright_clip.wanted = key or heads.NEW
    head = heads.of_key(heads.heads(scene), key)
    return say("The next run makes a new head") if head is None else say("The next run makes {head}", head=head.name)


def is_new_next(scene: Any) -> bool:
    """Whether a new head is wanted of the next run."""
    return bool(scene.facewright_clip.wanted == heads.NEW)


def rename(scene: Any, obj: Any, title: str) -> None:
    """Give the head of a skin another name; one without letters, or of another file's head, is not taken."""
    head = next((head for head in heads.heads(scene) if head.skin == obj), None)
    if head is not None and head.is_local and title.strip():
        head_names.rename(scene, head, title.strip())


def duplicate(scene: Any, layer: Any, head: Head) -> str:
    """Copy a head, and choose the copy; gives the message."""
    made = head_copy.duplicate(scene, head)
    assert head.skin is not None and made.skin is not None, "what has no skin is not listed"
    view.select(layer, made.skin)
    scene.facewright_clip.wanted = made.key
    between = (made.skin.matrix_world.translation - head.skin.matrix_world.translation).length
    held = [say("it stands in its original, as its place is animated or held")] if between < SAME_PLACE else []
    return "; ".join([say("{copy} is a copy of {head}", copy=made.name, head=head.name), *held])


def present(window: Any) -> None:
    """Frame what is selected in a window: a copy may stand where the views do not reach."""
    view.present(window)


def remove(scene: Any, head: Head) -> str:
    """Take a head out of the file; gives the message."""
    name, settings = head.name, scene.facewright_clip
    elsewhere = sorted({other.name for obj in head.objects for other in obj.users_scene if other != scene})
    if settings.wanted == head.key:
        settings.wanted = ""
    stays = head_removal.remove(head)
    text = "{head} removed, from {scenes} too" if elsewhere else "{head} removed"
    removed = say(text, head=name, scenes=", ".join(elsewhere))
    return "; ".join([removed, *([say("this stays: {things}", things="; ".join(stays))] if stays else [])])


def mark_as_asset(scene: Any, head: Head) -> str:
    """Offer a head in asset libraries, with a picture; gives the message."""
    head = heads.claimed(scene, head)
    assert head.home is not None, "a head that is changed has a collection"
    portrait.hang(head.home, head.parts)
    head.home.asset_mark()
    return say(ASSET, head=head.name)


def clear_asset(head: Head) -> str:
    """Let a head be no asset any more; gives the message."""
    if head.home is None or head.home.asset_data is None:
        # A copy may have no collection of its own.
        raise FacewrightError(f"{head.name} is no asset")
    head.home.asset_clear()
    return say("{head} is no asset any more", head=head.name)
