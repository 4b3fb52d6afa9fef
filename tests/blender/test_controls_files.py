"""Controls and undo, further runs, copies, other files, and what an artist deletes or renames."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import bpy
import numpy as np
import pytest
from controlled import add, armature, bone, layout, remove
from people import Clips, evaluated, reopened, run, select
from test_keys import FACE, assert_near, at, keyed, pose, values
from tracking import Layout, module


@pytest.fixture
def face(generic_face: bpy.types.Object) -> bpy.types.Object:
    """A head with controls."""
    add(generic_face)
    return generic_face


def test_each_button_is_one_undo_step_and_a_second_press_changes_nothing(generic_face: bpy.types.Object) -> None:
    keyed(generic_face, {1: "neutral", 20: "happiness", 30: "sadness"})
    bpy.ops.ed.undo_push(message="Before")
    before = file_state()
    select(generic_face)
    assert FACE.add_controls("EXEC_DEFAULT", True) == {"FINISHED"}
    added = file_state()
    assert added != before
    assert FACE.add_controls("EXEC_DEFAULT", True) == {"FINISHED"}
    assert file_state() == added
    bpy.ops.ed.undo()
    bpy.ops.ed.undo()
    assert file_state() == before
    bpy.ops.ed.redo()
    assert file_state() == added
    assert FACE.remove_controls("EXEC_DEFAULT", True) == {"FINISHED"}
    assert file_state() != added
    bpy.ops.ed.undo()
    assert file_state() == added


def file_state() -> Any:
    """Bones, drivers, curves and values of the face's file."""
    curves = module("scene.pose_keys").curves
    owners = [*bpy.data.shape_keys, *(o for o in bpy.data.objects if o.type == "ARMATURE")]
    return {
        "kinds": {
            k: len(getattr(bpy.data, k)) for k in ("objects", "meshes", "armatures", "actions", "scenes", "curves")
        },
        "values": values(bpy.data.objects["Face"]),
        "drivers": [
            (o.name, c.data_path, c.driver.expression)
            for o in owners
            if o.animation_data
            for c in o.animation_data.drivers
        ],
        "curves": [
            (o.name, c.data_path, [tuple(p.co) for p in c.keyframe_points]) for o in owners for c in curves(o) or ()
        ],
        "bones": [(b.name, [tuple(r) for r in b.matrix_local]) for a in bpy.data.armatures for b in a.bones],
        "looks": [(o.name, [m.type for m in o.modifiers], [g.name for g in o.vertex_groups]) for o in bpy.data.objects],
    }


def test_a_second_run_brings_bones_to_the_new_head_and_keeps_the_pose(clips: Clips, grown: Any) -> None:
    anna = run(clips.anna)
    made = add(anna)
    keyed(anna, {1: "neutral", 20: "happiness"})
    bone(anna, "head").rotation_euler[1] = 0.3
    bone(anna, "head").keyframe_insert("rotation_euler", frame=20)
    at(20)
    before, joint = values(anna), bone(anna, "jaw_master").bone.head_local.copy()
    painted = anna.vertex_groups["head"]
    painted.add([5], 0.25, "REPLACE")
    grown()
    bpy.ops.object.mode_set(mode="OBJECT")
    select(anna)
    assert run(clips.anna, head=bpy.context.scene.facewright_clip.head) == anna
    assert armature(anna) == made and bone(anna, "jaw_master").bone.head_local.length == pytest.approx(
        joint.length / 0.9, rel=1e-3
    )
    at(1)
    at(20)
    assert_near(values(anna), before)
    assert bone(anna, "head").rotation_euler[1] == pytest.approx(0.3)
    assert painted.weight(5) == 0.25, "an artist's weights stay"


def test_copies_and_appended_heads_have_controls_of_their_own(clips: Clips, tmp_path: Path) -> None:
    anna = run(clips.anna)
    made = add(anna)
    bpy.ops.object.mode_set(mode="OBJECT")
    select(anna, *anna.children)
    assert bpy.ops.object.duplicate() == {"FINISHED"}
    copy = bpy.context.object
    own = armature(copy)
    assert own is not None and own != made and armature(anna) == made
    assert module("scene.controls_find").led(copy) == layout().LINKS.keys()
    bone(copy, "jaw_master").rotation_euler[0] = layout().OPEN
    assert values(copy)["jawOpen"] == pytest.approx(1.0) and values(anna)["jawOpen"] == 0.0
    bone(copy, "head").rotation_euler[0] = 0.4
    assert np.abs(evaluated(copy) - evaluated(anna)).max() > 0.01
    (home,) = anna.users_collection
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "work.blend"))
    name = home.name
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "work.blend"), link=False) as (_, here):
        here.collections = [name]
    bpy.context.scene.collection.children.link(here.collections[0])
    skin = next(o for o in here.collections[0].objects if o.get("facewright_part") == "skin")
    assert armature(skin) is not None
    bone(skin, "jaw_master").rotation_euler[0] = layout().OPEN
    assert values(skin)["jawOpen"] == pytest.approx(1.0)
    assert bone(skin, "face_panel").custom_shape is not None


def test_a_copy_without_its_armature_can_get_one_of_its_own(face: bpy.types.Object) -> None:
    made = armature(face)
    bpy.ops.object.mode_set(mode="OBJECT")
    select(face, *(o for o in face.children if o.type == "MESH"))
    bpy.ops.object.duplicate()
    copy = bpy.context.object
    assert armature(copy) is None
    own = add(copy)
    assert own not in (None, made) and armature(face) == made
    bone(copy, "jaw_master").rotation_euler[0] = layout().OPEN
    assert values(copy)["jawOpen"] == pytest.approx(1.0) and values(face)["jawOpen"] == 0.0
    bone(face, "head").rotation_euler[0] = 0.4
    assert np.abs(evaluated(copy) - evaluated(face)).max() > 0.01, "the original's bones do not move it"


def test_a_linked_duplicate_goes_on_following_its_bones_when_the_other_loses_its_own(face: bpy.types.Object) -> None:
    head, made = module("scene.heads").current(bpy.context.scene, face, "")[0], armature(face)
    bpy.ops.object.mode_set(mode="OBJECT")
    select(*head.objects, made)
    assert bpy.ops.object.duplicate(linked=True) == {"FINISHED"}
    copy = next(obj for obj in bpy.context.selected_objects if obj.get("facewright_part") == "skin")
    assert copy != face and copy.data == face.data, "they show one mesh"
    assert armature(copy) not in (None, made), "the copy has an armature of its own"
    select(face)
    remove(face)
    rest = evaluated(copy)
    bone(copy, "head").rotation_euler[2] = 0.5
    armature(copy).update_tag()
    assert np.abs(evaluated(copy) - rest).max() > 0.02, "the copy's head turns"
    select(copy)
    remove(copy)
    assert not copy.vertex_groups, "with the last controls the weights go"


def test_a_copy_that_gets_a_collection_takes_its_armature_along(clips: Clips) -> None:
    anna = run(clips.anna)
    add(anna)
    bpy.ops.object.mode_set(mode="OBJECT")
    select(anna, *anna.children)
    bpy.ops.object.duplicate()
    copy = bpy.context.object
    assert run(clips.anna, head=copy.name) == copy
    (home,) = copy.users_collection
    assert home not in anna.users_collection
    assert list(armature(copy).users_collection) == [home]
    assert armature(anna).users_collection == anna.users_collection


def test_deleted_controls_can_be_made_anew(face: bpy.types.Object) -> None:
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.data.objects.remove(armature(face))
    assert armature(face) is None
    add(face)
    FACE.expression(name="happiness")
    assert_near(values(face), pose(face, "happiness"))
    assert len([m for m in face.modifiers if m.type == "ARMATURE"]) == 1
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.data.objects.remove(armature(face))
    select(face)
    remove(face)
    assert not module("scene.controls_find").our_drivers(face) and not face.modifiers
    FACE.expression(name="neutral")
    assert not any(values(face).values())


def test_a_deleted_bone_comes_back_with_an_update(face: bpy.types.Object) -> None:
    made = armature(face)
    bpy.ops.object.mode_set(mode="EDIT")
    made.data.edit_bones.remove(made.data.edit_bones["lips.L"])
    bpy.ops.object.mode_set(mode="OBJECT")
    said = module("animate.actions").express(face, "happiness", 1.0, "REPLACE", None)
    assert said.startswith("drivers set mouth")
    add(face)
    assert module("scene.controls_find").led(face) == layout().LINKS.keys()
    FACE.expression(name="happiness")
    assert_near(values(face), pose(face, "happiness"))


def test_renamed_bones_and_objects_are_known(face: bpy.types.Object, tmp_path: Path) -> None:
    bpy.ops.object.mode_set(mode="OBJECT")
    made = armature(face)
    for found in made.data.bones:
        found.name = f"My {found.name}"
    made.name, face.name = "Puppet", "Anna"
    reopened(tmp_path / "work.blend")
    face = bpy.data.objects["Anna"]
    FACE.expression(name="surprise")
    assert_near(values(face), pose(face, "surprise"))
    add(face)
    assert {b.name for b in armature(face).data.bones} == {
        f"My {r}" for r in module("scene.controls_find").bones(armature(face))
    }
    assert {"My head", "My neck", "My root"} == {group.name for group in face.vertex_groups}


class Panel(Layout):
    """Remembers what a panel offers."""

    def __init__(self) -> None:
        super().__init__()
        self.operators: list[str] = []
        self.shown: list[str] = []

    def operator(self, name: str, **more: Any) -> SimpleNamespace:
        self.operators.append(name)
        return super().operator(name, **more)

    def prop(self, data: Any, name: str, **_more: Any) -> None:
        assert data.path_resolve(name) is not None
        self.shown.append(name)


def test_the_panel_offers_what_can_be_done(generic_face: bpy.types.Object) -> None:
    panel = module("controls.panel").FACEWRIGHT_PT_controls

    def drawn() -> Panel:
        layout = Panel()
        panel.draw(SimpleNamespace(layout=layout), bpy.context)
        return layout

    assert panel.poll(bpy.context)
    assert drawn().operators == ["facewright.add_controls"]
    add(generic_face)
    shown = drawn()
    assert shown.shown == ['["follow"]', "is_visible", "is_visible"]
    assert shown.operators == ["facewright.pose_controls", "facewright.add_controls", "facewright.remove_controls"]
    assert bpy.context.mode == "POSE"
    module("controls.actions").mark(armature(generic_face), lambda role: role in ("head", "lips.L"))
    bpy.context.view_layer.update()
    assert {b.name for b in bpy.context.selected_pose_bones} == {"head", "lips.L"}
    assert FACE.pose_controls() == {"FINISHED"} and bpy.context.mode == "OBJECT"
    assert FACE.pose_controls() == {"FINISHED"} and bpy.context.mode == "POSE"


def test_a_panel_is_in_no_other_head(clips: Clips) -> None:
    anna = run(clips.anna)
    add(anna)
    bpy.ops.object.mode_set(mode="OBJECT")
    ben = run(clips.ben)
    add(ben)
    bpy.ops.object.mode_set(mode="OBJECT")
    select(ben)
    bpy.ops.object.duplicate()
    third = bpy.context.object
    third.location.x += 0.3
    bpy.ops.object.duplicate()
    bpy.context.object.location.x += 0.3
    add(third)
    places = [(armature(s).matrix_world @ bone(s, "face_panel").bone.head_local).x for s in (anna, ben, third)]
    across = [s.matrix_world.translation.x for s in (anna, ben, third)]
    assert places[0] == pytest.approx(across[0] + 0.23, abs=0.01) and places[0] + 0.2 < across[1], "to the left"
    assert places[1] == pytest.approx(across[1] + 0.23, abs=0.01)
    assert places[2] == pytest.approx(across[2], abs=0.01), "above, where heads are on both sides"


def test_a_face_whose_keys_are_all_animated_by_strips_is_refused(generic_face: bpy.types.Object) -> None:
    keyed(generic_face, {1: "neutral", 20: "happiness"})
    animation = generic_face.data.shape_keys.animation_data
    track = animation.nla_tracks.new()
    track.strips.new("strip", 1, animation.action)
    animation.action = None
    before = file_state()
    select(generic_face)
    with pytest.raises(RuntimeError, match="bones can lead no key of Face: jawOpen is animated by strips"):
        FACE.add_controls()
    assert file_state() == before


def test_greyed_buttons_say_why(generic_face: bpy.types.Object) -> None:
    with pytest.raises(RuntimeError, match="Add Controls first"):
        FACE.remove_controls()
    generic_face.vertex_groups.new(name="head")
    with pytest.raises(
        RuntimeError, match="Face has a vertex group head, as the bone is called: rename the group first"
    ):
        FACE.add_controls()
    bpy.ops.wm.read_homefile(use_empty=True)
    with pytest.raises(RuntimeError, match="Reconstruct a face first"):
        FACE.add_controls()
