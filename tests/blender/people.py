"""People that tests make of the generic head, and what tells whose a head is."""

import json
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray
from tracking import Finished, module

PARTS = {"skin", "eye_left", "eye_right", "teeth_upper", "teeth_lower", "tongue", "lashes"}
SIDE = 16


@dataclass(frozen=True)
class Person:
    """Who is before the camera: how large against the generic head, and how red, 0 to 255."""

    name: str
    size: float
    red: int


ANNA, BEN = Person("Anna", 0.9, 200), Person("Ben", 1.2, 60)
OLDER_ANNA = Person("Anna", 1.0, 220)
# The clips of both, `anna` and `ben`.
Clips = SimpleNamespace


def result(person: Person) -> Any:
    """What the library makes of a person: all that a native result has, in numpy."""
    generic = module("engine").generic_head()
    names = [name for name in dir(generic) if not name.startswith("_")]
    made = SimpleNamespace(**{name: getattr(generic, name) for name in names})
    made.positions = (generic.positions * person.size).astype(np.float32)
    made.keys = [(name, moved, (by * person.size).astype(np.float32)) for name, moved, by in generic.keys]
    made.texture = made.eyes = np.full((SIDE, SIDE, 4), (person.red, 0, 0, 255), np.uint8)
    made.report = json.dumps(json.loads(generic.report) | {"warnings": [f"this is {person.name}"]})
    made.expressions = [(person.name.lower(), [("jawOpen", 0.5)]), *generic.expressions]
    return made


def clip_of(folder: Path, person: Person) -> str:
    """A clip of a person: a folder of frames. Gives its path."""
    clip = folder / person.name
    clip.mkdir(exist_ok=True)
    (clip / "frame_00.png").touch()
    return str(clip)


def library(monkeypatch: Any, persons: tuple[Person, ...] = (ANNA, BEN)) -> None:
    """Lets the library reconstruct the person that a clip is named after."""
    by_name = {person.name: person for person in persons}

    def reconstruct(frames: list[str], **_settings: Any) -> Finished:
        return Finished(result(by_name[Path(frames[0]).parent.name]))

    monkeypatch.setattr(module("reconstruct.actions"), "reconstruct", reconstruct)


def run(clip: str, head: str | None = None) -> bpy.types.Object:
    """Choose a clip, and a head if one is named, and press the button; gives the skin."""
    settings = bpy.context.scene.facewright_clip
    settings.path = clip
    if head is not None:
        settings.head = head
    assert bpy.ops.facewright.reconstruct() == {"FINISHED"}
    return bpy.context.object


def heads() -> list[Any]:
    return module("scene.heads").heads(bpy.context.scene)


def head_of(skin: bpy.types.Object) -> Any:
    return next(head for head in heads() if head.skin == skin)


def size(skin: bpy.types.Object) -> float:
    """How large a head is against the generic one, by its shape at rest."""
    mine = np.empty(3 * len(skin.data.vertices), np.float32)
    skin.data.shape_keys.key_blocks["Basis"].data.foreach_get("co", mine)
    generic = np.empty_like(mine)
    skin.data.attributes["generic_position"].data.foreach_get("vector", generic)
    return float(np.ptp(mine) / np.ptp(generic))


def reds(skin: bpy.types.Object) -> set[int]:
    """The red levels of all pictures that a head shows."""
    shown = [worn for obj in head_of(skin).objects for worn in obj.data.materials]
    nodes = [node for worn in shown for node in worn.node_tree.nodes if node.type == "TEX_IMAGE"]
    return {red(node.image) for node in nodes}


def red(picture: bpy.types.Image) -> int:
    pixels = np.empty(4 * picture.size[0] * picture.size[1], np.float32)
    picture.pixels.foreach_get(pixels)
    return round(255 * float(pixels[0]))


def opened(skin: bpy.types.Object) -> float:
    """How far the lower teeth come down when the jaw of a head opens, metres; the jaw is shut afterwards."""
    teeth, jaw = head_of(skin).parts["teeth_lower"], skin.data.shape_keys.key_blocks["jawOpen"]
    before = jaw.value
    jaw.value = 0.0
    rest = evaluated(teeth)
    jaw.value = 1.0
    down = rest - evaluated(teeth)
    jaw.value = before
    return float(down[:, 2].mean())


def evaluated(obj: bpy.types.Object) -> NDArray[np.float32]:
    """(n, 3) vertices with all keys applied."""
    bpy.context.view_layer.update()
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    positions = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", positions)
    return positions.reshape(-1, 3)


def warnings(skin: bpy.types.Object) -> list[str]:
    return json.loads(skin["facewright_report"])["warnings"]


def assert_is(skin: bpy.types.Object, person: Person) -> None:
    """Shape, pictures, report and expressions of a head are a person's, and its parts are there and follow."""
    whose = f"{skin.name} is {person.name}"
    assert abs(size(skin) - person.size) < 1e-3, f"{whose}: its shape"
    assert reds(skin) == {person.red}, f"{whose}: its pictures"
    assert warnings(skin) == [f"this is {person.name}"], f"{whose}: its report"
    assert next(iter(json.loads(skin["facewright_expressions"]))) == person.name.lower(), f"{whose}: its expressions"
    assert set(head_of(skin).parts) == PARTS, f"{whose}: its parts"
    assert opened(skin) > 0.004 * person.size, f"{whose}: its parts follow its own keys"


def select(*objects: bpy.types.Object) -> None:
    """Select these alone; the first is active."""
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in objects)
    bpy.context.view_layer.objects.active = objects[0]


def reopened(path: Path) -> None:
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))


def collection_of(obj: bpy.types.Object) -> bpy.types.Collection:
    (home,) = obj.users_collection
    return home


def duplicated(*objects: bpy.types.Object, linked: bool = False) -> dict[str, bpy.types.Object]:
    """Copies that Blender makes of objects, by the part that they are of."""
    select(*objects)
    before = set(bpy.data.objects)
    assert bpy.ops.object.duplicate(linked=linked) == {"FINISHED"}
    return {obj["facewright_part"]: obj for obj in set(bpy.data.objects) - before}
