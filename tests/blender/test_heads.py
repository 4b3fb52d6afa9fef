"""Two people in one scene: a head each, of its own in every respect, whatever an artist does to the objects."""

import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest
from conftest import snapshot
from people import (
    ANNA,
    BEN,
    OLDER_ANNA,
    Clips,
    assert_is,
    collection_of,
    duplicated,
    head_of,
    heads,
    reds,
    reopened,
    result,
    run,
    select,
    size,
)
from tracking import drawn, module


def test_a_second_person_is_a_second_head(clips: Clips) -> None:
    anna = run(clips.anna)
    ben = run(clips.ben)
    assert anna != ben, "objects of its own"
    assert_is(anna, ANNA)
    assert_is(ben, BEN)
    assert len(bpy.data.images) == 4, "a picture of the skin and one of the eyes for each"
    shared = {m for o in head_of(anna).objects for m in o.data.materials} & {
        m for o in head_of(ben).objects for m in o.data.materials
    }
    assert not shared, "materials of its own"


def test_each_head_has_a_collection_of_its_own_named_as_its_skin(clips: Clips) -> None:
    anna, ben = run(clips.anna), run(clips.ben)
    assert [c.name for c in bpy.context.scene.collection.children] == ["Face", "Face.001"]
    for skin in (anna, ben):
        home = collection_of(skin)
        assert home.name == skin.name
        assert set(home.objects) == set(head_of(skin).objects), f"{skin.name}: all of it"
    assert head_of(ben).parts["tongue"].name == "Face.001 tongue", "its parts are named after it"


def test_a_second_head_stands_beside_the_first(clips: Clips) -> None:
    anna, ben = run(clips.anna), run(clips.ben)
    bpy.context.view_layer.update()
    assert anna.matrix_world.is_identity, "the first stands in the middle"
    assert ben.location.x - anna.location.x >= 0.3, "the second does not stand in the first"


def test_a_new_head_goes_into_the_active_collection_but_never_into_that_of_another(clips: Clips) -> None:
    people = bpy.data.collections.new("People")
    bpy.context.scene.collection.children.link(people)
    layer = bpy.context.view_layer
    layer.active_layer_collection = layer.layer_collection.children["People"]
    anna = run(clips.anna)
    assert collection_of(anna) in people.children.values()
    layer.active_layer_collection = layer.layer_collection.children["People"].children["Face"]
    ben = run(clips.ben)
    assert collection_of(ben) in people.children.values()
    assert not collection_of(anna).children, "appended whole, Anna's collection brings no Ben"


def test_a_clip_updates_the_head_that_it_has_made(clips: Clips, grown: Callable[[], None]) -> None:
    anna, ben = run(clips.anna), run(clips.ben)
    grown()
    before = snapshot()
    assert run(clips.anna) == anna
    assert_is(anna, OLDER_ANNA)
    assert_is(ben, BEN)
    assert snapshot() == before, "nothing is left over"


def test_a_frame_of_a_clip_is_the_same_clip_as_its_folder(clips: Clips) -> None:
    anna = run(clips.anna)
    assert run(str(Path(clips.anna) / "frame_00.png")) == anna


def test_the_panel_says_what_the_next_run_will_make_and_takes_another_choice(clips: Clips) -> None:
    settings = bpy.context.scene.facewright_clip
    settings.path = clips.anna
    assert settings.head == "NEW", "in an empty scene"
    anna = run(clips.anna)
    assert settings.head == "Face", "the head that was made"
    settings.path = clips.ben
    assert settings.head == "NEW", "another clip may show another person"
    settings.path = clips.anna
    assert settings.head == "Face", "a clip knows its head"
    twin = run(clips.anna, head="NEW")
    assert twin != anna, "a second head of one clip, where that is wanted"
    assert settings.head == twin.name, "which is updated from then on"
    assert run(clips.anna) == twin
    assert run(clips.anna, head="Face") == anna
    assert_is(run(clips.ben, head="Face"), BEN)
    assert_is(twin, ANNA)


def test_the_panel_says_what_the_button_makes_as_soon_as_there_is_a_choice(clips: Clips) -> None:
    shown: list[str] = []
    layout = SimpleNamespace(
        prop=lambda _data, name, **_more: shown.append(name),
        label=lambda text="", **_more: shown.append(text),
        row=lambda **_more: SimpleNamespace(operator=lambda *_n, **_m: SimpleNamespace(), menu=lambda *_n, **_m: None),
    )
    panel = bpy.types.FACEWRIGHT_PT_clip
    panel.draw(SimpleNamespace(layout=layout), bpy.context)
    assert "New Head" not in shown, "without a head there is no other choice"
    run(clips.anna)
    module("running").Running.said.clear()
    panel.draw(SimpleNamespace(layout=layout), bpy.context)
    assert "Update Face" in shown
    assert "head" not in shown, "it is chosen in the list of heads, and there alone"
    labels = [label for _, label, _ in module("reconstruct.actions").choices(bpy.context.scene)]
    assert labels == ["New Head", "Update Face"]


def test_a_run_makes_what_was_chosen_when_it_began(clips: Clips) -> None:
    settings, actions = bpy.context.scene.facewright_clip, module("reconstruct.actions")
    anna = run(clips.anna)
    path, wanted = settings.path, settings.wanted
    settings.path = clips.ben
    assert actions.place(bpy.context.scene, result(OLDER_ANNA), path, wanted) == anna
    assert_is(anna, OLDER_ANNA)


def test_saved_opened_and_run_again_they_stay_two(clips: Clips, grown: Callable[[], None], tmp_path: Path) -> None:
    anna, ben = (run(clip).name for clip in (clips.anna, clips.ben))
    reopened(tmp_path / "two.blend")
    objects = bpy.data.objects
    assert_is(objects[anna], ANNA)
    assert_is(objects[ben], BEN)
    grown()
    assert run(clips.anna) == objects[anna]
    assert_is(objects[anna], OLDER_ANNA)
    assert_is(objects[ben], BEN)
    reopened(tmp_path / "again.blend")
    assert_is(bpy.data.objects[anna], OLDER_ANNA)
    assert_is(bpy.data.objects[ben], BEN)


def test_a_second_run_keeps_what_the_artist_did_to_either(clips: Clips, grown: Callable[[], None]) -> None:
    anna, ben = run(clips.anna), run(clips.ben)
    for number, skin in enumerate((anna, ben)):
        jaw = skin.data.shape_keys.key_blocks["jawOpen"]
        jaw.value = 0.2 + number / 2
        jaw.keyframe_insert("value", frame=5)
        skin.location.z = 1.0 + number
        shader = next(n for n in skin.data.materials[0].node_tree.nodes if n.type == "BSDF_PRINCIPLED")
        shader.inputs["Roughness"].default_value = 0.3 + number / 10
    grown()
    run(clips.anna)
    for number, skin in enumerate((anna, ben)):
        keys = skin.data.shape_keys
        assert keys.key_blocks["jawOpen"].value == pytest.approx(0.2 + number / 2), f"{skin.name}: values"
        assert keys.animation_data.action is not None, f"{skin.name}: animation"
        assert skin.location.z == 1.0 + number, f"{skin.name}: place"
        shader = next(n for n in skin.data.materials[0].node_tree.nodes if n.type == "BSDF_PRINCIPLED")
        assert shader.inputs["Roughness"].default_value == pytest.approx(0.3 + number / 10), f"{skin.name}: nodes"


def test_everything_may_be_renamed_and_moved_between_collections(clips: Clips, grown: Callable[[], None]) -> None:
    anna, ben = run(clips.anna), run(clips.ben)
    place = bpy.data.collections.new("Props")
    bpy.context.scene.collection.children.link(place)
    tongue = head_of(anna).parts["tongue"]
    collection_of(tongue).objects.unlink(tongue)
    place.objects.link(tongue)
    kinds = (bpy.data.objects, bpy.data.meshes, bpy.data.materials, bpy.data.images, bpy.data.collections)
    for number, data in enumerate([data for kind in kinds for data in kind]):
        data.name = f"Thing {number}"
    # Names that Anna's had are Ben's now.
    ben.name, reds_of_ben = "Face", reds(ben)
    grown()
    before = snapshot()
    assert run(clips.anna) == anna
    assert snapshot() == before, "nothing new was made for want of a name"
    assert head_of(anna).parts["tongue"] == tongue, "it is hers wherever it is"
    assert collection_of(tongue) == place, "and stays where it was put"
    assert_is(anna, OLDER_ANNA)
    assert reds(ben) == reds_of_ben
    assert_is(ben, BEN)


def test_a_part_below_a_rig_is_still_its_heads(clips: Clips, grown: Callable[[], None]) -> None:
    anna = run(clips.anna)
    eye = head_of(anna).parts["eye_left"]
    rig = bpy.data.objects.new("Rig", None)
    bpy.context.scene.collection.objects.link(rig)
    eye.parent = anna.parent = rig
    run(clips.ben)
    grown()
    assert run(clips.anna) == anna
    assert head_of(anna).parts["eye_left"] == eye
    assert eye.parent == rig, "the artist's parent stays"
    assert_is(anna, OLDER_ANNA)


def test_a_head_deleted_by_hand_comes_back_alone(clips: Clips) -> None:
    anna, ben = run(clips.anna), run(clips.ben)
    run(clips.anna)
    home = collection_of(anna)
    select(*head_of(anna).objects)
    assert bpy.ops.object.delete() == {"FINISHED"}
    assert "Face" not in bpy.data.objects, "nothing holds what was deleted"
    anna = run(clips.anna)
    assert collection_of(anna) == home, "it comes back to its collection"
    assert [c.name for c in bpy.context.scene.collection.children] == ["Face", "Face.001"]
    assert_is(anna, ANNA)
    assert_is(ben, BEN)


def test_deleted_with_its_collection_it_is_a_new_head(clips: Clips) -> None:
    anna, ben = run(clips.anna), run(clips.ben)
    home = collection_of(anna)
    for obj in head_of(anna).objects:
        bpy.data.objects.remove(obj)
    bpy.data.collections.remove(home)
    assert_is(run(clips.anna), ANNA)
    assert_is(ben, BEN)
    assert len(heads()) == 2


def test_a_deleted_eye_comes_back_with_the_material_of_the_other(clips: Clips) -> None:
    anna = run(clips.anna)
    run(clips.ben)
    material = head_of(anna).parts["eye_right"].data.materials[0]
    bpy.data.objects.remove(head_of(anna).parts["eye_left"])
    run(clips.anna)
    eye = head_of(anna).parts["eye_left"]
    assert list(eye.data.materials) == [material]
    assert eye.parent == anna, "it hangs below its skin"
    assert collection_of(eye) == collection_of(anna), "in the head's collection"
    assert_is(anna, ANNA)


def test_a_skin_of_another_mesh_is_left_to_the_artist(clips: Clips, grown: Callable[[], None]) -> None:
    own, ben = run(clips.anna), run(clips.ben)
    worn, shown = own.data.materials[0], reds(own)
    own.shape_key_clear()
    own.data.clear_geometry()
    own.data.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    grown()
    skin = run(clips.anna, head="Face")
    assert skin != own, "its keys would not fit"
    assert len(own.data.vertices) == 3, "the artist's mesh stays"
    assert len(heads()) == 2, "but is no head any more"
    assert skin.data.materials[0] == worn, "the new one has its material"
    assert shown != reds(skin), "with the new picture"
    assert_is(skin, OLDER_ANNA)
    assert_is(ben, BEN)


def test_expressions_and_report_are_those_of_the_active_objects_head(clips: Clips) -> None:
    anna, ben = run(clips.anna), run(clips.ben)
    for skin, other in ((anna, ben), (ben, anna)):
        select(head_of(skin).parts["tongue"])
        assert bpy.ops.facewright.expression(name="happiness") == {"FINISHED"}
        smile, others = (s.data.shape_keys.key_blocks["mouthSmileLeft"] for s in (skin, other))
        assert smile.value > 0.5, f"{skin.name} smiles"
        assert others.value == 0.0, f"{other.name} does not"
        smile.value = 0.0
        assert skin.name in drawn("FACEWRIGHT_PT_report", object=skin).split(), "the panel says whose the report is"
    assert "This is Anna" in drawn("FACEWRIGHT_PT_report", object=anna)
    assert "This is Ben" in drawn("FACEWRIGHT_PT_report", object=ben)


def test_the_report_counts_frames_by_the_kind_of_their_reason(clips: Clips) -> None:
    anna = run(clips.anna)
    told = json.loads(anna["facewright_report"])
    frame = {"used": False, "reason_kind": "blurred", "cam_from_head": None, "reprojection_rms_px": None}
    sentences = ("12 % as sharp as the others", "its sharpness is 30 % of what is usual")
    frames = [frame | {"name": str(k), "reason": sentence} for k, sentence in enumerate(sentences)]
    anna["facewright_report"] = json.dumps(told | {"frames": frames})
    assert "Made from 0 frames, 0 points 2 frames left out: blurred Skin: 0 %" in drawn(
        "FACEWRIGHT_PT_report", object=anna
    )


def test_the_report_says_in_one_line_what_is_unusual(clips: Clips) -> None:
    anna = run(clips.anna)
    told = json.loads(anna["facewright_report"])
    measures = [
        {"name": name, "value": value, "unit": "mm", "usual": [0.0, 9.0], "possible": [None, None], "sentence": name}
        for name, value in (("head_breadth", 5.0), ("ear_displacement", 12.0))
    ]
    anna["facewright_report"] = json.dumps(told | {"quality": {"verdict": "warned", "measures": measures}})
    assert "Look at it: ear displacement" in drawn("FACEWRIGHT_PT_report", object=anna)
    anna["facewright_report"] = json.dumps(told | {"quality": {"verdict": "good", "measures": measures[:1]}})
    assert "Good: every measure is as usual" in drawn("FACEWRIGHT_PT_report", object=anna)


def test_without_an_active_object_they_are_the_last_heads_that_was_made(clips: Clips) -> None:
    anna, ben = run(clips.anna), run(clips.ben)
    run(clips.anna)
    bpy.context.view_layer.objects.active = None
    assert bpy.ops.facewright.expression(name="happiness") == {"FINISHED"}
    assert anna.data.shape_keys.key_blocks["mouthSmileLeft"].value > 0.5
    assert ben.data.shape_keys.key_blocks["mouthSmileLeft"].value == 0.0


def test_a_head_in_a_collection_that_the_view_layer_leaves_out_is_updated_all_the_same(
    clips: Clips, grown: Callable[[], None]
) -> None:
    anna = run(clips.anna)
    bpy.context.view_layer.layer_collection.children["Face"].exclude = True
    grown()
    bpy.context.scene.facewright_clip.path = clips.anna
    assert bpy.ops.facewright.reconstruct() == {"FINISHED"}
    assert size(anna) == pytest.approx(OLDER_ANNA.size, abs=1e-3)


def test_one_undo_step_takes_a_second_head_and_its_collection(clips: Clips) -> None:
    run(clips.anna)
    bpy.context.scene.facewright_clip.path = clips.ben
    bpy.ops.ed.undo_push(message="Before")
    before = snapshot()
    bpy.ops.facewright.reconstruct("EXEC_DEFAULT", True)
    assert snapshot() != before
    bpy.ops.ed.undo()
    assert snapshot() == before
    assert bpy.context.scene.facewright_clip.head == "NEW"
    assert_is(bpy.data.objects["Face"], ANNA)


def test_a_failed_run_makes_no_collection_and_no_mark(clips: Clips, tmp_path: Path) -> None:
    anna = run(clips.anna)
    copy = duplicated(*head_of(anna).objects)["skin"]
    (tmp_path / "empty").mkdir()
    bpy.context.scene.facewright_clip.path = str(tmp_path / "empty")
    before, key = snapshot(), copy["facewright_head"]
    with pytest.raises(RuntimeError, match="holds no frames"):
        bpy.ops.facewright.reconstruct()
    assert snapshot() == before
    assert copy["facewright_head"] == key


def test_where_capitals_are_small_letters_a_clip_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    same_clip = module("scene.heads").same_clip
    assert not same_clip("/films/Anna.mp4", "/films/anna.MP4")
    monkeypatch.setattr("os.path.normcase", str.lower)
    assert same_clip("/films/Anna.mp4", "/films/anna.MP4")
