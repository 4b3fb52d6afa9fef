"""The list of heads: chosen, named, copied, removed; each in one step that undo takes back."""

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
import pytest
from conftest import snapshot
from listed import OPERATORS, assert_is_one_step, click, duplicate, listed, remove, row, used_by
from people import (
    ANNA,
    BEN,
    OLDER_ANNA,
    Clips,
    assert_is,
    collection_of,
    duplicated,
    evaluated,
    head_of,
    heads,
    opened,
    reds,
    run,
    select,
    size,
)
from test_heads_copied import made_by_an_older_version
from tracking import module


def test_the_list_has_every_head_and_nothing_else_and_marks_the_one_worked_on(clips: Clips) -> None:
    assert not bpy.types.FACEWRIGHT_PT_heads.poll(bpy.context), "without a head there is no list"
    anna, ben = run(clips.anna), run(clips.ben)
    cube = bpy.data.objects.new("Cube", bpy.data.meshes.new("Cube"))
    bpy.context.scene.collection.objects.link(cube)
    assert bpy.types.FACEWRIGHT_PT_heads.poll(bpy.context)
    assert [row.obj for row in module("heads.actions").listed(bpy.context.scene).rows] == [anna, ben]
    chosen = bpy.context.scene.facewright_heads
    assert chosen.index == row(ben), "the one that was made last"
    select(head_of(anna).parts["tongue"])
    assert chosen.index == row(anna), "the active object's"
    select(cube)
    assert chosen.index == row(ben), "of an object that is no head's, the last one made"


def test_a_click_makes_a_head_active_and_the_one_that_the_next_run_updates(
    clips: Clips, grown: Callable[[], None]
) -> None:
    anna, ben = run(clips.anna), run(clips.ben)
    click(anna)
    assert bpy.context.object == anna and bpy.context.selected_objects == [anna]
    assert bpy.context.scene.facewright_clip.head == anna.name
    grown()
    bpy.context.scene.facewright_clip.path = clips.anna
    assert bpy.ops.facewright.reconstruct() == {"FINISHED"}
    assert_is(anna, OLDER_ANNA)
    assert_is(ben, BEN)


def test_a_click_on_an_object_that_is_no_head_chooses_nothing(clips: Clips) -> None:
    anna = run(clips.anna)
    click(head_of(anna).parts["tongue"])
    assert bpy.context.object == anna


def test_in_edit_mode_the_active_object_stays(clips: Clips) -> None:
    anna, ben = run(clips.anna), run(clips.ben)
    bpy.ops.object.mode_set(mode="EDIT")
    click(anna)
    assert bpy.context.object == ben and ben.mode == "EDIT"
    assert not any(getattr(bpy.ops.facewright, name).poll() for name in OPERATORS)


def test_a_head_that_the_view_layer_leaves_out_can_be_chosen(clips: Clips) -> None:
    anna, ben = run(clips.anna), run(clips.ben)
    bpy.context.view_layer.layer_collection.children[collection_of(anna).name].exclude = True
    # Blender 4.5 crashes when objects are gone through before it knows of this.
    bpy.context.view_layer.update()
    select(ben)
    click(anna)
    assert bpy.context.scene.facewright_heads.index == row(anna)
    assert bpy.context.scene.facewright_clip.head == anna.name


def test_the_plus_lets_the_next_run_make_a_new_head(clips: Clips) -> None:
    anna = run(clips.anna)
    assert bpy.ops.facewright.choose_head() == {"FINISHED"}
    assert bpy.context.scene.facewright_clip.head == "NEW"
    assert bpy.ops.facewright.reconstruct() == {"FINISHED"}
    assert bpy.context.object != anna
    assert_is(anna, ANNA)
    assert_is(bpy.context.object, ANNA)
    assert bpy.context.scene.facewright_clip.head == bpy.context.object.name, "which is updated from then on"


def test_a_head_whose_skin_was_deleted_is_made_anew_from_the_list(clips: Clips) -> None:
    anna, ben = run(clips.anna), run(clips.ben)
    key, home = anna["facewright_head"], collection_of(anna)
    select(*head_of(anna).objects)
    bpy.ops.object.delete()
    assert f"{home.name}: no skin" in listed()
    assert bpy.ops.facewright.choose_head(head=key) == {"FINISHED"}
    bpy.context.scene.facewright_clip.path = clips.anna
    assert bpy.ops.facewright.reconstruct() == {"FINISHED"}
    assert collection_of(bpy.context.object) == home
    assert_is(bpy.context.object, ANNA)
    assert_is(ben, BEN)


def test_a_new_name_is_that_of_collection_objects_meshes_materials_and_pictures(clips: Clips) -> None:
    anna, ben = run(clips.anna), run(clips.ben)
    anna.data.shape_keys.key_blocks["jawOpen"].keyframe_insert("value", frame=5)
    own = anna.data.materials[0].copy()
    own.name = "Make-up"
    head_of(anna).parts["tongue"].data.materials[0] = own
    theirs = {data: data.name for data in used_by(ben)}
    anna.facewright_title = " Anna "
    assert anna.facewright_title == "Anna"
    names = {data.name for data in used_by(anna) if not isinstance(data, (bpy.types.Key, bpy.types.Action))}
    assert "Make-up" in names, "what the artist named keeps its name"
    assert all(name == "Anna" or name.startswith("Anna ") for name in names - {"Make-up"}), names
    assert collection_of(anna).name == anna.data.name == "Anna"
    assert {data: data.name for data in used_by(ben)} == theirs
    assert_is(anna, ANNA)
    assert run(clips.anna) == anna, "it is known by its key"


def test_a_name_that_is_taken_is_made_another_one(clips: Clips) -> None:
    anna, ben = run(clips.anna), run(clips.ben)
    anna.facewright_title = ben.facewright_title = "Star"
    assert (anna.name, ben.name) == ("Star", "Star.001")
    assert head_of(ben).parts["tongue"].name == "Star.001 tongue"
    assert collection_of(ben).name == "Star.001"
    ben.facewright_title = "  "
    assert ben.name == "Star.001", "a name of blanks is none"


def test_a_copy_that_is_renamed_leaves_its_originals_names(clips: Clips) -> None:
    anna = run(clips.anna)
    theirs = {data: data.name for data in used_by(anna)}
    copy = duplicated(*head_of(anna).objects)["skin"]
    copy.facewright_title = "Copy"
    assert {data: data.name for data in used_by(anna)} == theirs
    assert collection_of(copy).name == "Copy", "it gets a collection of its own"
    assert collection_of(anna).name == "Face"


def test_a_duplicate_is_whole_and_shares_nothing(clips: Clips, grown: Callable[[], None]) -> None:
    anna = run(clips.anna)
    copy = duplicate(anna)
    assert copy != anna and bpy.context.selected_objects == [copy]
    assert not used_by(anna) & used_by(copy)
    assert_is(copy, ANNA)
    assert_is(anna, ANNA)
    assert bpy.context.scene.facewright_clip.head == copy.name == "Face.001"
    assert {obj.name for obj in head_of(copy).objects} == {
        obj.name.replace("Face", "Face.001") for obj in head_of(anna).objects
    }
    assert collection_of(copy) in bpy.context.scene.collection.children.values()
    grown()
    assert run(clips.anna) == copy
    assert_is(copy, OLDER_ANNA)
    assert_is(anna, ANNA)


def test_a_duplicate_stands_beside_its_original_turned_and_large_as_that(clips: Clips) -> None:
    anna = run(clips.anna)
    anna.location, anna.rotation_euler, anna.scale = (0.1, 0.2, 0.3), (0.0, 0.0, 0.7), (1.1, 1.1, 1.1)
    copy = duplicate(anna)
    bpy.context.view_layer.update()
    assert copy.matrix_world.translation.x - anna.matrix_world.translation.x >= 0.3
    assert copy.rotation_euler.z == pytest.approx(0.7) and copy.scale.x == pytest.approx(1.1)
    tongues = [head_of(skin).parts["tongue"].matrix_world.translation - skin.location for skin in (anna, copy)]
    assert (tongues[0] - tongues[1]).length < 1e-6, "its parts are with it"


def test_a_duplicates_keyframes_are_copies_in_actions_of_their_own(clips: Clips) -> None:
    anna = run(clips.anna)
    jaw = anna.data.shape_keys.key_blocks["jawOpen"]
    for frame, value in ((1, 0.0), (11, 0.8)):
        jaw.value = value
        jaw.keyframe_insert("value", frame=frame)
    anna.keyframe_insert("rotation_euler", frame=1)
    strip = anna.data.shape_keys.animation_data.nla_tracks.new().strips.new("Talk", 20, bpy.data.actions[0])
    copy = duplicate(anna)
    mine, theirs = (skin.data.shape_keys.animation_data for skin in (copy, anna))
    assert mine.action not in (None, theirs.action)
    assert copy.animation_data.action not in (None, anna.animation_data.action)
    assert mine.nla_tracks[0].strips[0].action not in (None, strip.action)
    for point in module("scene.pose_keys").curves(copy.data.shape_keys)[0].keyframe_points:
        point.co.y = 0.0
    bpy.context.scene.frame_set(11)
    assert jaw.value == pytest.approx(0.8), "the original's keyframes are as they were"
    assert copy.data.shape_keys.key_blocks["jawOpen"].value == pytest.approx(0.0)


def test_what_an_artist_added_to_the_collection_is_copied_and_uses_the_copy(clips: Clips) -> None:
    anna = run(clips.anna)
    home, scene = collection_of(anna), bpy.context.scene
    props = bpy.data.collections.new("Props")
    home.children.link(props)
    glasses = bpy.data.objects.new("Face glasses", bpy.data.meshes.new("Glasses"))
    props.objects.link(glasses)
    glasses.parent = anna
    lamp = bpy.data.objects.new("Lamp", None)
    home.objects.link(lamp)
    lamp.constraints.new("TRACK_TO").target = anna
    outside = bpy.data.objects.new("Outside", None)
    scene.collection.objects.link(outside)
    wrap = anna.modifiers.new("Wrap", "SHRINKWRAP")
    wrap.target = glasses
    anna.constraints.new("CHILD_OF").target = outside
    copy = duplicate(anna)
    theirs = {obj.name: obj for obj in collection_of(copy).all_objects}
    copied = theirs["Face.001 glasses"]
    assert copied.parent == copy and copied.data != glasses.data
    assert copied not in collection_of(copy).objects.values(), "it is in a collection within, as the original's"
    assert theirs["Lamp.001"].constraints[0].target == copy
    assert copy.modifiers["Wrap"].target == copied
    assert copy.constraints[0].target == outside, "what is not of the head stays the same"


def led_by_bones(skin: bpy.types.Object) -> bpy.types.Object:
    """An armature that was made for a head: its skin and keys use it, and its bones are drawn as an object."""
    bones = bpy.data.objects.new(f"{skin.name} Controls", bpy.data.armatures.new(f"{skin.name} Controls"))
    collection_of(skin).objects.link(bones)
    select(bones)
    bpy.ops.object.mode_set(mode="EDIT")
    bones.data.edit_bones.new("Jaw").tail = (0.0, 0.0, 0.1)
    bpy.ops.object.mode_set(mode="OBJECT")
    bones.pose.bones["Jaw"].custom_shape = bpy.data.objects.new("Handle", bpy.data.meshes.new("Handle"))
    bones.parent, bones["facewright_led"], skin["facewright_controls"] = skin, skin, bones
    target = skin.data.shape_keys.key_blocks["jawOpen"].driver_add("value").driver.variables.new()
    target.type = "TRANSFORMS"
    read = target.targets[0]
    read.id, read.bone_target, read.transform_type, read.transform_space = bones, "Jaw", "LOC_Y", "LOCAL_SPACE"
    skin.data.shape_keys.animation_data.drivers[0].driver.type = "SUM"
    bones.pose.bones["Jaw"].keyframe_insert("location", frame=1)
    return bones


def test_bones_that_lead_a_head_are_copied_with_it_and_lead_the_copy(clips: Clips) -> None:
    anna = run(clips.anna)
    bones = led_by_bones(anna)
    copy = duplicate(anna)
    theirs = copy["facewright_controls"]
    assert theirs not in (None, bones) and theirs["facewright_led"] == copy and theirs.parent == copy
    assert theirs.name == theirs.data.name == "Face.001 Controls"
    assert theirs.animation_data.action != bones.animation_data.action
    theirs.animation_data_clear()
    theirs.pose.bones["Jaw"].location.y = 1.0
    teeth = [head_of(skin).parts["teeth_lower"] for skin in (anna, copy)]
    moved = [float((evaluated(obj) - rest(obj))[:, 2].mean()) for obj in teeth]
    assert moved[0] == pytest.approx(0.0, abs=1e-6) and moved[1] < -0.003


def rest(obj: bpy.types.Object) -> np.ndarray:
    """(n, 3) vertices without keys."""
    places = np.empty(3 * len(obj.data.vertices), np.float32)
    obj.data.vertices.foreach_get("co", places)
    return places.reshape(-1, 3)


def test_bones_that_lead_a_head_are_renamed_and_go_with_it(clips: Clips) -> None:
    run(clips.ben)
    before = snapshot() | {"armatures": len(bpy.data.armatures)}
    anna = run(clips.anna)
    bones = led_by_bones(anna)
    anna.facewright_title = "Anna"
    assert bones.name == bones.data.name == "Anna Controls"
    remove(anna)
    assert snapshot() | {"armatures": len(bpy.data.armatures)} == before


def test_painting_that_is_not_saved_is_in_the_duplicate(clips: Clips) -> None:
    anna = run(clips.anna)
    picture = anna["facewright_picture"]
    pixels = np.zeros(len(picture.pixels), np.float32)
    pixels[0::4], pixels[3::4] = 0.2, 1.0
    picture.pixels.foreach_set(pixels)
    assert picture.is_dirty
    copy = duplicate(anna)
    assert reds(copy) == {51, ANNA.red}, "the painted skin, and the eyes"
    assert module("scene.materials").is_painted(copy["facewright_picture"]), "a run keeps it"


def test_a_duplicate_of_a_duplicate_and_of_a_copy_by_hand_are_heads_of_their_own(clips: Clips) -> None:
    anna = run(clips.anna)
    copies = [duplicate(duplicate(anna)), duplicate(duplicated(*head_of(anna).objects)["skin"])]
    for copy in copies:
        assert_is(copy, ANNA)
        assert not used_by(anna) & used_by(copy)
    keys = [head.key for head in heads()]
    assert len(keys) == 5 and len(set(keys)) == 4, "only the one by hand has its original's key"


def test_a_removed_head_leaves_nothing(clips: Clips) -> None:
    ben = run(clips.ben)
    before = snapshot()
    anna = run(clips.anna)
    anna.data.shape_keys.key_blocks["jawOpen"].keyframe_insert("value", frame=5)
    remove(anna)
    assert snapshot() == before
    assert [head.skin for head in heads()] == [ben]
    assert_is(ben, BEN)
    assert bpy.context.scene.facewright_clip.head == "NEW", "its clip is forgotten"


def test_what_an_artist_added_stays_where_it_is_when_a_head_is_removed(clips: Clips, capfd: Any) -> None:
    anna = run(clips.anna)
    home = collection_of(anna)
    anna.location.z = 2.0
    hat = bpy.data.objects.new("Hat", None)
    home.objects.link(hat)
    hat.parent, hat.location = anna, (0.0, 0.0, 0.5)
    bpy.context.view_layer.update()
    select(anna)
    bpy.ops.facewright.mark_head()
    remove(anna)
    bpy.context.view_layer.update()
    assert hat.parent is None and hat.matrix_world.translation.z == pytest.approx(2.5)
    assert list(home.objects) == [hat] and home.asset_data is None
    assert not heads(), "the collection is the artist's now"
    assert f"this stays: the collection {home.name} with Hat" in capfd.readouterr().out


def test_what_others_use_stays_when_a_head_is_removed_and_is_said(clips: Clips, capfd: Any) -> None:
    anna = run(clips.anna)
    worn = anna.data.materials[0]
    copies = duplicated(*head_of(anna).objects)
    remove(anna)
    assert [head.skin for head in heads()] == [copies["skin"]]
    assert_is(copies["skin"], ANNA)
    assert collection_of(copies["skin"])["facewright_head"] == copies["skin"]["facewright_head"]
    assert worn in bpy.data.materials.values()
    assert "(used elsewhere)" in capfd.readouterr().out


def test_what_has_a_fake_user_stays_when_a_head_is_removed(clips: Clips, capfd: Any) -> None:
    anna = run(clips.anna)
    anna.data.materials[0].use_fake_user = True
    remove(anna)
    assert [material.name for material in bpy.data.materials] == ["Face skin"]
    assert "Face skin (with a fake user)" in capfd.readouterr().out


def test_a_head_in_two_scenes_is_removed_from_both_and_that_is_said(clips: Clips, capfd: Any) -> None:
    anna = run(clips.anna)
    bpy.data.scenes.new("Other").collection.children.link(collection_of(anna))
    before = snapshot()["collections"]
    remove(anna)
    assert snapshot()["objects"] == 0 and snapshot()["collections"] == before - 1
    assert "Face removed, from Other too" in capfd.readouterr().out


def test_what_is_no_asset_is_cleared_of_nothing(clips: Clips) -> None:
    anna = run(clips.anna)
    home = collection_of(anna)
    with pytest.raises(RuntimeError, match="Face is no asset"):
        bpy.ops.facewright.mark_head(clear=True)
    (copy,) = duplicated(anna, linked=True).values()
    home.objects.unlink(copy)
    bpy.context.scene.collection.objects.link(copy)
    select(copy)
    assert head_of(copy).home is None, "it has no collection of its own"
    with pytest.raises(RuntimeError, match=f"{copy.name} is no asset"):
        bpy.ops.facewright.mark_head(clear=True)
    assert bpy.ops.facewright.mark_head() == {"FINISHED"}
    assert bpy.ops.facewright.mark_head(clear=True) == {"FINISHED"}


def test_a_head_of_an_older_version_is_copied_named_marked_and_removed_as_any_other(clips: Clips) -> None:
    anna = run(clips.anna)
    made_by_an_older_version(clips.anna, anna)
    copy = duplicate(anna)
    assert_is(copy, ANNA)
    assert not used_by(anna) - {None} & used_by(copy)
    anna.facewright_title = "Anna"
    assert collection_of(anna).name == head_of(anna).parts["tongue"].name.split()[0] == "Anna"
    select(anna)
    assert bpy.ops.facewright.mark_head() == {"FINISHED"}
    assert collection_of(anna).asset_data is not None
    remove(anna)
    assert [head.skin for head in heads()] == [copy]
    assert_is(copy, ANNA)


@pytest.mark.parametrize("name", OPERATORS)
def test_each_button_is_one_step_that_undo_and_redo_restore(clips: Clips, name: str) -> None:
    run(clips.anna)
    run(clips.ben)
    assert_is_one_step(lambda: getattr(bpy.ops.facewright, name)("EXEC_DEFAULT", True))
    for person in (ANNA, BEN):
        found = [head.skin for head in heads() if abs(size(head.skin) - person.size) < 1e-3]
        assert len(found) == {"duplicate_head": {"Ben": 2}, "remove_head": {"Ben": 0}}.get(name, {}).get(person.name, 1)
        for skin in found:
            assert_is(skin, person)


def test_choosing_a_new_head_is_one_step(clips: Clips) -> None:
    run(clips.anna)
    assert_is_one_step(lambda: bpy.ops.facewright.choose_head("EXEC_DEFAULT", True))


def test_a_new_name_is_one_step(clips: Clips) -> None:
    anna = run(clips.anna).name

    def rename() -> None:
        bpy.data.objects[anna].facewright_title = "Anna"
        bpy.ops.ed.undo_push(message="Name")

    assert_is_one_step(rename)
    assert_is(bpy.data.objects["Anna"], ANNA)


def test_an_undone_duplicate_leaves_the_original_driving_its_own_parts(clips: Clips) -> None:
    run(clips.anna)
    bpy.ops.ed.undo_push(message="Before")
    bpy.ops.facewright.duplicate_head("EXEC_DEFAULT", True)
    bpy.ops.ed.undo()
    bpy.ops.ed.redo()
    first, second = bpy.data.objects["Face"], bpy.data.objects["Face.001"]
    jaw = first.data.shape_keys.key_blocks["jawOpen"]
    jaw.value = 1.0
    still = evaluated(head_of(second).parts["teeth_lower"])
    jaw.value = 0.0
    assert np.array_equal(still, evaluated(head_of(second).parts["teeth_lower"]))
    assert opened(first) > 0.003 and opened(second) > 0.003


def test_the_buttons_say_why_they_are_grey(clips: Clips) -> None:
    for name in OPERATORS:
        with pytest.raises(RuntimeError, match="There is no head yet"):
            getattr(bpy.ops.facewright, name)()
    run(clips.anna)
    bpy.ops.object.mode_set(mode="SCULPT")
    for name in OPERATORS:
        with pytest.raises(RuntimeError, match="Go to Object Mode first"):
            getattr(bpy.ops.facewright, name)()
