"""A head with controls goes to other programs with the bones that move it, and without its handles."""

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from conftest import ROOT
from controlled import add, armature, bone
from exported import FRAMES, READERS, animate, apart_mm, everything, paths, read_back, world
from people import PARTS, head_of
from test_export import THREE, VALIDATOR
from test_export import _upright as upright
from tracking import module

# The most that a vertex may be off after an export.
ALLOWED_MM = 0.1
BONES = {"root", "neck", "head"}


@pytest.fixture
def face(generic_face: bpy.types.Object) -> bpy.types.Object:
    """A head that turns as a whole and by its neck, and speaks by its handles."""
    animate(generic_face)
    add(generic_face)
    bpy.ops.object.mode_set(mode="OBJECT")
    for frame, yaw, nod in ((1, 0.0, 0.0), (20, 0.6, 0.3), (40, -0.4, -0.2)):
        for role, share in (("neck", 0.4), ("head", 0.6)):
            found = bone(generic_face, role)
            found.rotation_euler = (share * nod, share * yaw, 0.1 * yaw)
            found.keyframe_insert("rotation_euler", frame=frame)
        jaw = bone(generic_face, "jaw_master")
        jaw.rotation_euler[0] = 0.4 * nod
        jaw.keyframe_insert("rotation_euler", index=0, frame=frame)
    bpy.context.scene.frame_set(7)
    return generic_face


def export(file: Path, **options: Any) -> Path:
    """Export the head of the scene, which must not change."""
    before = everything()
    assert bpy.ops.facewright.export(filepath=str(file), **options) == {"FINISHED"}
    assert everything() == before, "the scene is as it was"
    return file


@pytest.mark.parametrize("suffix", READERS)
def test_a_head_with_bones_moves_in_a_file_as_in_the_scene(face: bpy.types.Object, tmp_path: Path, suffix: str) -> None:
    truth = paths(face)
    found = read_back(export(tmp_path / f"head{suffix}"))
    assert set(found) == {f"Face_{part}" for part in PARTS}
    apart = {part: apart_mm(found[f"Face_{part}"], truth[part]) for part in PARTS}
    assert max(apart.values()) < ALLOWED_MM, apart
    rigs = [obj for obj in bpy.data.objects if obj.type == "ARMATURE"]
    if suffix != ".abc":
        (rig,) = rigs
        assert {b.name for b in rig.data.bones} == BONES, "no handle is in the file"
        assert bpy.data.meshes["Face_skin"].shape_keys is not None
    assert not [mesh for mesh in bpy.data.meshes if mesh.name.startswith("Controls")]


@pytest.mark.parametrize("suffix", READERS)
def test_one_mesh_with_bones_moves_as_all_parts_do(face: bpy.types.Object, tmp_path: Path, suffix: str) -> None:
    truth = np.concatenate(list(paths(face).values()))
    found = read_back(export(tmp_path / f"head{suffix}", joined=True))
    assert set(found) == {"Face"} and apart_mm(found["Face"], truth) < ALLOWED_MM


@pytest.mark.parametrize("joined", [False, True])
def test_three_js_moves_a_head_with_bones_as_the_scene_does(
    face: bpy.types.Object, tmp_path: Path, joined: bool
) -> None:
    if shutil.which("node") is None or not THREE.is_dir():
        pytest.skip(f"reading back in three.js needs node, and three's npm package in {THREE}")
    truth = paths(face)
    file, render = export(tmp_path / "head.glb", joined=joined), bpy.context.scene.render
    script = Path(__file__).with_name("three.mjs")
    wanted = [THREE, file, str(render.fps / render.fps_base), *map(str, FRAMES)]
    said = subprocess.run(["node", script, *wanted], capture_output=True, text=True, check=False)
    assert said.returncode == 0, said.stderr
    shown = {m["name"]: np.concatenate([upright(f) for f in m["frames"]], axis=1) for m in json.loads(said.stdout)}
    if joined:
        assert apart_mm(np.concatenate(list(shown.values())), np.concatenate(list(truth.values()))) < ALLOWED_MM
    else:
        assert max(apart_mm(shown[f"Face_{part}"], truth[part]) for part in PARTS) < ALLOWED_MM


def test_khronos_validator_has_nothing_against_a_head_with_bones(face: bpy.types.Object, tmp_path: Path) -> None:
    if shutil.which("node") is None or not VALIDATOR.is_dir():
        pytest.skip("the glTF validator needs node, and what `cargo x test` downloads first")
    file = export(tmp_path / "head.glb")
    script = ROOT / "rust/xtask/node/validate.mjs"
    said = subprocess.run(["node", script, VALIDATOR, file], capture_output=True, text=True, check=False)
    assert said.returncode == 0 and "1 passed, 0 failed" in said.stdout, said.stdout + said.stderr


def test_joints_alone_place_the_meshes_of_a_glb(face: bpy.types.Object, tmp_path: Path) -> None:
    content = export(tmp_path / "head.glb").read_bytes()
    length = int.from_bytes(content[12:16], "little")
    tree = json.loads(content[20 : 20 + length])
    skinned = {number for number, node in enumerate(tree["nodes"]) if "skin" in node}
    carried = {child for node in tree["nodes"] for child in node.get("children", ())}
    assert len(skinned) == len(PARTS) and not skinned & carried and skinned <= set(tree["scenes"][0]["nodes"])
    assert int.from_bytes(content[8:12], "little") == len(content) and length % 4 == 0


@pytest.mark.parametrize("suffix", READERS)
def test_a_still_head_has_its_unkeyed_pose(face: bpy.types.Object, tmp_path: Path, suffix: str) -> None:
    bone(face, "head").rotation_euler[1] = 0.5
    bpy.context.view_layer.update()
    truth = {name: world(part) for name, part in head_of(face).parts.items()}
    file = export(tmp_path / f"head{suffix}", animation=False)
    assert bone(face, "head").rotation_euler[1] == pytest.approx(0.5), "what is not keyed yet stays"
    found = read_back(file)
    apart = {part: apart_mm(found[f"Face_{part}"][:, :3], truth[part]) for part in PARTS}
    assert max(apart.values()) < ALLOWED_MM, apart


def test_the_bind_pose_is_the_head_at_rest(face: bpy.types.Object, tmp_path: Path) -> None:
    rests = {b.name: np.array(b.matrix_local) for b in armature(face).data.bones if b.use_deform}
    read_back(export(tmp_path / "head.glb"))
    (rig,) = (obj for obj in bpy.data.objects if obj.type == "ARMATURE")
    for name, rest in rests.items():
        assert np.abs(np.array(rig.data.bones[name].matrix_local)[:3, 3] - rest[:3, 3]).max() < 1e-5


def test_a_part_that_moves_by_itself_and_by_bones_is_refused(face: bpy.types.Object, tmp_path: Path) -> None:
    tongue = head_of(face).parts["tongue"]
    for frame, place in ((1, 0.0), (20, 0.01)):
        tongue.location.x = place
        tongue.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_set(7)
    before = everything()
    with pytest.raises(RuntimeError, match="Face tongue moves against Face and follows bones too"):
        bpy.ops.facewright.export(filepath=str(tmp_path / "head.glb"))
    assert everything() == before and not list(tmp_path.iterdir())
    assert module("scene.export_sample").animated_range(head_of(face)) == (1, 40)
