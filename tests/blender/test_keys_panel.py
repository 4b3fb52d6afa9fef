"""Groups of a face's keys, the search, and what the panels show of them; linked heads."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import bpy
import pytest
from people import Clips, run, select
from test_heads_copied import link
from test_keys import ACTS, FACE, blocks, values
from tracking import Layout, module


def test_every_key_of_a_head_is_in_one_group(generic_face: bpy.types.Object) -> None:
    for name in ("Sculpt", "browser", "mouth fix", "EYEBLINKLEFT"):
        generic_face.shape_key_add(name=name, from_mix=False)
    groups = module("scene.keys").grouped(generic_face)
    listed = [block.name for group in groups.values() for block in group]
    assert sorted(listed) == sorted(block.name for block in blocks(generic_face)) and len(set(listed)) == len(listed)
    assert [block.name for block in groups["Other"]] == ["Sculpt", "browser", "mouth fix", "EYEBLINKLEFT"]
    sizes = {name: len(group) for name, group in groups.items()}
    arkit = {"Brows": 5, "Lids": 6, "Gaze": 8, "Cheeks": 3, "Nose": 2, "Jaw": 4, "Mouth": 23, "Tongue": 1}
    assert sizes == arkit | {"Visemes": 15, "Other": 4}


@pytest.mark.parametrize(
    "text, wanted",
    [
        ("eyewide", {"eyeWideLeft", "eyeWideRight"}),
        ("smile LEFT", {"mouthSmileLeft"}),
        ("left  gaze", {"eyeLookDownLeft", "eyeLookInLeft", "eyeLookOutLeft", "eyeLookUpLeft"}),
        ("tongue", {"tongueOut"}),
        ("ear wiggle", set()),
    ],
)
def test_a_search_finds_keys_by_words_of_name_and_group(
    generic_face: bpy.types.Object, text: str, wanted: set[str]
) -> None:
    assert {block.name for block in module("scene.keys").found(generic_face, text)} == wanted


class Panels(Layout):
    """A layout with every panel in it open; knows the sliders, and whether they are grey."""

    def __init__(self) -> None:
        super().__init__()
        self.sliders: list[str] = []
        self.diamonds: list[str] = []
        self.enabled = True

    def prop(self, data: Any, name: str, **more: Any) -> None:
        super().prop(data, name, **more)
        if isinstance(data, bpy.types.ShapeKey):
            assert name == "value"
            self.sliders.append(data.name)

    def prop_decorator(self, data: Any, name: str) -> None:
        assert name in data.bl_rna.properties
        self.diamonds.append(data.name)

    def panel(self, _name: str, default_closed: bool) -> tuple["Panels", "Panels"]:
        assert default_closed
        return self, self

    def row(self, **_more: Any) -> "Panels":
        return self

    column = grid_flow = row


def draw(panel: str, skin: bpy.types.Object) -> Panels:
    layout = Panels()
    system = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))
    shown = SimpleNamespace(
        scene=bpy.context.scene,
        object=skin,
        window_manager=bpy.context.window_manager,
        region=SimpleNamespace(width=400),
        preferences=system,
    )
    getattr(bpy.types, panel).draw(SimpleNamespace(layout=layout), shown)
    return layout


def test_the_panel_has_a_slider_and_a_diamond_for_every_key(generic_face: bpy.types.Object) -> None:
    generic_face.shape_key_add(name="Sculpt", from_mix=False)
    layout = draw("FACEWRIGHT_PT_keys", generic_face)
    assert sorted(layout.sliders) == sorted(block.name for block in blocks(generic_face))
    assert layout.diamonds == layout.sliders and layout.enabled
    generic_face.data.shape_keys.key_blocks["jawOpen"].value = 0.5
    assert {"Jaw (1 of 4)", "Brows"} <= set(draw("FACEWRIGHT_PT_keys", generic_face).said)


def test_the_panels_search_shows_what_it_finds_or_says_that_there_is_nothing(generic_face: bpy.types.Object) -> None:
    settings = bpy.context.window_manager.facewright_keys
    settings.search = "wide"
    assert draw("FACEWRIGHT_PT_keys", generic_face).sliders == ["eyeWideLeft", "eyeWideRight"]
    settings.search = "antlers"
    layout = draw("FACEWRIGHT_PT_keys", generic_face)
    assert not layout.sliders and layout.said == ["No key has these words"]
    settings.search = ""


def test_a_linked_head_is_shown_grey_with_the_reason_and_refused(clips: Clips, tmp_path: Path) -> None:
    run(clips.anna)
    link(tmp_path / "anna.blend")
    linked = bpy.context.scene.objects["Face"]
    select(linked)
    layout = draw("FACEWRIGHT_PT_keys", linked)
    assert len(layout.sliders) == len(blocks(linked)) and not layout.enabled
    assert any("are linked from another" in line for line in draw("FACEWRIGHT_PT_expressions", linked).said)
    for name, more in (ACTS | {"clear_keyframes": {}}).items():
        assert not getattr(FACE, name).poll()
        with pytest.raises(RuntimeError, match="linked from another file: set them there, or append the head instead"):
            getattr(FACE, name)(**more)
    assert not any(values(linked).values())


def test_a_head_without_shape_keys_says_so(generic_face: bpy.types.Object) -> None:
    generic_face.shape_key_clear()
    select(generic_face)
    with pytest.raises(RuntimeError, match="Face has no shape keys any more: reconstruct this head again"):
        FACE.expression(name="smile")
    assert draw("FACEWRIGHT_PT_keys", generic_face).sliders == []
    draw("FACEWRIGHT_PT_expressions", generic_face)
