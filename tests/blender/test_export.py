"""A head goes to other programs whole, and the scene stays as it is."""

import json
import math
import shutil
import struct
import subprocess
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import bpy
import numpy as np
import pytest
from conftest import ROOT, snapshot
from exported import FRAMES, MOVED, READERS, animate, apart_mm, everything, paths, read_back, world
from people import PARTS, duplicated, head_of, reopened, select
from tracking import drawn, module

VALIDATOR = ROOT / "target/downloads/gltf-validator-2.0.0-dev.3.10/package"
THREE = ROOT / "target/downloads/three-0.170.0/package"
# The most that a vertex may be off after an export.
ALLOWED_MM = 0.05


@pytest.fixture
def face(generic_face: bpy.types.Object) -> bpy.types.Object:
    """A head that turns and speaks, shown in the middle of it."""
    animate(generic_face)
    bpy.context.scene.frame_set(7)
    return generic_face


def export(file: Path, **options: Any) -> Path:
    """Export the head of the scene, which must not change."""
    before = everything()
    assert bpy.ops.facewright.export(filepath=str(file), **options) == {"FINISHED"}
    assert everything() == before, "the scene is as it was"
    assert not list(file.parent.glob(".facewright*")), "nothing is left in the folder"
    return file


def refused(file: Path, sentence: str, **options: Any) -> None:
    """An export that fails with a sentence, and changes neither scene nor folder."""
    before, files = everything(), sorted(file.parent.rglob("*"))
    with pytest.raises(RuntimeError, match=sentence):
        bpy.ops.facewright.export(filepath=str(file), **options)
    assert everything() == before and sorted(file.parent.rglob("*")) == files


def glb(file: Path) -> dict[str, Any]:
    """The JSON of a GLB."""
    data = file.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + length])


@pytest.mark.parametrize("suffix", READERS)
def test_every_part_moves_in_a_file_as_in_the_scene(face: bpy.types.Object, tmp_path: Path, suffix: str) -> None:
    truth = paths(face)
    names = [block.name for block in face.data.shape_keys.key_blocks]
    found = read_back(export(tmp_path / f"head{suffix}"))
    assert set(found) == {f"Face_{part}" for part in PARTS}
    apart = {part: apart_mm(found[f"Face_{part}"], truth[part]) for part in PARTS}
    assert max(apart.values()) < ALLOWED_MM, apart
    keys = bpy.data.meshes["Face_skin"].shape_keys
    if suffix == ".abc":
        assert keys is None, "Alembic has none"
    else:
        assert sorted(block.name for block in keys.key_blocks[1:]) == sorted(names[1:])


def test_notes_that_stand_before_other_attributes_are_left_out_alone(face: bpy.types.Object, tmp_path: Path) -> None:
    for obj in head_of(face).objects:
        # Edit Mode writes a mesh anew, its attributes in another order.
        select(obj)
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.object.mode_set(mode="OBJECT")
    truth = paths(face)
    found = read_back(export(tmp_path / "head.glb"))
    assert max(apart_mm(found[f"Face_{part}"], truth[part]) for part in PARTS) < ALLOWED_MM


@pytest.mark.parametrize("suffix", READERS)
def test_one_mesh_moves_as_all_parts_do(face: bpy.types.Object, tmp_path: Path, suffix: str) -> None:
    truth = np.concatenate(list(paths(face).values()))
    found = read_back(export(tmp_path / f"head{suffix}", joined=True))
    assert set(found) == {"Face"} and apart_mm(found["Face"], truth) < ALLOWED_MM
    assert len(bpy.data.meshes["Face"].materials) == 5


@pytest.mark.parametrize("suffix", READERS)
def test_a_head_arrives_upright_and_in_true_size(generic_face: bpy.types.Object, tmp_path: Path, suffix: str) -> None:
    bpy.context.scene.unit_settings.scale_length = 0.01
    tall = np.ptp(world(generic_face), axis=0)
    found = read_back(export(tmp_path / f"head{suffix}"))["Face_skin"][:, :3]
    assert np.abs(np.ptp(found, axis=0) - tall).max() < 1e-5 and 0.15 < tall[2] < 0.4
    eyes = world(next(obj for obj in bpy.data.objects if obj.type == "MESH" and "eye_left" in obj.data.name))
    assert eyes[:, 1].mean() < found[:, 1].mean(), "the head looks along -y"


@pytest.mark.parametrize("suffix", [".glb", ".fbx", ".usdc", ".usdz"])
def test_pictures_arrive_with_the_head(face: bpy.types.Object, tmp_path: Path, suffix: str) -> None:
    skin = _picture(face)
    skin.pixels.foreach_set(np.tile(np.array([0.2, 0.4, 0.6, 1.0], np.float32), skin.size[0] * skin.size[1]))
    assert skin.is_dirty, "a stroke that is not packed yet"
    file = export(tmp_path / f"head{suffix}")
    if suffix == ".usdc":
        assert sorted(path.name for path in (tmp_path / "textures").iterdir()) == ["Face_eyes.png", "Face_skin.png"]
    else:
        assert list(tmp_path.iterdir()) == [file], "pictures are inside"
    read_back(file)
    nodes = [node for material in bpy.data.meshes["Face_skin"].materials for node in material.node_tree.nodes]
    (picture,) = {node.image for node in nodes if node.type == "TEX_IMAGE"}
    assert np.allclose(picture.pixels[:3], [0.2, 0.4, 0.6], atol=0.01)
    assert picture.name.startswith("Face_skin")


@pytest.mark.parametrize("suffix", READERS)
def test_no_path_of_the_machine_is_in_a_file(face: bpy.types.Object, tmp_path: Path, suffix: str) -> None:
    (tmp_path / "someone").mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "someone/work.blend"))
    file = export(tmp_path / f"someone/head{suffix}")
    assert b"someone" not in file.read_bytes()
    found = read_back(file)
    assert "Face_skin" in found


@pytest.mark.parametrize("joined", [False, True])
def test_khronos_validator_has_nothing_against_a_glb(face: bpy.types.Object, tmp_path: Path, joined: bool) -> None:
    if shutil.which("node") is None or not VALIDATOR.is_dir():
        pytest.skip("the glTF validator needs node, and what `cargo x test` downloads first")
    file = export(tmp_path / "head.glb", joined=joined)
    script = ROOT / "rust/xtask/node/validate.mjs"
    said = subprocess.run(["node", script, VALIDATOR, file], capture_output=True, text=True, check=False)
    assert said.returncode == 0 and "1 passed, 0 failed" in said.stdout, said.stdout + said.stderr


@pytest.mark.parametrize("joined", [False, True])
def test_three_js_shows_every_part_move(face: bpy.types.Object, tmp_path: Path, joined: bool) -> None:
    if shutil.which("node") is None or not THREE.is_dir():
        pytest.skip(f"reading back in three.js needs node, and three's npm package in {THREE}")
    truth, names = paths(face), [block.name for block in face.data.shape_keys.key_blocks[1:]]
    file, render = export(tmp_path / "head.glb", joined=joined), bpy.context.scene.render
    wanted = [THREE, file, str(render.fps / render.fps_base), *map(str, FRAMES)]
    script = Path(__file__).with_name("three.mjs")
    said = subprocess.run(["node", script, *wanted], capture_output=True, text=True, check=False)
    assert said.returncode == 0, said.stderr
    meshes = json.loads(said.stdout)
    shown = {mesh["name"]: np.concatenate([_upright(frame) for frame in mesh["frames"]], axis=1) for mesh in meshes}
    if joined:
        assert apart_mm(np.concatenate(list(shown.values())), np.concatenate(list(truth.values()))) < ALLOWED_MM
    else:
        assert max(apart_mm(shown[f"Face_{part}"], truth[part]) for part in PARTS) < ALLOWED_MM
    skin = max(meshes, key=lambda mesh: len(mesh["frames"][0]))
    assert skin["keys"] == names and skin["size"] == list(_picture(face).size)


def _upright(flat: list[float]) -> Any:
    """(n, 3) positions with z up of such with y up."""
    x, y, z = np.array(flat).reshape(-1, 3).T
    return np.stack([x, -z, y], axis=1)


def _picture(obj: bpy.types.Object) -> bpy.types.Image:
    return next(node.image for node in obj.data.materials[0].node_tree.nodes if node.type == "TEX_IMAGE")


def test_a_glb_has_one_animation_of_all_parts_that_move(face: bpy.types.Object, tmp_path: Path) -> None:
    moving = {name for name, part in head_of(face).parts.items() if _names(part) & set(MOVED)}
    assert {"skin", "teeth_lower", "tongue", "lashes", "eye_left"} <= moving
    content = glb(export(tmp_path / "head.glb"))
    (animation,) = content["animations"]
    moved = {content["nodes"][channel["target"]["node"]]["name"] for channel in animation["channels"]}
    assert {f"Face_{name}" for name in moving} <= moved


def _names(obj: bpy.types.Object) -> set[str]:
    return {block.name for block in obj.data.shape_keys.key_blocks}


@pytest.mark.parametrize("suffix", READERS)
def test_what_is_not_keyed_yet_stays(face: bpy.types.Object, tmp_path: Path, suffix: str) -> None:
    blocks = face.data.shape_keys.key_blocks
    blocks["jawOpen"].value, face.location.x, face.rotation_euler.z = 0.77, 3.0, 1.5
    export(tmp_path / f"head{suffix}")
    bpy.context.view_layer.update()
    assert blocks["jawOpen"].value == pytest.approx(0.77) and face.location.x == 3.0
    assert head_of(face).parts["teeth_lower"].data.shape_keys.key_blocks["jawOpen"].value == pytest.approx(0.77)
    assert face.rotation_euler.z == 1.5 and face.matrix_world.translation.x == 3.0


def test_without_animation_a_head_is_written_as_it_is_now(face: bpy.types.Object, tmp_path: Path) -> None:
    face.data.shape_keys.key_blocks["cheekPuff"].value = 0.8
    face.data.shape_keys.key_blocks["jawOpen"].value = 0.77
    bpy.context.view_layer.update()
    truth = {name: world(part) for name, part in head_of(face).parts.items()}
    for suffix in (".glb", ".fbx", ".abc"):
        export(tmp_path / f"head{suffix}", animation=False)
    assert "animations" not in glb(tmp_path / "head.glb")
    for suffix in (".glb", ".fbx", ".abc"):
        found = read_back(tmp_path / f"head{suffix}")
        apart = {part: apart_mm(found[f"Face_{part}"][:, :3], truth[part]) for part in PARTS}
        assert max(apart.values()) < ALLOWED_MM, (suffix, apart)


def test_the_frames_are_those_of_the_animation_or_those_asked_for(face: bpy.types.Object, tmp_path: Path) -> None:
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 5, 12
    rate = scene.render.fps / scene.render.fps_base
    for options, first, last in (
        ({}, 1, 40),
        ({"range": "SCENE"}, 5, 12),
        ({"range": "CUSTOM", "first": 10, "last": 30}, 10, 30),
    ):
        content = glb(export(tmp_path / "head.glb", **options))
        samplers = [content["accessors"][s["input"]] for s in content["animations"][0]["samplers"]]
        assert min(s["min"][0] for s in samplers) == pytest.approx(first / rate, abs=1e-4)
        assert max(s["max"][0] for s in samplers) == pytest.approx(last / rate, abs=1e-4)
    refused(tmp_path / "head.glb", "the last frame, 3, is before the first, 9", range="CUSTOM", first=9, last=3)


def test_what_carries_a_head_moves_it_in_the_file(generic_face: bpy.types.Object, tmp_path: Path) -> None:
    """As a solved motion does, by a constraint to an Empty that is animated."""
    carrier = bpy.data.objects.new("Carrier", None)
    bpy.context.collection.objects.link(carrier)
    constraint = generic_face.constraints.new("COPY_TRANSFORMS")
    constraint.target = carrier
    for frame, x in zip(FRAMES, (0.0, 0.3, 0.1)):
        carrier.location.x = x
        carrier.keyframe_insert("location", frame=frame)
    truth = paths(generic_face)
    assert np.ptp(truth["skin"][0, ::3]) > 0.2
    found = read_back(export(tmp_path / "head.glb"))
    assert max(apart_mm(found[f"Face_{part}"], truth[part]) for part in PARTS) < ALLOWED_MM


def test_keys_of_the_artist_are_written_as_they_work(face: bpy.types.Object, tmp_path: Path) -> None:
    """One limited to a vertex group, one relative to another key, one muted."""
    blocks = face.data.shape_keys.key_blocks
    half = face.vertex_groups.new(name="half")
    half.add(range(0, len(face.data.vertices), 2), 0.5, "REPLACE")
    blocks["jawOpen"].vertex_group = "half"
    blocks["mouthFunnel"].relative_key = blocks["jawOpen"]
    blocks["eyeBlinkLeft"].mute = True
    truth = paths(face)["skin"]
    assert apart_mm(read_back(export(tmp_path / "head.glb"))["Face_skin"], truth) < ALLOWED_MM


def test_modifiers_are_in_an_alembic_and_left_out_elsewhere(
    face: bpy.types.Object, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    face.modifiers.new("Thicker", "SOLIDIFY").thickness = 0.01
    truth = paths(face)["skin"]
    export(tmp_path / "head.abc")
    assert "left out" not in capfd.readouterr().out
    export(tmp_path / "head.glb")
    assert "left out, as only Alembic takes them: modifiers Thicker" in capfd.readouterr().out
    assert len(truth) == 2 * len(face.data.vertices)
    assert apart_mm(read_back(tmp_path / "head.abc")["Face_skin"], truth) < ALLOWED_MM


def test_names_are_such_that_every_engine_takes_them(face: bpy.types.Object, tmp_path: Path) -> None:
    identifier = module("scene.export_names").identifier
    assert [identifier(name) for name in ("Zoë Müller.001", "3 Brüder", "顔")] == [
        "Zoe_Muller_001",
        "_3_Bruder",
        "Head",
    ]
    face.name = "Zoë Müller"
    for name in ("Zoe_Muller", "Zoe_Muller_skin", "Zoe_Muller_tongue"):
        taken = bpy.data.objects.new(name, bpy.data.meshes.new(name))
        bpy.context.collection.objects.link(taken)
    content = glb(export(tmp_path / "head.glb"))
    assert {node["name"] for node in content["nodes"]} == {"Zoe_Muller", *(f"Zoe_Muller_{part}" for part in PARTS)}
    assert {mesh["name"] for mesh in content["meshes"]} == {f"Zoe_Muller_{part}" for part in PARTS}


def test_materials_and_pictures_of_like_names_stay_apart(face: bpy.types.Object, tmp_path: Path) -> None:
    """`Face skin` and `Face_skin` would be one name."""
    tongue = head_of(face).parts["tongue"].data.materials[0]
    tongue.name = "Face_skin"
    texture = tongue.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image = bpy.data.images.new("Face_skin", 8, 8)
    texture.image.pack()
    shader = next(node for node in tongue.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    tongue.node_tree.links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    content = glb(export(tmp_path / "head.glb"))
    titles = {"Face_skin", "Face_skin_1", "Face_eyes", "Face_teeth", "Face_lashes"}
    assert {material["name"] for material in content["materials"]} == titles
    assert {picture["name"] for picture in content["images"]} == {"Face_skin", "Face_skin_1", "Face_eyes"}
    export(tmp_path / "head.usdc")
    assert len(list((tmp_path / "textures").iterdir())) == 3


def test_the_head_of_the_active_object_is_exported_hidden_parts_included(
    face: bpy.types.Object, tmp_path: Path
) -> None:
    copies = duplicated(*head_of(face).objects)
    other = copies["skin"]
    other.name = "Other"
    other.location.x += 1.0
    copies["tongue"].hide_viewport = True
    copies["lashes"].hide_set(True)
    select(copies["teeth_upper"])
    content = glb(export(tmp_path / "head.glb"))
    assert {node["name"] for node in content["nodes"]} == {"Other", *(f"Other_{part}" for part in PARTS)}
    found = read_back(tmp_path / "head.glb")
    tongue = found["Other_tongue"].reshape(-1, len(FRAMES), 3)
    assert np.abs(np.diff(tongue, axis=1)).max() > 0.01, "it moves though it is hidden"


def test_a_linked_head_is_exported(face: bpy.types.Object, tmp_path: Path) -> None:
    truth = paths(face)
    reopened(tmp_path / "library.blend")
    home = head_of(bpy.data.objects["Face"]).home.name
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.collections = [home]
    bpy.context.scene.collection.children.link(bpy.data.collections[home])
    (tmp_path / "out").mkdir()
    found = read_back(export(tmp_path / "out/head.fbx"))
    assert max(apart_mm(found[f"Face_{part}"], truth[part]) for part in PARTS) < ALLOWED_MM


def test_a_file_that_is_there_is_replaced_whole_or_not_at_all(
    face: bpy.types.Object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "head.glb"
    file.write_bytes(b"older")
    write = module("scene.export_write")

    def broken(path: str, copy: Any, _animated: bool) -> set[str]:
        Path(path).write_bytes(b"half")
        bpy.data.objects.new("left behind", None)
        copy.scene.frame_set(33)
        raise RuntimeError("Error: Python: Traceback\nMemoryError: no room")

    with monkeypatch.context() as patch:
        patch.setitem(write.WRITERS, "glTF", broken)
        refused(file, "Blender could not write .*head.glb: MemoryError: no room")
    assert file.read_bytes() == b"older"
    export(file)
    assert glb(file)["asset"]["version"] == "2.0"


def test_what_cannot_be_one_mesh_gets_a_sentence(face: bpy.types.Object, tmp_path: Path) -> None:
    tongue = head_of(face).parts["tongue"]
    tongue.location.z = 0.01
    tongue.keyframe_insert("location", frame=1)
    tongue.location.z = 0.02
    tongue.keyframe_insert("location", frame=30)
    refused(tmp_path / "a.glb", "Face tongue moves against Face, as one mesh cannot: export without One", joined=True)
    export(tmp_path / "a.glb")
    tongue.animation_data_clear()
    key = tongue.data.shape_keys.key_blocks["tongueOut"]
    key.driver_remove("value")
    key.value = 0.4
    refused(tmp_path / "b.glb", "shape key tongueOut of Face tongue does not follow Face's", joined=True)


def test_what_cannot_be_exported_gets_a_sentence(face: bpy.types.Object, tmp_path: Path) -> None:
    refused(tmp_path / "head.obj", r"head.obj has no ending that says its format: choose one of \.glb, \.fbx, ")
    refused(tmp_path / "head", "head has no ending that says its format")
    refused(tmp_path / "none/head.glb", "none is not a folder: choose another place")
    (tmp_path / "folder.glb").mkdir()
    refused(tmp_path / "folder.glb", "folder.glb is a folder: choose another name")
    face.data.shape_keys.use_relative = False
    refused(tmp_path / "head.glb", "shape keys of the head are absolute")


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="a folder that not even root can write to is Linux'")
def test_a_folder_that_cannot_be_written_to_gets_a_sentence(face: bpy.types.Object) -> None:
    before = everything()
    with pytest.raises(RuntimeError, match=r"/proc/head.glb cannot be written: "):
        bpy.ops.facewright.export(filepath="/proc/head.glb")
    assert everything() == before


def test_a_picture_that_is_gone_gets_a_sentence(face: bpy.types.Object, tmp_path: Path) -> None:
    node = next(node for node in face.data.materials[0].node_tree.nodes if node.type == "TEX_IMAGE")
    node.image = bpy.data.images.new("gone", 8, 8)
    node.image.source, node.image.filepath = "FILE", str(tmp_path / "gone.png")
    refused(tmp_path / "head.glb", "the picture gone cannot be read: find it, or take it out of the material")


def test_without_the_add_on_of_a_format_that_is_said(face: bpy.types.Object, tmp_path: Path) -> None:
    bpy.ops.preferences.addon_disable(module="io_scene_fbx")
    try:
        refused(tmp_path / "head.fbx", "this Blender has no FBX exporter: turn on the FBX add-on in the Preferences")
    finally:
        bpy.ops.preferences.addon_enable(module="io_scene_fbx")
    export(tmp_path / "head.fbx")


def test_a_blender_that_was_built_without_a_format_gets_another_remedy(
    face: bpy.types.Object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(module("scene.export_write").EXPORTERS, "USD", ("wm", "usd_export_of_another_build"))
    refused(tmp_path / "head.usdc", "this Blender was built without its USD exporter: export GLB or FBX")


def test_the_button_is_for_heads_in_object_mode(tmp_path: Path) -> None:
    before = snapshot()
    with pytest.raises(RuntimeError, match="Reconstruct a face first"):
        bpy.ops.facewright.export(filepath=str(tmp_path / "head.glb"))
    assert snapshot() == before
    face = module("scene.head").place(bpy.context.scene, module("engine").generic_head())
    assert bpy.ops.facewright.export.poll()
    drawn("FACEWRIGHT_PT_export")
    select(face)
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(RuntimeError, match="Go to Object Mode first"):
        bpy.ops.facewright.export(filepath=str(tmp_path / "head.glb"))
    bpy.ops.object.mode_set(mode="OBJECT")


def test_the_proposed_name_follows_the_format() -> None:
    actions = module("export.actions")
    assert actions.with_suffix("/a/anna.glb", ".fbx") == "/a/anna.fbx"
    assert actions.with_suffix("/a/anna.v2", ".fbx") == "/a/anna.v2.fbx"
    assert actions.is_known("/a/anna.GLB") and not actions.is_known("/a/anna.obj")


def test_the_file_browsers_name_follows_a_format_that_is_chosen_and_no_ending_that_is_written() -> None:
    check = module("export.operators").FACEWRIGHT_OT_export.check
    dialog = SimpleNamespace(filepath="/a/anna.glb", format=".glb", _format=".glb")
    assert not check(dialog, None) and dialog.filepath == "/a/anna.glb"
    dialog.format = ".fbx"
    assert check(dialog, None) and dialog.filepath == "/a/anna.fbx"
    dialog.filepath = "/a/anna.usda"
    assert not check(dialog, None) and dialog.filepath == "/a/anna.usda"
    dialog.filepath = "/a/ben"
    assert check(dialog, None) and dialog.filepath == "/a/ben.fbx"


@pytest.mark.parametrize("suffix", [".glb", ".fbx"])
def test_undo_after_an_export_takes_back_what_was_done_before_it(
    face: bpy.types.Object, tmp_path: Path, suffix: str
) -> None:
    blocks = face.data.shape_keys.key_blocks
    blocks["cheekPuff"].value = 0.2
    bpy.ops.ed.undo_push(message="a little")
    blocks["cheekPuff"].value = 0.9
    bpy.ops.ed.undo_push(message="much")
    export(tmp_path / f"head{suffix}")
    bpy.ops.ed.undo()
    back = bpy.data.objects["Face"]
    assert back.data.shape_keys.key_blocks["cheekPuff"].value == pytest.approx(0.2)
    assert [scene.name for scene in bpy.data.scenes] == ["Scene"] and set(head_of(back).parts) == PARTS
    bpy.ops.ed.redo()
    assert bpy.data.objects["Face"].data.shape_keys.key_blocks["cheekPuff"].value == pytest.approx(0.9)


def test_a_turned_head_is_turned_in_the_file(generic_face: bpy.types.Object, tmp_path: Path) -> None:
    generic_face.rotation_euler.z, generic_face.scale = math.radians(90.0), (2.0, 2.0, 2.0)
    bpy.context.view_layer.update()
    truth = world(generic_face)
    found = read_back(export(tmp_path / "head.fbx", joined=True))["Face"][:, :3]
    assert np.abs(found.max(axis=0) - truth.max(axis=0)).max() < 1e-4, "turned, and twice as large"


def test_a_path_with_the_other_systems_slashes_is_taken_out_of_a_file_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written = module("scene.export_write")
    monkeypatch.setattr(written.os, "sep", "\\")
    file = tmp_path / "head.fbx"
    for folder in (b"C:\\Users\\Anna\\Temp\\", b"C:/Users/Anna/Temp/"):
        file.write_bytes(b"\x15" + folder + b"head.png\x00")
        written._forget("C:\\Users\\Anna\\Temp", file)
        assert b"Anna" not in file.read_bytes() and len(file.read_bytes()) == len(folder) + 10
