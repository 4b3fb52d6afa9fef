"""Controls lead the keys: the same pose, expressions and keyframes with and without them."""

import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import bpy
import numpy as np
import pytest
from people import Clips, evaluated, head_of, reopened, run, select
from test_keys import FACE, assert_near, at, blocks, keyed, pose, random_pose, values
from tracking import Layout, module

LAYOUT_KEYS = 52


@pytest.fixture
def face(generic_face: bpy.types.Object) -> bpy.types.Object:
    """A head with controls."""
    add(generic_face)
    return generic_face


def add(skin: bpy.types.Object) -> bpy.types.Object:
    """Press the button; gives the armature."""
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    select(skin)
    assert FACE.add_controls() == {"FINISHED"}
    return armature(skin)


def remove(skin: bpy.types.Object) -> None:
    assert FACE.remove_controls() == {"FINISHED"}
    assert armature(skin) is None


def armature(skin: bpy.types.Object) -> Any:
    return module("scene.controls_find").of(skin)


def bone(skin: bpy.types.Object, role: str) -> bpy.types.PoseBone:
    return module("scene.controls_find").bones(armature(skin))[role]


def layout() -> Any:
    return module("scene.controls_layout")


def test_handles_and_jaw_reach_all_keys_of_arkit(face: bpy.types.Object) -> None:
    arkit = {block.name for block in blocks(face) if not block.name.startswith("viseme_")}
    assert len(arkit) == LAYOUT_KEYS and layout().LINKS.keys() == arkit
    assert module("scene.controls_find").led(face) == arkit
    for key, link in layout().LINKS.items():
        found = bone(face, link.axis.role)
        getattr(found, link.axis.channel)[link.axis.index] = link.full
        now = values(face)
        assert_near(now, {name: float(name == key) for name in now})
        getattr(found, link.axis.channel)[link.axis.index] = 0.0
    assert not any(values(face).values())


def test_every_expression_is_the_same_with_and_without_controls(generic_face: bpy.types.Object) -> None:
    names = module("animate.actions").names(generic_face)
    shapes = {}
    for name in names:
        FACE.expression(name=name)
        shapes[name] = evaluated(generic_face)
    add(generic_face)
    for name in names:
        assert FACE.expression(name=name) == {"FINISHED"}
        assert_near(values(generic_face), pose(generic_face, name))
        np.testing.assert_allclose(evaluated(generic_face), shapes[name], atol=1e-6)


def test_any_pose_can_be_had_and_is_the_same_with_and_without_controls(generic_face: bpy.types.Object) -> None:
    before = random_pose(generic_face, 11)
    add(generic_face)
    assert_near(values(generic_face), before)
    rng = np.random.default_rng(12)
    wanted = {name: float(rng.uniform(0.0, 1.0)) for name in before}
    module("scene.keys").set_values(generic_face, wanted)
    assert_near(values(generic_face), wanted)
    remove(generic_face)
    assert_near(values(generic_face), wanted)


def test_keyed_expressions_scrub_right_with_controls(face: bpy.types.Object) -> None:
    scores = {1: "neutral", 20: "happiness", 40: "surprise"}
    keyed(face, scores)
    for frame in (40, 1, 20, 1, 40, 20):
        at(frame)
        assert_near(values(face), pose(face, scores[frame]))
    assert not set(module("scene.pose_keys").curves(face.data.shape_keys)).isdisjoint(
        c for c in module("scene.pose_keys").curves(face.data.shape_keys) if "viseme" in c.data_path
    ), "visemes remain keys"
    assert FACE.clear_keyframes() == {"FINISHED"}
    at(21)
    at(20)
    assert max(abs(values(face)[n] - pose(face, "happiness")[n]) for n in pose(face, "happiness")) > 0.1
    with pytest.raises(RuntimeError, match="no keyframes of its keys at frame 20"):
        FACE.clear_keyframes()


def test_reset_and_mirror_mean_the_pose_with_controls(face: bpy.types.Object) -> None:
    rng = np.random.default_rng(3)
    before = {block.name: float(rng.uniform(0.0, 1.0)) for block in blocks(face)}
    module("scene.keys").set_values(face, before)
    FACE.mirror_keys()
    once = values(face)
    assert once["eyeBlinkLeft"] == pytest.approx(before["eyeBlinkRight"], abs=1e-6)
    assert once["mouthRight"] == pytest.approx(before["mouthLeft"], abs=1e-6)
    FACE.mirror_keys()
    assert_near(values(face), before)
    FACE.reset_keys(group="Mouth")
    assert_near(values(face), {n: 0.0 if n.startswith("mouth") else v for n, v in before.items()})
    FACE.reset_keys()
    assert not any(values(face).values())


def test_an_expression_can_be_added_to_and_mixed_with_a_pose_of_handles(face: bpy.types.Object) -> None:
    bone(face, "jaw_master").rotation_euler[0] = 0.5 * layout().OPEN
    bpy.context.view_layer.update()
    FACE.expression(name="happiness", blend="MIX", strength=0.5)
    wanted = {
        name: 0.5 * value + (0.25 if name == "jawOpen" else 0.0) for name, value in pose(face, "happiness").items()
    }
    assert_near(values(face), wanted)


def test_the_keying_set_keys_what_leads_the_face(face: bpy.types.Object) -> None:
    from test_keys import in_view

    scene = bpy.context.scene
    scene.keying_sets_all.active = scene.keying_sets_all["Facewright Face"]
    FACE.expression(name="surprise")
    at(15)
    assert in_view(bpy.ops.anim.keyframe_insert) == {"FINISHED"}
    at(30)
    FACE.expression(name="happiness", keyframe="INSERT")
    for frame, name in {15: "surprise", 30: "happiness"}.items():
        at(frame)
        assert_near(values(face), pose(face, name))


def over(skin: bpy.types.Object, times: list[float]) -> list[dict[str, float]]:
    """All keys at times of the timeline."""
    found = []
    for moment in times:
        bpy.context.scene.frame_set(int(moment), subframe=moment - int(moment))
        found.append(values(skin))
    return found


def largest(some: list[dict[str, float]], others: list[dict[str, float]]) -> float:
    return max(abs(a[name] - b[name]) for a, b in zip(some, others) for name in a)


def test_an_artists_keyframes_go_to_the_handles_and_back(generic_face: bpy.types.Object) -> None:
    keyed(generic_face, {1: "neutral", 10: "happiness", 20: "sadness", 30: "surprise"})
    puff = generic_face.data.shape_keys.key_blocks["cheekPuff"]
    for frame, value in ((3, 0.0), (12, 0.9), (27, 0.1)):
        puff.value = value
        puff.keyframe_insert("value", frame=frame)
    action = generic_face.data.shape_keys.animation_data.action
    whole, between = [float(f) for f in range(-3, 40)], [f + 0.37 for f in range(-3, 39)]
    before, before_between = over(generic_face, whole), over(generic_face, between)
    made = add(generic_face)
    assert largest(over(generic_face, whole), before) < 1e-5
    assert largest(over(generic_face, between), before_between) < 0.03, "keys that take turns are sampled"
    smooth = [{"cheekPuff": v["cheekPuff"]} for v in before_between]
    assert largest([{"cheekPuff": v["cheekPuff"]} for v in over(generic_face, between)], smooth) < 1e-6
    curves = module("scene.pose_keys").curves
    paths = {curve.data_path for curve in curves(made)}
    assert bone(generic_face, "lips.L").path_from_id("location") in paths
    assert {c.data_path for c in curves(generic_face.data.shape_keys)} == {
        f'key_blocks["{b.name}"].value' for b in blocks(generic_face) if b.name.startswith("viseme_")
    }
    assert generic_face.data.shape_keys.animation_data.action == action
    at(14)
    remove(generic_face)
    assert_near(values(generic_face), before[17])
    assert largest(over(generic_face, whole), before) < 1e-5
    assert not bpy.data.armatures and not [o for o in bpy.data.objects if o.name.startswith("Controls")]
    assert {action.name for action in bpy.data.actions} == {action.name}


def test_an_action_that_others_use_stays_whole(generic_face: bpy.types.Object) -> None:
    keyed(generic_face, {1: "neutral", 10: "happiness"})
    action = generic_face.data.shape_keys.animation_data.action
    action.use_fake_user = True
    curves = module("scene.pose_keys").curves
    count = len(curves(generic_face.data.shape_keys))
    before = over(generic_face, [1.0, 5.0, 10.0])
    add(generic_face)
    assert largest(over(generic_face, [1.0, 5.0, 10.0]), before) < 1e-5
    assert generic_face.data.shape_keys.animation_data.action != action
    probe = bpy.data.objects.new("probe", generic_face.data.copy())
    probe.data.shape_keys.animation_data.action = action
    if hasattr(action, "slots"):
        probe.data.shape_keys.animation_data.action_slot = action.slots[0]
    assert len(curves(probe.data.shape_keys)) == count


def test_drivers_need_no_scripts(face: bpy.types.Object) -> None:
    found = module("scene.controls_find").our_drivers(face)
    assert len(found) == LAYOUT_KEYS
    assert all(curve.driver.is_simple_expression and curve.driver.is_valid for curve in found.values())


def test_keys_with_an_artists_driver_are_left_alone_and_named(generic_face: bpy.types.Object) -> None:
    keys = generic_face.data.shape_keys.key_blocks
    keys["jawOpen"].driver_add("value").driver.expression = "0.25"
    keys["cheekPuff"].keyframe_insert("value", frame=1)
    curve = module("scene.keys").key_channel(keys["cheekPuff"]).curve
    curve.modifiers.new("CYCLES")
    select(generic_face)
    _, said = module("controls.actions").add(bpy.context.scene, generic_face)
    assert "jawOpen has a driver and stays as it is" in said
    assert "cheekPuff has a muted channel, or one with modifiers or samples and stays as it is" in said
    assert len(module("scene.controls_find").led(generic_face)) == LAYOUT_KEYS - 2
    assert values(generic_face)["jawOpen"] == pytest.approx(0.25)
    FACE.expression(name="happiness")
    assert_near(values(generic_face), pose(generic_face, "happiness") | {"jawOpen": 0.25})


def target(skin: bpy.types.Object, place: tuple[float, float, float]) -> None:
    """Put the gaze target to a place in the skin's coordinates, and let the eyes follow it."""
    eyes = bone(skin, "eyes")
    eyes["follow"] = 1.0
    eyes.location = eyes.bone.matrix_local.inverted() @ module("scene.controls_bones").Vector(place)
    armature(skin).update_tag()
    bpy.context.view_layer.update()


def centre_and_gaze(eye: bpy.types.Object) -> tuple[Any, Any]:
    """Where an eye is, and where it looks, as it was turned from looking forward: from its mesh alone."""
    measure = module("scene.controls_measure")
    rest = measure.positions(eye, 0)
    # Its keys turn about this place: a sphere through its vertices has it.
    fitted, *_ = np.linalg.lstsq(np.c_[2.0 * rest, np.ones(len(rest))], (rest**2).sum(axis=1), rcond=None)
    centre = fitted[:3]
    now = evaluated_before_bones(eye)
    ahead = rest[:, 1] < centre[1] - 0.8 * (centre[1] - rest[:, 1].min())
    # What was ahead of the middle of the eye is where it looks now.
    turn = (now[ahead] - centre).mean(axis=0)
    was = (rest[ahead] - centre).mean(axis=0)
    across = np.arctan2(turn[0], -turn[1]) - np.arctan2(was[0], -was[1])
    up = np.arctan2(turn[2], np.hypot(*turn[:2])) - np.arctan2(was[2], np.hypot(*was[:2]))
    return centre, (np.degrees(across), np.degrees(up))


def evaluated_before_bones(eye: bpy.types.Object) -> Any:
    return evaluated(eye).astype(np.float64)


@pytest.mark.parametrize(
    "yaw, pitch", [(20.0, 0.0), (-20.0, 0.0), (8.0, 0.0), (0.0, 15.0), (0.0, -18.0), (12.0, 9.0), (-15.0, -7.0)]
)
def test_both_eyes_look_at_their_target(face: bpy.types.Object, yaw: float, pitch: float) -> None:
    distance = 1.0
    a, b = np.radians([yaw, pitch])
    place = distance * np.array([np.sin(a) * np.cos(b), -np.cos(a) * np.cos(b), np.sin(b)])
    target(face, tuple(place.tolist()))
    for side in ("left", "right"):
        eye = next(o for o in face.children if o.get("facewright_part") == f"eye_{side}")
        centre, (across, up) = centre_and_gaze(eye)
        way = place - centre
        wanted = np.degrees(np.arctan2(way[0], -way[1])), np.degrees(np.arctan2(way[2], np.hypot(*way[:2])))
        assert (across, up) == pytest.approx(wanted, abs=0.35), side


def test_a_gaze_beyond_a_whole_key_stays_when_controls_go(face: bpy.types.Object) -> None:
    for frame, place in ((1, (0.0, -1.0, 0.0)), (20, (0.45, -1.0, 0.0))):
        target(face, place)
        bone(face, "eyes").keyframe_insert("location", frame=frame)
    at(5)
    before = over(face, [1.0, 10.0, 20.0])
    assert before[2]["eyeLookOutLeft"] > 1.3
    at(5)
    remove(face)
    assert largest(over(face, [1.0, 10.0, 20.0]), before) < 1e-5
    keys = face.data.shape_keys.key_blocks
    assert keys["eyeLookUpLeft"].slider_max == 1.0 and keys["eyeLookOutLeft"].slider_max == 2.0


def test_limits_of_keys_are_given_back(generic_face: bpy.types.Object) -> None:
    generic_face.data.shape_keys.key_blocks["eyeLookUpLeft"].slider_max = 1.5
    limits = {block.name: block.slider_max for block in blocks(generic_face)}
    add(generic_face)
    FACE.expression(name="surprise", blend="ADD")
    FACE.expression(name="surprise", blend="ADD")
    assert max(values(generic_face).values()) <= 1.0
    remove(generic_face)
    assert {block.name: block.slider_max for block in blocks(generic_face)} == limits


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


def test_a_gaze_target_stays_in_the_world_when_the_head_turns(face: bpy.types.Object) -> None:
    target(face, (0.0, -1.0, 0.0))
    ahead = values(face)
    bone(face, "head").rotation_euler[1] = np.radians(10.0)
    turned = values(face)
    assert ahead["eyeLookOutLeft"] < 0.01 and turned["eyeLookInLeft"] > 0.5 and turned["eyeLookOutRight"] > 0.5
    said = module("animate.actions").express(face, "happiness", 1.0, "REPLACE", None)
    assert said == "the gaze follows its target and stays as it is"
    assert values(face)["mouthSmileLeft"] > 0.5 and values(face)["eyeLookInLeft"] == turned["eyeLookInLeft"]
    with pytest.raises(RuntimeError, match="the gaze follows its target: move that, or set Gaze Follows Target to 0"):
        FACE.reset_keys(group="Gaze")


def turned_over(skin: bpy.types.Object, before: Any) -> int:
    """How many of the skin's triangles have turned over against how the bones turn them."""
    skin.data.calc_loop_triangles()
    corners = np.array([t.vertices for t in skin.data.loop_triangles])
    after = evaluated(skin).astype(np.float64)
    normals = [
        np.cross(p[corners[:, 1]] - p[corners[:, 0]], p[corners[:, 2]] - p[corners[:, 0]]) for p in (before, after)
    ]
    weights = vertex_weights(skin)
    turns = np.zeros((len(before), 3, 3))
    for name, column in weights.items():
        found = armature(skin).pose.bones[name]
        turns += column[:, None, None] * np.array(found.matrix @ found.bone.matrix_local.inverted(), np.float64)[:3, :3]
    expected = np.einsum("nij,nj->ni", turns[corners[:, 0]], normals[0])
    return int(((normals[1] * expected).sum(axis=1) <= 0.0).sum())


def vertex_weights(obj: bpy.types.Object) -> dict[str, Any]:
    names = [group.name for group in obj.vertex_groups]
    found = {name: np.zeros(len(obj.data.vertices)) for name in names}
    for vertex in obj.data.vertices:
        for group in vertex.groups:
            found[names[group.group]][vertex.index] = group.weight
    return found


def test_every_vertex_goes_with_the_bones_wholly(face: bpy.types.Object) -> None:
    for obj in head_of(face).objects:
        total = np.sum(list(vertex_weights(obj).values()), axis=0)
        assert total.min() == pytest.approx(1.0, abs=1e-5) and total.max() == pytest.approx(1.0, abs=1e-5)
    generic = module("scene.controls_measure").generic_positions(face)
    weights = vertex_weights(face)
    assert (weights["head"][generic[:, 2] > -0.05] == 1.0).all(), "the skull is rigid"
    assert (weights["head"][(generic[:, 1] < 0.0)] == 1.0).all(), "so are face and chin"
    assert weights["root"][generic[:, 2] < -0.195].min() > 0.999, "the neck's lower end stays"


@pytest.mark.parametrize("role", ["head", "neck"])
@pytest.mark.parametrize(
    "yaw, pitch", [(40.0, 0.0), (-40.0, 0.0), (0.0, 25.0), (0.0, -25.0), (40.0, 25.0), (-40.0, -25.0)]
)
def test_neck_and_head_turn_the_mesh_without_tears(face: bpy.types.Object, role: str, yaw: float, pitch: float) -> None:
    parts = {name: evaluated(obj).astype(np.float64) for name, obj in head_of(face).parts.items()}
    found = bone(face, role)
    found.rotation_mode = "YXZ"
    found.rotation_euler = np.radians([pitch, yaw, 0.0])
    bpy.context.view_layer.update()
    assert turned_over(face, parts["skin"]) == 0
    after = evaluated(face)
    low = module("scene.controls_measure").generic_positions(face)[:, 2] < -0.195
    assert np.abs(after[low] - parts["skin"][low]).max() < 1e-4, "the neck's lower end stays"
    head = bone(face, "head")
    rigid = np.array(head.matrix @ head.bone.matrix_local.inverted(), np.float64)
    for name, before in parts.items():
        if name != "skin":
            moved = before @ rigid[:3, :3].T + rigid[:3, 3]
            assert np.abs(evaluated(head_of(face).parts[name]) - moved).max() < 1e-5, name


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


def test_an_expression_of_handles_takes_no_time_that_is_felt(face: bpy.types.Object) -> None:
    started = time.perf_counter()
    FACE.expression(name="surprise", keyframe="INSERT")
    FACE.clear_keyframes()
    assert time.perf_counter() - started < 0.3


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
