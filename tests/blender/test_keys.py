"""Expressions, values and keyframes of a face's keys: what a frame shows is the pose that was keyed there."""

import json
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import bpy
import numpy as np
import pytest
from conftest import PACKAGE
from people import Clips, evaluated, run, select
from tracking import module

FACE = bpy.ops.facewright
ACTS = {"expression": {"name": "surprise"}, "reset_keys": {}, "mirror_keys": {}, "insert_keyframes": {}}


def blocks(skin: bpy.types.Object) -> list[bpy.types.ShapeKey]:
    return list(skin.data.shape_keys.key_blocks)[1:]


def values(skin: bpy.types.Object) -> dict[str, float]:
    """All keys as a renderer sees them."""
    bpy.context.view_layer.update()
    keys = skin.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.shape_keys
    return {block.name: block.value for block in list(keys.key_blocks)[1:]}


def pose(skin: bpy.types.Object, name: str, strength: float = 1.0) -> dict[str, float]:
    """What a head should have in an expression: its weights, which are within the sliders; 0 elsewhere."""
    weights = module("scene.keys").expressions(skin).get(name, {})
    return {block.name: strength * weights.get(block.name, 0.0) for block in blocks(skin)}


def at(frame: int) -> None:
    bpy.context.scene.frame_set(frame)


def keyed(skin: bpy.types.Object, scores: dict[int, str]) -> None:
    for frame, name in scores.items():
        at(frame)
        assert FACE.expression(name=name, keyframe="INSERT") == {"FINISHED"}


def frames(skin: bpy.types.Object, name: str) -> list[float]:
    """The frames of a key's keyframes."""
    animation = skin.data.shape_keys.animation_data
    if animation is None or animation.action is None:
        return []
    path = skin.data.shape_keys.key_blocks[name].path_from_id("value")
    curves = module("scene.pose_keys").curves(skin.data.shape_keys) or []
    return [float(point.co.x) for curve in curves if curve.data_path == path for point in curve.keyframe_points]


def curve(skin: bpy.types.Object, name: str) -> bpy.types.FCurve:
    path = skin.data.shape_keys.key_blocks[name].path_from_id("value")
    return next(c for c in module("scene.pose_keys").curves(skin.data.shape_keys) if c.data_path == path)


def in_view(work: Callable[[], Any]) -> Any:
    """What is done with the mouse over a 3D view."""
    window = bpy.context.window_manager.windows[0]
    area = window.screen.areas[0]
    area.type = "VIEW_3D"
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        return work()


def random_pose(skin: bpy.types.Object, seed: int) -> dict[str, float]:
    rng = np.random.default_rng(seed)
    for block in blocks(skin):
        block.value = float(rng.uniform(0.0, 1.0))
    return {block.name: block.value for block in blocks(skin)}


def assert_near(found: dict[str, float], wanted: dict[str, float]) -> None:
    assert found.keys() == wanted.keys()
    wrong = {name: (found[name], wanted[name]) for name in found if abs(found[name] - wanted[name]) > 1e-6}
    assert not wrong


def test_each_frame_shows_the_expression_that_was_keyed_there(generic_face: bpy.types.Object) -> None:
    scores = {1: "neutral", 20: "happiness", 40: "surprise"}
    keyed(generic_face, scores)
    for frame in (40, 1, 20, 1, 40, 20):
        at(frame)
        assert_near(values(generic_face), pose(generic_face, scores[frame]))
    assert all(frames(generic_face, block.name) == [1.0, 20.0, 40.0] for block in blocks(generic_face))


def test_an_expression_keyed_in_between_shows_nothing_of_its_neighbours(generic_face: bpy.types.Object) -> None:
    keyed(generic_face, {1: "happiness", 40: "surprise"})
    keyed(generic_face, {20: "anger"})
    for frame, name in {1: "happiness", 20: "anger", 40: "surprise"}.items():
        at(frame)
        assert_near(values(generic_face), pose(generic_face, name))


def test_the_shape_on_a_keyed_frame_is_that_of_the_unkeyed_expression(generic_face: bpy.types.Object) -> None:
    teeth = next(o for o in generic_face.children if o["facewright_part"] == "teeth_lower")
    shapes = {}
    for name in ("neutral", "happiness", "surprise"):
        FACE.expression(name=name)
        shapes[name] = evaluated(generic_face), evaluated(teeth)
    assert np.abs(shapes["surprise"][1] - shapes["neutral"][1]).max() > 0.003, "surprise lowers the teeth"
    scores = {1: "neutral", 20: "happiness", 40: "surprise"}
    keyed(generic_face, scores)
    for frame in (20, 40, 1):
        at(frame)
        skin, lower = shapes[scores[frame]]
        np.testing.assert_allclose(evaluated(generic_face), skin, atol=1e-6)
        np.testing.assert_allclose(evaluated(teeth), lower, atol=1e-6)


def test_older_keyframes_at_other_frames_stay(generic_face: bpy.types.Object) -> None:
    jaw, puff = (generic_face.data.shape_keys.key_blocks[name] for name in ("jawOpen", "cheekPuff"))
    for block, frame, value in ((jaw, 10, 0.25), (puff, 30, 0.75)):
        block.value = value
        block.keyframe_insert("value", frame=frame)
    keyed(generic_face, {20: "happiness"})
    assert frames(generic_face, "jawOpen") == [10.0, 20.0] and frames(generic_face, "cheekPuff") == [20.0, 30.0]
    at(10)
    assert values(generic_face)["jawOpen"] == pytest.approx(0.25)
    at(30)
    assert values(generic_face)["cheekPuff"] == pytest.approx(0.75)
    at(20)
    assert_near(values(generic_face), pose(generic_face, "happiness"))


@pytest.mark.parametrize("auto", [False, True], ids=["auto keying off", "auto keying on"])
@pytest.mark.parametrize("choice", ["AUTO", "INSERT", "NONE"])
def test_keyframes_are_inserted_as_told(generic_face: bpy.types.Object, choice: str, auto: bool) -> None:
    bpy.context.scene.tool_settings.use_keyframe_insert_auto = auto
    at(7)
    for name, more in ACTS.items():
        if name != "insert_keyframes":
            getattr(FACE, name)(**more, keyframe=choice)
    is_keyed = choice == "INSERT" or (choice == "AUTO" and auto)
    assert frames(generic_face, "noseSneerLeft") == ([7.0] if is_keyed else [])


def test_replace_leaves_nothing_of_the_pose_before(generic_face: bpy.types.Object) -> None:
    random_pose(generic_face, 1)
    FACE.expression(name="smile", strength=0.5)
    assert_near(values(generic_face), pose(generic_face, "smile", 0.5))


def test_sliders_end_where_the_expressions_of_a_head_do_on_each_of_its_parts(generic_face: bpy.types.Object) -> None:
    weights = module("scene.keys").expressions(generic_face)
    ends = {block.name: block.slider_max for block in blocks(generic_face)}
    asked = {name: max([1.0, *(pose.get(name, 0.0) for pose in weights.values())]) for name in ends}
    assert asked["browInnerUp"] == 1.5 and asked["noseSneerLeft"] == 1.3
    assert_near(ends, asked)
    for part in generic_face.children:
        assert_near({b.name: b.slider_max for b in blocks(part)}, {b.name: asked[b.name] for b in blocks(part)})
    FACE.expression(name="surprise")
    assert values(generic_face)["browInnerUp"] == pytest.approx(1.3)
    FACE.reset_keys()
    assert not any(values(generic_face).values())


def test_add_goes_onto_the_pose_as_far_as_the_sliders_go(generic_face: bpy.types.Object) -> None:
    before = random_pose(generic_face, 2)
    generic_face.data.shape_keys.key_blocks["jawOpen"].slider_max = 2.0
    generic_face.data.shape_keys.key_blocks["jawOpen"].value = before["jawOpen"] = 0.9
    weights = module("scene.keys").expressions(generic_face)["surprise"]
    wanted = {name: before[name] + 0.8 * weights.get(name, 0.0) for name in before}
    assert wanted["jawOpen"] > 1.0 and max(wanted[name] for name in ("browInnerUp", "eyeWideLeft")) > 1.0
    FACE.expression(name="surprise", strength=0.8, blend="ADD")
    ends = {block.name: block.slider_max for block in blocks(generic_face)}
    assert ends["jawOpen"] == 2.0 and ends["eyeWideLeft"] == pytest.approx(1.1) and ends["mouthFunnel"] == 1.0
    assert_near(values(generic_face), {name: min(value, ends[name]) for name, value in wanted.items()})


def test_mix_goes_by_the_strength_from_the_pose_to_the_expression(generic_face: bpy.types.Object) -> None:
    before = random_pose(generic_face, 3)
    weights = module("scene.keys").expressions(generic_face)["happiness"]
    FACE.expression(name="happiness", strength=0.25, blend="MIX")
    assert_near(values(generic_face), {n: 0.75 * v + 0.25 * weights.get(n, 0.0) for n, v in before.items()})
    FACE.expression(name="happiness", strength=1.0, blend="MIX")
    assert_near(values(generic_face), pose(generic_face, "happiness"))


@pytest.mark.parametrize("blend", ["ADD", "MIX"])
def test_a_blended_pose_is_keyed_whole(generic_face: bpy.types.Object, blend: str) -> None:
    keyed(generic_face, {1: "anger", 40: "surprise"})
    at(20)
    FACE.expression(name="happiness", strength=0.5, blend=blend, keyframe="INSERT")
    seen = {block.name: block.value for block in blocks(generic_face)}
    at(1)
    at(20)
    assert_near(values(generic_face), seen)


def test_keys_that_the_artist_added_keep_their_values_and_are_keyed(generic_face: bpy.types.Object) -> None:
    own = generic_face.shape_key_add(name="Sculpt", from_mix=False)
    own.value = 0.6
    keyed(generic_face, {1: "neutral", 20: "happiness"})
    FACE.reset_keys(keyframe="NONE")
    assert own.value == pytest.approx(0.6)
    assert frames(generic_face, "Sculpt") == [1.0, 20.0]


def test_an_added_key_that_an_expression_names_is_part_of_every_pose(generic_face: bpy.types.Object) -> None:
    own = generic_face.shape_key_add(name="Smirk", from_mix=False)
    known = module("scene.keys").expressions(generic_face)
    generic_face["facewright_expressions"] = json.dumps(known | {"smirk": {"Smirk": 0.5}})
    FACE.expression(name="smirk")
    assert own.value == 0.5
    FACE.expression(name="happiness")
    assert own.value == 0.0


def test_clear_pose_brings_all_keys_to_rest_and_a_group_alone(generic_face: bpy.types.Object) -> None:
    before = random_pose(generic_face, 4)
    FACE.reset_keys(group="Brows")
    assert_near(values(generic_face), {n: 0.0 if n.startswith("brow") else v for n, v in before.items()})
    FACE.reset_keys()
    assert not any(values(generic_face).values())


def test_insert_keyframes_keys_the_present_pose_of_every_key(generic_face: bpy.types.Object) -> None:
    at(12)
    seen = random_pose(generic_face, 5)
    FACE.insert_keyframes()
    at(30)
    FACE.reset_keys(keyframe="INSERT")
    at(12)
    assert_near(values(generic_face), seen)
    assert all(frames(generic_face, name) == [12.0, 30.0] for name in seen)


def test_clear_deletes_the_keyframes_of_this_frame_alone(generic_face: bpy.types.Object) -> None:
    keyed(generic_face, {1: "neutral", 20: "happiness", 40: "surprise"})
    at(20)
    assert FACE.clear_keyframes(group="Mouth") == {"FINISHED"}
    for block in blocks(generic_face):
        is_mouth = block.name.startswith("mouth")
        assert frames(generic_face, block.name) == ([1.0, 40.0] if is_mouth else [1.0, 20.0, 40.0]), block.name
    assert FACE.clear_keyframes() == {"FINISHED"}
    assert all(frames(generic_face, block.name) == [1.0, 40.0] for block in blocks(generic_face))
    with pytest.raises(RuntimeError, match="no keyframes of its keys at frame 20"):
        FACE.clear_keyframes()


def test_clear_says_that_a_face_without_animation_has_no_keyframes(generic_face: bpy.types.Object) -> None:
    with pytest.raises(RuntimeError, match="no keyframes"):
        FACE.clear_keyframes()
    generic_face.data.shape_keys.animation_data_create().action = bpy.data.actions.new("empty")
    with pytest.raises(RuntimeError, match="no keyframes"):
        FACE.clear_keyframes()


def test_mirrored_twice_a_pose_is_as_before_and_once_its_sides_are_exchanged(generic_face: bpy.types.Object) -> None:
    before = random_pose(generic_face, 6)
    FACE.mirror_keys()
    once = values(generic_face)
    assert once["eyeBlinkLeft"] == before["eyeBlinkRight"] and once["mouthRight"] == before["mouthLeft"]
    assert once["jawOpen"] == before["jawOpen"] and once["viseme_aa"] == before["viseme_aa"]
    paired = [name for name in before if name.endswith(("Left", "Right"))]
    assert len(paired) == 40 and all(once[name] != before[name] for name in paired)
    FACE.mirror_keys()
    assert_near(values(generic_face), before)


def test_a_mirrored_pose_is_the_mirrored_shape(generic_face: bpy.types.Object) -> None:
    FACE.reset_keys()
    for name, value in {"eyeBlinkLeft": 1.0, "mouthSmileRight": 0.8, "jawLeft": 0.7, "browDownLeft": 1.0}.items():
        generic_face.data.shape_keys.key_blocks[name].value = value
    rest = np.empty(3 * len(generic_face.data.vertices), np.float32)
    generic_face.data.vertices.foreach_get("co", rest)
    before = evaluated(generic_face) - rest.reshape(-1, 3)
    FACE.mirror_keys()
    after = evaluated(generic_face) - rest.reshape(-1, 3)
    for there, here in ((before, after), (after, before)):
        left, right = rest.reshape(-1, 3)[:, 0] > 0.01, rest.reshape(-1, 3)[:, 0] < -0.01
        # Halves of a face that is not quite symmetrical: by how much they move, and which way sideways.
        moved, mirrored = (np.sqrt((side**2).sum(axis=1).mean()) for side in (there[left], here[right]))
        assert moved == pytest.approx(mirrored, rel=0.1)
        assert there[left, 0].mean() == pytest.approx(-here[right, 0].mean(), rel=0.2)


def test_mirroring_a_group_leaves_the_others(generic_face: bpy.types.Object) -> None:
    before = random_pose(generic_face, 7)
    FACE.mirror_keys(group="Gaze")
    after = values(generic_face)
    assert after["eyeLookInLeft"] == before["eyeLookInRight"]
    assert all(after[name] == before[name] for name in before if not name.startswith("eyeLook"))
    with pytest.raises(RuntimeError, match="no key of Visemes has another side"):
        FACE.mirror_keys(group="Visemes")
    with pytest.raises(RuntimeError, match="no keys of the group Ears: choose one of Brows, Lids"):
        FACE.mirror_keys(group="Ears")
    assert values(generic_face) == after


@pytest.mark.parametrize("direction, source", [("TO_RIGHT", "Left"), ("TO_LEFT", "Right")])
def test_one_side_is_copied_to_the_other(generic_face: bpy.types.Object, direction: str, source: str) -> None:
    before = random_pose(generic_face, 8)
    FACE.mirror_keys(direction=direction)
    whole = {"jawLeft", "jawRight", "mouthLeft", "mouthRight"}
    wanted = dict(before)
    for name in before:
        for side in ("Left", "Right"):
            if name.endswith(side) and name not in whole:
                wanted[name] = before[name.removesuffix(side) + source]
    assert_near(values(generic_face), wanted)


def test_an_artists_own_pairs_are_known_by_blenders_names_of_sides(generic_face: bpy.types.Object) -> None:
    for name in ("Smirk.L", "Smirk.R", "cleft"):
        generic_face.shape_key_add(name=name, from_mix=False).value = 0.5 if name == "Smirk.L" else 0.0
    FACE.mirror_keys(direction="TO_RIGHT", group="Other")
    after = values(generic_face)
    assert (after["Smirk.L"], after["Smirk.R"], after["cleft"]) == (0.5, 0.5, 0.0)


def test_the_keying_set_keys_the_whole_pose(generic_face: bpy.types.Object) -> None:
    scene = bpy.context.scene
    scene.keying_sets_all.active = scene.keying_sets_all["Facewright Face"]
    assert scene.keying_sets_all.active.bl_idname == "FacewrightFace"
    select(generic_face)
    at(15)
    seen = random_pose(generic_face, 9)
    assert in_view(bpy.ops.anim.keyframe_insert) == {"FINISHED"}
    assert all(frames(generic_face, name) == [15.0] for name in seen)
    at(30)
    FACE.expression(name="surprise", keyframe="INSERT")
    at(15)
    assert_near(values(generic_face), seen)
    assert in_view(bpy.ops.anim.keyframe_delete) == {"FINISHED"}
    assert all(frames(generic_face, name) == [30.0] for name in seen)


def test_the_keying_set_is_not_offered_without_a_face() -> None:
    bpy.ops.mesh.primitive_cube_add()
    with pytest.raises(RuntimeError, match="No suitable context info for active keying set"):
        in_view(lambda: bpy.ops.anim.keyframe_insert_by_name(type="FacewrightFace"))
    assert not bpy.data.actions


def test_a_file_whose_active_keying_set_is_ours_is_safe_without_the_extension(generic_face: bpy.types.Object) -> None:
    sets = bpy.context.scene.keying_sets_all
    sets.active = sets["Facewright Face"]
    in_view(bpy.ops.anim.keyframe_insert)
    bpy.ops.preferences.addon_disable(module=PACKAGE)
    try:
        assert "Facewright Face" not in sets and sets.active is None
    finally:
        bpy.ops.preferences.addon_enable(module=PACKAGE)
    assert "Facewright Face" in bpy.context.scene.keying_sets_all


def test_keyframes_lie_in_a_channel_group_for_each_group_of_keys(generic_face: bpy.types.Object) -> None:
    FACE.insert_keyframes()
    assert curve(generic_face, "jawOpen").group.name == "Jaw"
    assert curve(generic_face, "viseme_aa").group.name == "Visemes"


def test_a_linked_action_is_refused_before_anything_changes(generic_face: bpy.types.Object, tmp_path: Path) -> None:
    FACE.insert_keyframes()
    action = generic_face.data.shape_keys.animation_data.action
    bpy.data.libraries.write(str(tmp_path / "action.blend"), {action})
    with bpy.data.libraries.load(str(tmp_path / "action.blend"), link=True) as (there, here):
        here.actions = there.actions
    generic_face.data.shape_keys.animation_data.action = here.actions[0]
    bpy.context.view_layer.update()
    before = random_pose(generic_face, 10)
    for name, more in (ACTS | {"clear_keyframes": {}}).items():
        option = {} if "keyframes" in name else {"keyframe": "INSERT"}
        with pytest.raises(RuntimeError, match="is linked from another file: make it local first"):
            getattr(FACE, name)(**more, **option)
    assert {block.name: block.value for block in blocks(generic_face)} == before
    assert FACE.expression(name="smile", keyframe="NONE") == {"FINISHED"}, "the keys are the artist's own"


def test_driven_keys_stay_with_their_drivers_and_are_named(generic_face: bpy.types.Object) -> None:
    jaw = generic_face.data.shape_keys.key_blocks["jawOpen"]
    jaw.driver_add("value").driver.expression = "0.25"
    said = module("animate.actions").express(generic_face, "surprise", 1.0, "REPLACE", None)
    assert said == "drivers set jawOpen: they stay as they are"
    FACE.expression(name="surprise", keyframe="INSERT")
    assert frames(generic_face, "jawOpen") == [] and frames(generic_face, "jawLeft") == [1.0]
    assert_near(values(generic_face), pose(generic_face, "surprise") | {"jawOpen": 0.25})
    for block in blocks(generic_face):
        block.driver_add("value").driver.expression = "0.5"
    with pytest.raises(RuntimeError, match="drivers set the keys of Face: move what drives them instead"):
        FACE.expression(name="surprise")


def test_a_locked_channel_keeps_its_keyframes_and_is_named(generic_face: bpy.types.Object) -> None:
    keyed(generic_face, {1: "surprise"})
    curve(generic_face, "jawOpen").lock = True
    at(20)
    actions = module("animate.actions")
    keying = actions.keying(bpy.context.scene, generic_face, "INSERT")
    said = actions.express(generic_face, "neutral", 1.0, "REPLACE", keying)
    assert said == "no keyframe of jawOpen: their channels are locked"
    assert frames(generic_face, "jawOpen") == [1.0] and frames(generic_face, "jawLeft") == [1.0, 20.0]
    assert actions.clear(generic_face, "", 1.0) == "the keyframes of jawOpen stay: their channels are locked"
    assert frames(generic_face, "jawOpen") == [1.0] and frames(generic_face, "jawLeft") == [20.0]
    with pytest.raises(module("engine").FacewrightError, match="the keyframes of jawOpen stay"):
        actions.clear(generic_face, "", 1.0)
    with pytest.raises(module("engine").FacewrightError, match="Face has no keyframes of its keys at frame 2.5"):
        actions.clear(generic_face, "", 2.5)


def test_buttons_act_on_the_active_objects_head_alone(clips: Clips) -> None:
    anna, ben = run(clips.anna), run(clips.ben)
    select(next(o for o in anna.children if o["facewright_part"] == "tongue"))
    at(5)
    FACE.expression(name="surprise", keyframe="INSERT")
    assert frames(anna, "jawLeft") == [5.0] and frames(ben, "jawLeft") == []
    assert values(anna)["jawOpen"] > 0.5 and not any(values(ben).values())


def test_a_copied_head_is_keyed_by_itself(clips: Clips) -> None:
    anna = run(clips.anna)
    keyed(anna, {1: "neutral"})
    select(anna, *anna.children)
    assert bpy.ops.object.duplicate() == {"FINISHED"}
    copy = bpy.context.object
    assert copy != anna
    keyed(copy, {20: "surprise"})
    assert frames(copy, "jawOpen") == [1.0, 20.0] and frames(anna, "jawOpen") == [1.0]
    assert values(copy)["jawOpen"] > 0.5 and values(anna)["jawOpen"] == 0.0


def test_a_head_of_a_version_without_keys_is_keyed_as_others(generic_face: bpy.types.Object) -> None:
    for obj in (generic_face, *generic_face.children):
        del obj["facewright_head"]
    del generic_face["facewright_name"]
    keyed(generic_face, {1: "neutral", 20: "happiness"})
    at(20)
    assert_near(values(generic_face), pose(generic_face, "happiness"))
    at(1)
    assert not any(values(generic_face).values())


def test_each_button_is_one_undo_step(generic_face: bpy.types.Object) -> None:
    keyed(generic_face, {1: "smile", 20: "anger"})
    generic_face.data.shape_keys.key_blocks["eyeBlinkLeft"].value = 0.5
    for name, more in (ACTS | {"clear_keyframes": {}}).items():
        bpy.ops.ed.undo_push(message="Before")
        before = state()
        option = {} if "keyframes" in name else {"keyframe": "INSERT"}
        if name == "insert_keyframes":
            bpy.data.objects["Face"].data.shape_keys.key_blocks["jawOpen"].value = 0.3
            bpy.ops.ed.undo_push(message="Moved")
            before = state()
        assert getattr(FACE, name)("EXEC_DEFAULT", True, **more, **option) == {"FINISHED"}
        assert state() != before, name
        bpy.ops.ed.undo()
        assert state() == before, name


def state() -> list[Any]:
    """Values and keyframes of the face."""
    face = bpy.data.objects["Face"]
    curves = module("scene.pose_keys").curves(face.data.shape_keys)
    points = {c.data_path: [tuple(point.co) for point in c.keyframe_points] for c in curves}
    return [{block.name: block.value for block in blocks(face)}, points]


def test_keys_of_one_frame_take_no_time_that_is_felt(generic_face: bpy.types.Object) -> None:
    started = time.perf_counter()
    FACE.expression(name="surprise", keyframe="INSERT")
    FACE.clear_keyframes()
    assert time.perf_counter() - started < 0.1


def test_a_button_forgets_the_options_of_the_press_before(addon: ModuleType) -> None:
    # Without this, Blender gives a property that a button does not set the value of its last use.
    for name, options in {
        "expression": ("strength", "blend", "keyframe"),
        "reset_keys": ("group", "keyframe"),
        "mirror_keys": ("group", "keyframe", "direction"),
        "insert_keyframes": ("group",),
        "clear_keyframes": ("group",),
    }.items():
        operator = getattr(FACE, name).get_rna_type()
        assert all(operator.properties[option].is_skip_save for option in options)
