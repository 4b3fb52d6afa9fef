"""What an artist did to a head stays when a run makes it anew: sculpting, own keys, painting; and is said."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from numpy.typing import NDArray
from people import ANNA, BEN, OLDER_ANNA, Clips, clip_of, evaluated, head_of, library, module, reds, run, size

DIMPLE = np.array([0.0, 0.004, 0.0], np.float32)
FEW = slice(100, 140)


@pytest.fixture
def clips(tmp_path: Path, monkeypatch: Any) -> Clips:
    library(monkeypatch)
    return Clips(anna=clip_of(tmp_path, ANNA), ben=clip_of(tmp_path, BEN))


@pytest.fixture
def grown(monkeypatch: Any) -> Callable[[], None]:
    """From now on Anna is older."""
    return lambda: library(monkeypatch, (OLDER_ANNA, BEN))


def block(skin: bpy.types.Object, name: str) -> bpy.types.ShapeKey:
    return skin.data.shape_keys.key_blocks[name]


def places(key: bpy.types.ShapeKey) -> NDArray[np.float32]:
    """(n, 3) vertices of a key."""
    found = np.empty(3 * len(key.data), np.float32)
    key.data.foreach_get("co", found)
    return found.reshape(-1, 3)


def move(key: bpy.types.ShapeKey, by: NDArray[np.float32]) -> None:
    """As sculpting does it: some vertices."""
    moved = places(key)
    moved[FEW] += by
    key.data.foreach_set("co", moved.ravel())


def kept(skin: bpy.types.Object) -> list[str]:
    return module("scene.head").kept(skin)


def paint(picture: bpy.types.Image) -> None:
    pixels = np.zeros((picture.size[1], picture.size[0], 4), np.float32)
    pixels[..., 1:] = 1.0
    picture.pixels.foreach_set(pixels.ravel())
    picture.update()
    picture.pack()


def test_nothing_is_kept_of_a_head_that_nobody_touched(clips: Clips, grown: Callable[[], None]) -> None:
    anna = run(clips.anna)
    grown()
    run(clips.anna)
    assert kept(anna) == []
    assert size(anna) == pytest.approx(OLDER_ANNA.size, abs=1e-3)


def test_sculpting_stays_on_the_new_shape_and_on_every_key(clips: Clips, grown: Callable[[], None]) -> None:
    anna = run(clips.anna)
    for key in anna.data.shape_keys.key_blocks:
        move(key, DIMPLE)
    grown()
    plain = module("scene.axes").to_blender(people_positions(anna))
    run(clips.anna)
    expected = plain.copy()
    expected[FEW] += DIMPLE
    assert np.abs(places(block(anna, "Basis")) - expected).max() < 1e-6
    opened = places(block(anna, "jawOpen")) - places(block(anna, "Basis"))
    assert np.abs(opened[:, 2]).max() > 0.01, "the keys are the new ones, on the sculpted shape"
    assert kept(anna) == [f"the sculpting of 40 vertices of {anna.name}"]
    again = places(block(anna, "Basis"))
    run(clips.anna)
    assert np.abs(places(block(anna, "Basis")) - again).max() < 1e-6, "a third run adds it once"


def people_positions(skin: bpy.types.Object) -> NDArray[np.float32]:
    """The vertices that a run makes of the older Anna's skin, in the head frame."""
    generic = module("engine").generic_head()
    first, end = next(vertices for name, vertices, _ in generic.parts if name == "skin")
    assert end - first == len(skin.data.vertices)
    return (generic.positions[first:end] * OLDER_ANNA.size).astype(np.float32)


def test_a_key_that_an_artist_sculpted_keeps_its_offsets_and_the_others_are_new(
    clips: Clips, grown: Callable[[], None]
) -> None:
    anna = run(clips.anna)
    before = {name: places(block(anna, name)) for name in ("Basis", "jawOpen", "mouthSmileLeft")}
    move(block(anna, "mouthSmileLeft"), DIMPLE)
    smile = before["mouthSmileLeft"] - before["Basis"]
    smile[FEW] += DIMPLE
    grown()
    run(clips.anna)
    basis = places(block(anna, "Basis"))
    assert np.abs(places(block(anna, "mouthSmileLeft")) - basis - smile).max() < 1e-6
    old = before["jawOpen"] - before["Basis"]
    ratio = OLDER_ANNA.size / ANNA.size
    assert np.abs(places(block(anna, "jawOpen")) - basis - ratio * old).max() < 1e-6
    assert kept(anna) == [f"the shape of mouthSmileLeft of {anna.name}"]
    run(clips.anna)
    assert np.abs(places(block(anna, "mouthSmileLeft")) - basis - smile).max() < 1e-6, "and still after a third run"


def test_an_artists_own_key_goes_with_the_key_that_it_is_relative_to(clips: Clips, grown: Callable[[], None]) -> None:
    anna = run(clips.anna)
    scar, wide = anna.shape_key_add(name="Scar", from_mix=False), anna.shape_key_add(name="Wide", from_mix=False)
    move(scar, DIMPLE)
    wide.relative_key = block(anna, "jawOpen")
    wide.data.foreach_set("co", (places(block(anna, "jawOpen")) + DIMPLE).ravel())
    grown()
    run(clips.anna)
    added = places(block(anna, "Scar")) - places(block(anna, "Basis"))
    assert np.abs(added[FEW] - DIMPLE).max() < 1e-6
    added[FEW] = 0.0
    assert np.abs(added).max() < 1e-6
    assert np.abs(places(block(anna, "Wide")) - places(block(anna, "jawOpen")) - DIMPLE).max() < 1e-6
    assert kept(anna) == [], "it is not ours to change, so nothing needs saying"


def test_a_painted_picture_stays_shown_and_the_new_one_is_there(clips: Clips, grown: Callable[[], None]) -> None:
    anna = run(clips.anna)
    skin = head_of(anna).parts["skin"]["facewright_picture"]
    paint(skin)
    grown()
    run(clips.anna)
    assert skin in bpy.data.images.values()
    assert reds(anna) == {0, OLDER_ANNA.red}, "the painted skin, and the new eyes"
    (said,) = kept(anna)
    new = head_of(anna).parts["skin"]["facewright_picture"]
    assert said == f"the painting on {skin.name} (the new picture is {new.name})"
    run(clips.anna)
    assert reds(anna) == {0, OLDER_ANNA.red}
    assert len(bpy.data.images) == 3, "unpainted pictures are replaced, not heaped up"


def test_a_picture_without_pixels_is_no_painting(clips: Clips) -> None:
    anna = run(clips.anna)
    skin = head_of(anna).parts["skin"]["facewright_picture"]
    skin.unpack(method="REMOVE")
    skin.source, skin.filepath = "FILE", "//lost.png"
    skin.reload()
    assert len(skin.pixels) == 0
    run(clips.anna)
    assert reds(anna) == {ANNA.red} and kept(anna) == []


def test_what_is_set_on_a_picture_is_set_on_the_one_that_follows_it(clips: Clips, grown: Callable[[], None]) -> None:
    anna = run(clips.anna)
    old = head_of(anna).parts["skin"]["facewright_picture"]
    old.colorspace_settings.name = "Non-Color"
    name, wall = old.name, bpy.data.textures.new("Wall", "IMAGE")
    wall.image = old
    grown()
    run(clips.anna)
    new = head_of(anna).parts["skin"]["facewright_picture"]
    assert (new.name, new.colorspace_settings.name) == (name, "Non-Color")
    assert wall.image == new, "an artist's other use of it shows the new one too"
    assert len(bpy.data.images) == 2


def test_the_message_says_what_was_kept(clips: Clips, grown: Callable[[], None], capfd: Any) -> None:
    anna = run(clips.anna)
    move(block(anna, "mouthSmileLeft"), DIMPLE)
    grown()
    run(clips.anna)
    assert f"kept: the shape of mouthSmileLeft of {anna.name}" in capfd.readouterr().out


def test_a_head_of_a_version_that_remembered_nothing_gets_the_new_shape(
    clips: Clips, grown: Callable[[], None]
) -> None:
    anna = run(clips.anna)
    for obj in head_of(anna).objects:
        obj.data.attributes.remove(obj.data.attributes["made_position"])
        del obj.data["facewright_keys"]
    for picture in bpy.data.images:
        del picture["facewright_made"]
    move(block(anna, "mouthSmileLeft"), DIMPLE)
    grown()
    run(clips.anna)
    assert kept(anna) == []
    assert size(anna) == pytest.approx(OLDER_ANNA.size, abs=1e-3)
    assert reds(anna) == {OLDER_ANNA.red}
    assert np.isfinite(evaluated(anna)).all()
    assert json.loads(anna.data["facewright_keys"]), "the next run will know"


def test_a_renamed_key_is_made_anew_under_its_new_name_and_its_parts_still_follow(
    clips: Clips, grown: Callable[[], None]
) -> None:
    anna = run(clips.anna)
    block(anna, "jawOpen").keyframe_insert("value", frame=5)
    count = len(anna.data.shape_keys.key_blocks)
    block(anna, "Basis").name, block(anna, "jawOpen").name = "Rest", "Mouth Wide"
    before = places(block(anna, "Mouth Wide")) - places(block(anna, "Rest"))
    for _ in range(2):
        grown()
        run(clips.anna)
        names = [key.name for key in anna.data.shape_keys.key_blocks]
        assert names[0] == "Rest" and "Mouth Wide" in names and len(names) == count, "no key is made twice"
        after = places(block(anna, "Mouth Wide")) - places(block(anna, "Rest"))
        assert np.abs(after - before * OLDER_ANNA.size / ANNA.size).max() < 1e-6, "it is the new one"
    teeth = head_of(anna).parts["teeth_lower"]
    rest = evaluated(teeth)
    block(anna, "Mouth Wide").value = 1.0
    assert (rest - evaluated(teeth))[:, 2].mean() > 0.004, "the teeth follow it"
    (curve,) = module("scene.pose_keys").curves(anna.data.shape_keys)
    assert "Mouth Wide" in curve.data_path


def test_a_shape_at_rest_that_was_deleted_is_the_first_key_again(clips: Clips, grown: Callable[[], None]) -> None:
    anna = run(clips.anna)
    anna.shape_key_add(name="Scar", from_mix=False).value = 0.0
    move(block(anna, "Scar"), DIMPLE)
    block(anna, "eyeBlinkLeft").keyframe_insert("value", frame=5)
    anna.active_shape_key_index = 0
    assert bpy.ops.object.shape_key_remove() == {"FINISHED"}
    grown()
    run(clips.anna)
    keys = anna.data.shape_keys
    (curve,) = module("scene.pose_keys").curves(keys)
    assert curve.data_path == block(anna, "eyeBlinkLeft").path_from_id("value"), "the key that came first is animated"
    assert keys.reference_key.name == "Basis"
    assert all(key.relative_key == keys.reference_key for key in keys.key_blocks)
    assert size(anna) == pytest.approx(OLDER_ANNA.size, abs=1e-3)
    assert np.abs(evaluated(anna) - places(keys.reference_key)).max() < 1e-6
    assert kept(anna) == []


def test_an_own_key_of_a_part_is_not_driven(clips: Clips) -> None:
    anna = run(clips.anna)
    tongue = head_of(anna).parts["tongue"]
    tongue.shape_key_add(name="Scar", from_mix=False)
    run(clips.anna)
    block(tongue, "Scar").value = 0.5
    assert "Scar" not in module("scene.keys").driven(tongue)
    evaluated(tongue)
    assert block(tongue, "Scar").value == 0.5


def test_a_deleted_material_comes_back_into_its_slot(clips: Clips, grown: Callable[[], None]) -> None:
    anna = run(clips.anna)
    for worn in list(bpy.data.materials):
        bpy.data.materials.remove(worn)
    grown()
    run(clips.anna)
    assert all(len(obj.material_slots) == 1 for obj in head_of(anna).objects)
    assert reds(anna) == {OLDER_ANNA.red}
