"""What an artist reads: labels, tooltips with units, reasons of grey buttons, names in the README."""

import re
import warnings
from types import ModuleType
from typing import Any

import bpy
import pytest
from conftest import ROOT
from tracking import module
from words import classes, drawn, is_named, operator, operators, own_properties, words

# What a number is of, where Blender's own unit or subtype does not say it.
UNITS = ("millimetre", "pixel", "second", "degree", "frame", "metre")
# Numbers without a unit: how many of something, which of something, or a part of a whole.
COUNTS = re.compile(r"how many|position in|row|terms|corners|number of|of the expression", re.IGNORECASE)
READMES = ("README.md", "addon/README.md")
# What else is set like that in them.
PAPER = "New Algorithm for 3D Facial Model Reconstruction and Its Application in Virtual Reality"
# `*Track Face*`: a name of the interface as our READMEs write it.
NAMED = re.compile(r"(?<![*\w])\*{1,2}([A-Z][^*\n]*?)\*{1,2}(?![*\w])")


def public(prop: Any) -> bool:
    return not prop.is_hidden


def test_every_class_has_words() -> None:
    found = words()
    assert len(found) > 200 and len({word.where for word in found}) == len(found)
    spoken = {word.where.split(".")[0] for word in found}
    silent = {
        cls.__name__
        for cls in classes()
        if not issubclass(cls, (bpy.types.UIList, bpy.types.KeyingSetInfo, bpy.types.FileHandler))
    }
    # Groups of settings without a choice of the artist's speak by their rows only.
    assert silent - spoken == set()


def test_no_description_ends_with_a_full_stop_or_is_missing() -> None:
    """Blender puts the full stop there itself."""
    for word in words():
        assert not word.text.endswith("."), word
        assert "\n" not in word.text and "  " not in word.text, f"{word.where} is broken into lines"
    for cls in classes():
        spoken = not issubclass(cls, bpy.types.Operator) or operator(cls).get_rna_type().description
        assert spoken, f"{cls.__name__} says nothing"
        for prop in own_properties(cls):
            assert prop.description or not (public(prop) and is_named(prop)), f"{cls.__name__}.{prop.identifier}"


def test_labels_are_title_case_as_blenders_are() -> None:
    small = {"a", "an", "the", "of", "on", "in", "to", "from", "for", "and", "at", "it", "as", "per", "with", "than"}
    labels = [word for word in words() if word.where.endswith(("bl_label",))]
    labels += [word for word in drawn() if word.text.endswith("…")]
    assert len(labels) > 60
    for word in labels:
        for part in word.text.split():
            assert part in small or not part[0].islower(), f"{word.text} at {word.where}"


def numbers() -> list[Any]:
    found = [
        pytest.param(cls, prop, id=f"{cls.__name__}.{prop.identifier}")
        for cls in classes()
        for prop in own_properties(cls)
        if prop.type in {"INT", "FLOAT"} and public(prop)
    ]
    return found


def test_every_number_says_its_unit() -> None:
    found = numbers()
    assert len(found) > 15
    for parameter in found:
        _, prop = parameter.values
        told = prop.unit != "NONE" or prop.subtype in {"FACTOR", "PERCENTAGE"}
        about = f"{prop.name} {prop.description}".lower()
        assert told or any(unit in about for unit in UNITS) or COUNTS.search(about), f"{parameter.id}: {about}"


def reason(cls: Any) -> str:
    """What Blender says of a grey button; empty where it is none."""
    call = operator(cls)
    if call.poll():
        return ""
    with pytest.raises(RuntimeError) as refused:
        call()
    _, _, said = str(refused.value).partition(".poll() ")
    return said.strip()


def complain(state: str) -> dict[str, str]:
    """The reasons of all grey buttons; each must have one that is a sentence of ours."""
    said = {cls.bl_idname: reason(cls) for cls in operators() if not operator(cls).poll()}
    for name, sentence in said.items():
        assert sentence and "context is incorrect" not in sentence, f"{name} is grey {state} and does not say why"
        assert not sentence.endswith("."), f"{name}: {sentence}"
    return said


def test_every_grey_button_says_why_in_an_empty_scene() -> None:
    said = complain("in an empty scene")
    assert len(said) > 20
    assert said["facewright.reconstruct"] == "Choose a clip first"


def test_every_grey_button_says_why_in_edit_mode(generic_face: bpy.types.Object) -> None:
    bpy.context.view_layer.objects.active = generic_face
    bpy.ops.object.mode_set(mode="EDIT")
    said = complain("in Edit Mode")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert said["facewright.reconstruct"] == said["facewright.export"] == "Go to Object Mode first"


def test_every_grey_button_says_why_while_work_goes_on(
    addon: ModuleType, tracked: bpy.types.MovieClip, generic_face: bpy.types.Object, monkeypatch: pytest.MonkeyPatch
) -> None:
    bpy.context.scene.facewright_clip.path = str(ROOT / "tests/data/clip/frames")
    monkeypatch.setattr(module("modal").Running, "active", True)
    said = complain("while work goes on")
    busy = {name for name, sentence in said.items() if "already working" in sentence}
    assert {"facewright.reconstruct", "facewright.calibrate", "facewright.track", "facewright.motion"} <= busy


def test_names_in_the_readmes_are_names_of_the_interface(generic_face: bpy.types.Object) -> None:
    known = {word.text.rstrip("…") for word in [*words(), *drawn()]} | {generic_face.name}
    known |= {getattr(cls, name) for cls in classes() for name in ("bl_label", "bl_category") if hasattr(cls, name)}
    known |= set(module("animate.actions").groups(generic_face)) | {module("scene.keys").OTHER, PAPER}
    named = [(path, name) for path in READMES for name in NAMED.findall((ROOT / path).read_text(encoding="utf-8"))]
    assert len(named) > 30
    unknown = [(path, name) for path, name in named if name.rstrip("…") not in known]
    assert not unknown


def test_paths_may_begin_at_the_files_folder() -> None:
    """Blender 4.5 and newer warn of `//` in a property that has not been declared so."""
    scene = bpy.context.scene
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene.facewright_clip.path = "//film.mp4"
        scene.facewright_clip.output = "//head"
        scene.facewright_rig.folders.add().path = "//left"
    if bpy.app.version >= (4, 5, 0):
        for cls in classes():
            for prop in own_properties(cls):
                if prop.type == "STRING" and prop.subtype in {"FILE_PATH", "DIR_PATH"}:
                    assert prop.is_path_supports_blend_relative, f"{cls.__name__}.{prop.identifier}"
