"""What an artist does at random, by script: a new action is one function with `@action`."""

import random
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import bpy
import consistent
import numpy as np
from people import duplicated, select
from tracking import module
from windowed import begun

EXPRESSIONS = ("neutral", "happiness", "surprise")
MODES = ("OBJECT", "EDIT", "SCULPT", "WEIGHT_PAINT", "TEXTURE_PAINT")
RENAMED = ("objects", "meshes", "materials", "images", "collections", "shape_keys", "actions", "scenes", "armatures")


@dataclass
class Artist:
    """Who works: where files go, the clips to choose from, and what the file was after each step since it was opened.

    A step in Edit Mode or another knows of what is edited only: what it brings back of the rest is not known.
    """

    folder: Path
    clips: list[str]
    monkeypatch: Any
    steps: list[dict[str, str] | None] = field(default_factory=list)
    # Of the action that is done now, so that leaving another one out changes nothing of it.
    chance: random.Random = field(default_factory=random.Random)
    files: int = 0

    def head(self) -> Any:
        """Any head with a skin in the present scene; None without."""
        found = [head for head in module("scene.heads").heads(bpy.context.scene) if head.skin is not None]
        return self.chance.choice(found) if found else None

    def own_head(self) -> Any:
        """The same of heads that may be changed."""
        head = self.head()
        return head if head is not None and head.is_local else None

    def file(self, suffix: str = ".blend") -> str:
        self.files += 1
        return str(self.folder / f"{self.files}{suffix}")

    def stepped(self) -> None:
        """A step of undo was made."""
        modes = {obj.mode for obj in bpy.data.objects}
        self.steps.append(consistent.state() if modes <= {"OBJECT", "POSE"} else None)

    def opened(self) -> None:
        """Another file is open: its history begins."""
        bpy.ops.ed.undo_push(message="Opened")
        self.steps = [consistent.state()]


Action = Callable[[Artist], None]
ACTIONS: dict[str, tuple[Action, int]] = {}


def action(weight: int) -> Callable[[Action], Action]:
    """An action that is as likely as told against the others."""

    def known(work: Action) -> Action:
        ACTIONS[work.__name__] = (work, weight)
        return work

    return known


def drawn(chance: random.Random, length: int) -> list[tuple[str, int]]:
    """A sequence of actions, each with a seed of its own; it begins with a head."""
    names, weights = list(ACTIONS), [weight for _, weight in ACTIONS.values()]
    chosen = ["reconstruct", *chance.choices(names, weights, k=length - 1)]
    return [(name, chance.randrange(1 << 30)) for name in chosen]


def do(artist: Artist, name: str, seed: int) -> None:
    """Do one action as a step that can be undone."""
    artist.chance = random.Random(seed)
    ACTIONS[name][0](artist)
    if name not in NO_STEP:
        bpy.ops.ed.undo_push(message=name)
        artist.stepped()


def press(button: Any, **options: Any) -> bool:
    """Press a button of the add-on; one that refuses changes nothing. Gives whether it did what it is there for."""
    before = consistent.state()
    try:
        return button(**options) == {"FINISHED"}
    except RuntimeError as refused:
        assert "Traceback" not in str(refused), f"it failed: {str(refused)[-400:]}"
        if changed := consistent.difference(before, consistent.state()):
            raise AssertionError(f"it was refused ({refused}) and yet changed {changed}") from refused
        return False


@action(8)
def reconstruct(artist: Artist) -> None:
    """Press the button: for a new head, the clip's own, or any that can be chosen. Nothing is left over."""
    settings = bpy.context.scene.facewright_clip
    if artist.chance.random() < 0.7:
        settings.path = artist.chance.choice(artist.clips)
    if artist.chance.random() < 0.3:
        choices = module("reconstruct.actions").choices(bpy.context.scene)
        settings.head = artist.chance.choice(choices)[0]
    before = unused()
    if press(bpy.ops.facewright.reconstruct):
        skins = [head.skin for head in module("scene.heads").heads(bpy.context.scene) if head.key == settings.wanted]
        assert len(skins) == 1, f"{len(skins)} heads have the key of the one that was made"
        assert not (loose := consistent.loose(skins[0])), f"these follow nothing: {loose}"
        assert not (sharing := consistent.shared(skins[0])), f"the run did not tell heads apart: {sharing}"
    assert unused() <= before, f"the run left over what nobody uses: {sorted(unused() - before)}"


@action(3)
def reconstruct_meanwhile(artist: Artist) -> None:
    """Press the button, and do something else at any moment of the work."""
    settings = bpy.context.scene.facewright_clip
    settings.path = artist.chance.choice(artist.clips)
    bpy.ops.ed.undo_push(message="Clip")
    artist.stepped()
    if not bpy.ops.facewright.reconstruct.poll():
        return
    before = consistent.state()
    try:
        work = begun(artist.monkeypatch, bpy.ops.facewright.reconstruct)
    except RuntimeError as refused:
        assert "Traceback" not in str(refused), f"it failed: {refused}"
        assert not (changed := consistent.difference(before, consistent.state())), f"refused, and yet changed {changed}"
        return
    # It is over with the second step.
    for _ in range(artist.chance.randrange(2)):
        work.step()
    names = [name for name in ACTIONS if name not in ALONE]
    do(artist, artist.chance.choice(names), artist.chance.randrange(1 << 30))
    ended = work.end()
    assert not any("has failed" in said for said in work.said), work.said
    if "FINISHED" in ended:
        artist.stepped()


def unused() -> set[str]:
    """Data that nothing shows any more."""
    data = bpy.data
    kinds = (data.images, data.materials, data.meshes, data.objects, data.collections, data.armatures, data.curves)
    return {f"{type(one).__name__} {one.name_full}" for kind in kinds for one in kind if not one.users}


@action(4)
def activate(artist: Artist) -> None:
    """Click on any object, or on none."""
    if bpy.context.mode != "OBJECT":
        return
    layer = bpy.context.view_layer
    if len(layer.objects) and artist.chance.random() < 0.9:
        select(artist.chance.choice(list(layer.objects)))
    else:
        layer.objects.active = None


@action(5)
def express(artist: Artist) -> None:
    blend, strength = artist.chance.choice(("REPLACE", "ADD", "MIX")), artist.chance.choice((0.4, 1.0))
    press(bpy.ops.facewright.expression, name=artist.chance.choice(EXPRESSIONS), blend=blend, strength=strength)


@action(3)
def insert_keyframes(artist: Artist) -> None:
    bpy.context.scene.frame_set(artist.chance.randrange(1, 30))
    press(bpy.ops.facewright.insert_keyframes)


@action(2)
def clear_keyframes(_artist: Artist) -> None:
    press(bpy.ops.facewright.clear_keyframes)


@action(2)
def reset_keys(_artist: Artist) -> None:
    press(bpy.ops.facewright.reset_keys)


@action(2)
def mirror_keys(artist: Artist) -> None:
    press(bpy.ops.facewright.mirror_keys, direction=artist.chance.choice(("SWAP", "TO_RIGHT", "TO_LEFT")))


@action(2)
def scrub(artist: Artist) -> None:
    bpy.context.scene.frame_set(artist.chance.randrange(1, 30))


@action(3)
def sculpt(artist: Artist) -> None:
    """Move some vertices of any key, as a brush does."""
    head = artist.own_head()
    if head is None or bpy.context.mode != "OBJECT":
        return
    mesh = artist.chance.choice(head.objects).data
    block = artist.chance.choice(list(mesh.shape_keys.key_blocks)) if mesh.shape_keys else None
    if block is None:
        return
    places = np.empty(3 * len(block.data), np.float32)
    block.data.foreach_get("co", places)
    places[3:9] += 0.003
    block.data.foreach_set("co", places)
    if block == mesh.shape_keys.key_blocks[0]:
        mesh.vertices.foreach_set("co", places)
    mesh.update()


@action(3)
def paint(artist: Artist) -> None:
    """Some pixels. Blender's undo knows nothing of a script's pixels, as it does of a brush's: a history begins."""
    head = artist.own_head()
    picture = artist.chance.choice(head.objects).get(consistent.PICTURE) if head is not None else None
    if picture is None or picture.library is not None or not picture.has_data:
        return
    values = np.empty((len(picture.pixels) // 4, 4), np.float32)
    picture.pixels.foreach_get(values.ravel())
    values[:10, :3] = artist.chance.random()
    picture.pixels.foreach_set(values.ravel())
    picture.update()
    picture.pack()
    artist.opened()


@action(2)
def add_key(artist: Artist) -> None:
    head = artist.own_head()
    if head is not None and bpy.context.mode == "OBJECT":
        obj = artist.chance.choice((head.skin, artist.chance.choice(head.objects)))
        obj.shape_key_add(name="Scar", from_mix=False).value = 0.5


@action(1)
def rename_key(artist: Artist) -> None:
    head = artist.own_head()
    keys = artist.chance.choice(head.objects).data.shape_keys if head is not None else None
    if keys is not None and len(keys.key_blocks) > 1:
        artist.chance.choice(list(keys.key_blocks)[1:]).name = artist.chance.choice(("Mine", "jawOpen"))


@action(1)
def delete_key(artist: Artist) -> None:
    """By its button: a script that takes a key from under its driver crashes Blender."""
    head, layer = artist.own_head(), bpy.context.view_layer.objects
    obj = artist.chance.choice(head.objects) if head is not None else None
    if obj is None or bpy.context.mode != "OBJECT" or obj not in layer.values() or obj.data.shape_keys is None:
        return
    layer.active = obj
    obj.active_shape_key_index = artist.chance.randrange(len(obj.data.shape_keys.key_blocks))
    if bpy.ops.object.shape_key_remove.poll():
        bpy.ops.object.shape_key_remove()


@action(3)
def rename(artist: Artist) -> None:
    """Any data, sometimes to a name that another has."""
    things = [data for data in getattr(bpy.data, artist.chance.choice(RENAMED)) if data.library is None]
    if things:
        artist.chance.choice(things).name = artist.chance.choice(("Face", "Thing", "Face skin", "Facewright"))


@action(3)
def duplicate(artist: Artist) -> None:
    """Shift-D of a whole head, of its skin alone, or of a part."""
    _duplicate(artist, linked=False)


@action(2)
def duplicate_linked(artist: Artist) -> None:
    _duplicate(artist, linked=True)


def _duplicate(artist: Artist, linked: bool) -> None:
    head = artist.head()
    if head is not None and bpy.context.mode == "OBJECT":
        part = artist.chance.choice(head.objects)
        _copies(artist.chance.choice((head.objects, head.objects, [head.skin], [part])), linked)


def _copies(objects: list[bpy.types.Object], linked: bool) -> list[bpy.types.Object]:
    """Shift-D of those that can be seen."""
    layer = bpy.context.view_layer.objects.values()
    seen = [obj for obj in objects if obj in layer and obj.visible_get() and obj.mode == "OBJECT"]
    return list(duplicated(*seen, linked=linked).values()) if seen else []


@action(2)
def delete(artist: Artist) -> None:
    """A part, the skin, or a whole head, with X."""
    head = artist.head()
    if head is None or bpy.context.mode != "OBJECT":
        return
    chosen = artist.chance.choice(([head.skin], head.objects, [artist.chance.choice(head.objects)]))
    if all(obj in bpy.context.view_layer.objects.values() for obj in chosen):
        select(*chosen)
        if bpy.ops.object.delete.poll():
            bpy.ops.object.delete()


@action(1)
def delete_collection(artist: Artist) -> None:
    if bpy.data.collections and bpy.context.mode == "OBJECT":
        bpy.data.collections.remove(artist.chance.choice(list(bpy.data.collections)))


@action(1)
def delete_look(artist: Artist) -> None:
    """A picture, a material, or a mesh, as from the outliner's Blender File view."""
    kind = getattr(bpy.data, artist.chance.choice(("images", "materials", "meshes")))
    # Undo does not bring back what is linked.
    own = [data for data in kind if data.library is None]
    if own and bpy.context.mode == "OBJECT":
        kind.remove(artist.chance.choice(own))


@action(1)
def purge(_artist: Artist) -> None:
    bpy.ops.outliner.orphans_purge(do_recursive=True)


@action(2)
def hide(artist: Artist) -> None:
    head = artist.head()
    if head is None or bpy.context.mode != "OBJECT":
        return
    obj = artist.chance.choice(head.objects)
    if obj in bpy.context.view_layer.objects.values():
        obj.hide_set(not obj.hide_get())
    if obj.library is None and artist.chance.random() < 0.3:
        obj.hide_viewport = not obj.hide_viewport


@action(1)
def exclude(artist: Artist) -> None:
    """Take a collection out of the view layer, or back into it."""
    layers = list(bpy.context.view_layer.layer_collection.children)
    if layers and bpy.context.mode == "OBJECT":
        layer = artist.chance.choice(layers)
        layer.exclude = not layer.exclude


@action(2)
def unlink(artist: Artist) -> None:
    """Take a head's object out of its collection, and put it elsewhere or nowhere."""
    head = artist.own_head()
    if head is None or bpy.context.mode != "OBJECT":
        return
    obj = artist.chance.choice(head.objects)
    for home in [home for home in obj.users_collection if home.library is None]:
        home.objects.unlink(obj)
    if artist.chance.random() < 0.7:
        artist.chance.choice(bpy.data.scenes).collection.objects.link(obj)


@action(2)
def copy_collection(artist: Artist) -> None:
    """A head's collection twice: with the same objects, or with copies of them."""
    head = artist.own_head()
    if head is None or head.home is None or bpy.context.mode != "OBJECT":
        return
    twin = head.home.copy()
    bpy.context.scene.collection.children.link(twin)
    if artist.chance.random() < 0.5:
        return
    for obj in _copies(head.objects, linked=False):
        for home in obj.users_collection:
            home.objects.unlink(obj)
        twin.objects.link(obj)
    for obj in [obj for obj in twin.objects if obj in head.objects]:
        twin.objects.unlink(obj)


@action(2)
def switch_scene(artist: Artist) -> None:
    bpy.context.window.scene = artist.chance.choice(bpy.data.scenes)


@action(1)
def new_scene(artist: Artist) -> None:
    if bpy.context.mode == "OBJECT":
        bpy.ops.scene.new(type=artist.chance.choice(("NEW", "EMPTY", "LINK_COPY", "FULL_COPY")))


@action(1)
def delete_scene(_artist: Artist) -> None:
    if len(bpy.data.scenes) > 1 and bpy.context.mode == "OBJECT":
        bpy.data.scenes.remove(bpy.context.scene)


@action(3)
def change_mode(artist: Artist) -> None:
    """Any mode; of a mesh that is linked Blender refuses some, each version others."""
    if not bpy.ops.object.mode_set.poll():
        return
    obj, mode = bpy.context.object, artist.chance.choice(MODES)
    # An armature has other modes.
    mode = mode if obj.type == "MESH" else artist.chance.choice(("OBJECT", "POSE"))
    try:
        bpy.ops.object.mode_set(mode=mode)
    except RuntimeError as refused:
        assert obj.data.library is not None, f"Blender refuses {mode} of {obj.name}: {refused}"


@action(3)
def leave_mode(_artist: Artist) -> None:
    if bpy.ops.object.mode_set.poll():
        bpy.ops.object.mode_set(mode="OBJECT")


@action(5)
def undo_and_redo(artist: Artist) -> None:
    """Back one step and forth again: the file is what it was before the step, and then what it was after it."""
    if len(artist.steps) < 2:
        return
    bpy.ops.ed.undo()
    expect(artist.steps[-2], "undo")
    bpy.ops.ed.redo()
    expect(artist.steps[-1], "redo")


@action(4)
def undo(artist: Artist) -> None:
    """Back one step, to go on from there."""
    if len(artist.steps) > 1:
        bpy.ops.ed.undo()
        artist.steps.pop()
        expect(artist.steps[-1], "undo")


def expect(step: dict[str, str] | None, brought_by: str) -> None:
    """The file is what it was at a step."""
    if step is not None and (changed := consistent.difference(step, consistent.state())):
        raise AssertionError(f"{brought_by} does not bring back: {changed}")


@action(3)
def save_and_open(artist: Artist) -> None:
    path = artist.file()
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    artist.opened()


@action(1)
def append_elsewhere(artist: Artist) -> None:
    """Go on in a new file with all heads of this one."""
    _take_along(artist, link=False)


@action(1)
def link_elsewhere(artist: Artist) -> None:
    _take_along(artist, link=True)


def _take_along(artist: Artist, link: bool) -> None:
    homes = {h.home.name for s in bpy.data.scenes for h in module("scene.heads").heads(s) if h.home and h.is_local}
    path = artist.file()
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(path, link=link) as (there, here):
        here.collections = [name for name in there.collections if name in homes]
    for home in here.collections:
        bpy.context.scene.collection.children.link(home)
    artist.opened()


@action(1)
def export(artist: Artist) -> None:
    """The file is what it was."""
    before, path = consistent.state(), artist.file(".glb")
    if press(bpy.ops.facewright.export, filepath=path):
        assert Path(path).stat().st_size > 1000, "the exported file is empty"
    if changed := consistent.difference(before, consistent.state()):
        raise AssertionError(f"the export changed {changed}")


# These leave the history as it is, make steps themselves, or begin another.
NO_STEP = {
    "undo_and_redo",
    "undo",
    "paint",
    "reconstruct_meanwhile",
    "save_and_open",
    "append_elsewhere",
    "link_elsewhere",
}
# These are not done while work goes on: another file ends it, and only one runs at a time.
ALONE = {"reconstruct", "reconstruct_meanwhile", "save_and_open", "append_elsewhere", "link_elsewhere"}
