"""Heads as assets: linked, appended and instanced from another file, and their small pictures."""

from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import pytest
from listed import OPERATORS, click, duplicate, hashes, listed, used_by
from people import (
    ANNA,
    BEN,
    OLDER_ANNA,
    Clips,
    assert_is,
    collection_of,
    head_of,
    heads,
    reopened,
    run,
    select,
)
from tracking import module


def in_another_file(path: Path, link: bool, instance: bool = False) -> bpy.types.Collection:
    """Save the file there and bring its head into a new one; gives the collection."""
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
    folder, bring = f"{path}/Collection/", bpy.ops.wm.link if link else bpy.ops.wm.append
    bring(filepath=f"{folder}Face", directory=folder, filename="Face", instance_collections=instance)
    return bpy.data.collections["Face"]


def test_a_linked_head_is_listed_and_chosen_but_not_changed_and_the_list_says_so(clips: Clips, tmp_path: Path) -> None:
    run(clips.anna)
    home = in_another_file(tmp_path / "anna.blend", link=True)
    before = hashes()
    (anna,) = (head.skin for head in heads())
    assert anna.library is not None
    assert "Face is linked from anna.blend, which is shown and never changed: to change it, append it" in listed()
    click(anna)
    assert bpy.context.object == anna
    assert bpy.context.scene.facewright_clip.head == "NEW", "a run cannot update it"
    for name in OPERATORS:
        assert not getattr(bpy.ops.facewright, name).poll(), name
        with pytest.raises(RuntimeError, match="linked from anna.blend"):
            getattr(bpy.ops.facewright, name)()
    anna.facewright_title = "Other"
    assert hashes() == before
    ben = run(clips.ben)
    assert_is(ben, BEN)
    assert_is(anna, ANNA)
    assert home.preview is not None, "its small picture comes along"


def test_a_head_of_which_a_part_is_linked_is_not_changed(clips: Clips, tmp_path: Path) -> None:
    run(clips.anna)
    in_another_file(tmp_path / "anna.blend", link=False)
    (anna,) = (head.skin for head in heads())
    tongue = head_of(anna).parts["tongue"]
    with bpy.data.libraries.load(str(tmp_path / "anna.blend"), link=True) as (_, wanted):
        wanted.meshes = [tongue.data.name]
    tongue.data = wanted.meshes[0]
    select(anna)
    before = hashes()
    for name in OPERATORS:
        with pytest.raises(RuntimeError, match="Face is linked from anna.blend"):
            getattr(bpy.ops.facewright, name)()
    assert hashes() == before


@pytest.mark.parametrize("link", [False, True], ids=["appended", "linked"])
def test_an_instance_of_a_head_is_listed_and_said_to_be_one(clips: Clips, tmp_path: Path, link: bool) -> None:
    run(clips.anna)
    in_another_file(tmp_path / "anna.blend", link, instance=True)
    (empty,) = bpy.context.scene.objects
    assert f"{empty.name} is an instance of Face, which is shown and never changed" in listed()
    click(empty)
    assert bpy.context.object == empty
    assert not any(getattr(bpy.ops.facewright, name).poll() for name in OPERATORS)


def test_an_asset_is_appended_whole_into_an_empty_file_and_updated_there(
    clips: Clips, grown: Callable[[], None], tmp_path: Path
) -> None:
    anna = run(clips.anna)
    anna.data.shape_keys.key_blocks["jawOpen"].keyframe_insert("value", frame=5)
    report, keys = anna["facewright_report"], anna.data.shape_keys.key_blocks.keys()
    assert bpy.ops.facewright.mark_head() == {"FINISHED"}
    in_another_file(tmp_path / "anna.blend", link=False)
    (anna,) = (head.skin for head in heads())
    assert not {data for data in used_by(anna) if data.library is not None}, "all of it is this file's"
    assert_is(anna, ANNA)
    assert anna["facewright_report"] == report and anna.data.shape_keys.key_blocks.keys() == keys
    assert anna.data.shape_keys.animation_data.action is not None
    assert bpy.ops.facewright.expression(name="happiness") == {"FINISHED"}
    grown()
    assert run(clips.anna) == anna
    assert_is(anna, OLDER_ANNA)


def small(home: bpy.types.Collection, kind: str = "image") -> np.ndarray:
    """The picture of a collection, (side, side, 4)."""
    side = getattr(home.preview, f"{kind}_size")[0]
    pixels = np.empty(4 * side * side, np.float32)
    getattr(home.preview, f"{kind}_pixels_float").foreach_get(pixels)
    return pixels.reshape(side, side, 4)


def test_an_asset_has_a_picture_of_the_head_that_lasts(clips: Clips, tmp_path: Path) -> None:
    anna = run(clips.anna)
    home = collection_of(anna)
    assert bpy.ops.facewright.mark_head() == {"FINISHED"}
    assert home.asset_data is not None
    for kind, side in (("image", 256), ("icon", 32)):
        shown = small(home, kind)
        assert shown.shape[0] == side
        opaque = shown[..., 3] > 0.5
        assert 0.2 < opaque.mean() < 0.9, "a head before nothing"
        assert not opaque[[0, 0, -1, -1], [0, -1, 0, -1]].any(), "the corners are free"
        assert opaque[side // 2, side // 2]
        assert (shown[opaque][:, 0] > 0.2).mean() > 0.9 and shown[opaque][:, 1].max() < 0.1, "of Anna's red"
    before = small(home)
    reopened(tmp_path / "asset.blend")
    home = bpy.data.collections["Face"]
    assert home.asset_data is not None
    assert np.array_equal(small(home), before)
    select(bpy.data.objects["Face"])
    assert bpy.ops.facewright.mark_head(clear=True) == {"FINISHED"}
    assert home.asset_data is None


def test_every_run_gives_a_head_its_picture_in_the_list(clips: Clips, grown: Callable[[], None]) -> None:
    anna, ben = run(clips.anna), run(clips.ben)
    pictures = [small(collection_of(skin)) for skin in (anna, ben)]
    assert not np.array_equal(pictures[0], pictures[1]), "each its own"
    grown()
    run(clips.anna)
    assert not np.array_equal(small(collection_of(anna)), pictures[0]), "it follows the head"
    assert np.array_equal(small(collection_of(ben)), pictures[1])
    copy = duplicate(ben)
    assert np.array_equal(small(collection_of(copy)), pictures[1]), "a copy looks the same"


def test_a_picture_needs_no_texture_and_no_surface(clips: Clips) -> None:
    anna = run(clips.anna)
    paint = module("scene.portrait").paint
    anna.data.materials.clear()
    del anna["facewright_picture"]
    anna.data.uv_layers.remove(anna.data.uv_layers[0])
    plain = paint(head_of(anna).parts, 64)
    assert (plain[..., 3] > 0.5).mean() > 0.2
    anna.shape_key_clear()
    anna.data.clear_geometry()
    assert not paint({"skin": anna}, 64).any()


def test_the_picture_shows_every_pixel_of_the_skin(clips: Clips) -> None:
    opaque = module("scene.portrait").paint(head_of(run(clips.anna)).parts, 512)[..., 3] > 0.5
    around = opaque[:-2, 1:-1] & opaque[2:, 1:-1] & opaque[1:-1, :-2] & opaque[1:-1, 2:]
    assert not (around & ~opaque[1:-1, 1:-1]).any(), "no holes"
