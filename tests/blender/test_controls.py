"""Controls lead the keys: the same pose, expressions and keyframes with and without them."""

import time

import bpy
import numpy as np
import pytest
from controlled import add, bone, largest, layout, over, remove
from people import evaluated, select
from test_keys import FACE, assert_near, at, blocks, in_view, keyed, pose, random_pose, values
from tracking import module

LAYOUT_KEYS = 52


@pytest.fixture
def face(generic_face: bpy.types.Object) -> bpy.types.Object:
    """A head with controls."""
    add(generic_face)
    return generic_face


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


def test_a_handle_goes_as_far_as_the_expressions_ask_and_back(generic_face: bpy.types.Object) -> None:
    add(generic_face)
    brow, way = bone(generic_face, "brow.T"), layout().TRAVEL
    FACE.expression(name="surprise")
    assert brow.location.y == pytest.approx(1.3 * way) and brow["browInnerUp"] == 0.0
    brow.location.y = 2.0 * way
    assert values(generic_face)["browInnerUp"] == pytest.approx(1.5)
    assert next(c for c in brow.constraints if c.type == "LIMIT_LOCATION").max_y == pytest.approx(1.5 * way)
    brow.location.y = 0.0
    assert values(generic_face)["browInnerUp"] == 0.0, "what is dragged back is gone"


def test_controls_of_an_older_version_mean_the_same(generic_face: bpy.types.Object) -> None:
    made, find = add(generic_face), module("scene.controls_find")
    del made.data[find.REACH]
    add(generic_face)
    FACE.expression(name="surprise")
    assert_near(values(generic_face), pose(generic_face, "surprise"))
    FACE.reset_keys()
    assert not any(values(generic_face).values())


def test_keyframes_of_strong_expressions_are_moved_by_the_handle(generic_face: bpy.types.Object) -> None:
    keyed(generic_face, {1: "neutral", 20: "sadness"})
    before = over(generic_face, [1.0, 7.3, 20.0])
    made = add(generic_face)
    assert largest(over(generic_face, [1.0, 7.3, 20.0]), before) < 1e-5
    paths = {curve.data_path for curve in module("scene.pose_keys").curves(made)}
    assert bone(generic_face, "brow.T").path_from_id("location") in paths
    assert not any("browInnerUp" in path for path in paths)


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
    # A quarter of what they change in a frame, 0.2: they meet between two.
    assert largest(over(generic_face, between), before_between) < 0.05, "keys that take turns are sampled"
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


@pytest.mark.parametrize("extrapolation", ["CONSTANT", "LINEAR"])
def test_keyframes_that_no_handle_can_say_are_kept_too(generic_face: bpy.types.Object, extrapolation: str) -> None:
    """A key beyond its slider's usual end, and two opposite keys at once."""
    keys = generic_face.data.shape_keys.key_blocks
    keys["cheekPuff"].slider_max, keys["mouthSmileLeft"].slider_min = 2.0, -1.0
    scores = {"cheekPuff": (0.2, 1.8, 0.4), "mouthSmileLeft": (-0.5, 0.9, 0.3), "mouthFrownLeft": (0.0, 0.8, 0.9)}
    for name, numbers in scores.items():
        for frame, value in zip((1, 10, 20), numbers):
            keys[name].value = value
            keys[name].keyframe_insert("value", frame=frame)
        module("scene.keys").key_channel(keys[name]).curve.extrapolation = extrapolation
    whole = [float(f) for f in range(-2, 24)]
    before = over(generic_face, whole)
    add(generic_face)
    assert largest(over(generic_face, whole), before) < 1e-5
    remove(generic_face)
    assert largest(over(generic_face, whole[3:-3]), before[3:-3]) < 1e-5


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


def test_an_expression_of_handles_takes_no_time_that_is_felt(face: bpy.types.Object) -> None:
    started = time.perf_counter()
    FACE.expression(name="surprise", keyframe="INSERT")
    FACE.clear_keyframes()
    assert time.perf_counter() - started < 0.3
