"""Neck and head turn the mesh, and the eyes look at their target."""

from typing import Any

import bpy
import numpy as np
import pytest
from controlled import add, armature, bone, largest, over, remove, target
from people import evaluated, head_of
from test_keys import FACE, at, blocks, values
from tracking import module


@pytest.fixture
def face(generic_face: bpy.types.Object) -> bpy.types.Object:
    """A head with controls."""
    add(generic_face)
    return generic_face


def centre_and_gaze(eye: bpy.types.Object) -> tuple[Any, Any]:
    """Where an eye is, and where it looks, as it was turned from looking forward: from its mesh alone."""
    measure = module("scene.controls_measure")
    rest = measure.positions(eye, 0)
    # Its keys turn about this place: a sphere through its vertices has it.
    fitted, *_ = np.linalg.lstsq(np.c_[2.0 * rest, np.ones(len(rest))], (rest**2).sum(axis=1), rcond=None)
    centre = fitted[:3]
    now = evaluated(eye).astype(np.float64)
    ahead = rest[:, 1] < centre[1] - 0.8 * (centre[1] - rest[:, 1].min())
    # What was ahead of the middle of the eye is where it looks now.
    turn = (now[ahead] - centre).mean(axis=0)
    was = (rest[ahead] - centre).mean(axis=0)
    across = np.arctan2(turn[0], -turn[1]) - np.arctan2(was[0], -was[1])
    up = np.arctan2(turn[2], np.hypot(*turn[:2])) - np.arctan2(was[2], np.hypot(*was[:2]))
    return centre, (np.degrees(across), np.degrees(up))


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


def test_limits_of_keys_are_given_back(generic_face: bpy.types.Object) -> None:
    generic_face.data.shape_keys.key_blocks["eyeLookUpLeft"].slider_max = 1.5
    limits = {block.name: block.slider_max for block in blocks(generic_face)}
    add(generic_face)
    FACE.expression(name="surprise", blend="ADD")
    FACE.expression(name="surprise", blend="ADD")
    assert all(value <= limits[name] + 1e-6 for name, value in values(generic_face).items())
    remove(generic_face)
    assert {block.name: block.slider_max for block in blocks(generic_face)} == limits


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
