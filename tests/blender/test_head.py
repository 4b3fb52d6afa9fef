"""The head as objects: parts, keys, drivers, keyframes, a second run."""

import json
import shutil
from pathlib import Path
from types import ModuleType

import bpy
import facewright
import numpy as np
import pytest

PARTS = {"skin", "eye_left", "eye_right", "teeth_upper", "teeth_lower", "tongue", "lashes"}


def parts_of(heads: ModuleType) -> dict[str, bpy.types.Object]:
    """The objects of the one head by their parts."""
    (head,) = heads.heads(bpy.context.scene)
    return head.parts


def evaluated(obj: bpy.types.Object) -> np.ndarray:
    """(n, 3) world vertices with all keys applied."""
    bpy.context.view_layer.update()
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    positions = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", positions)
    return positions.reshape(-1, 3)


def test_parts_keys_and_attributes_are_there(generic_face: bpy.types.Object, heads: ModuleType) -> None:
    objects = parts_of(heads)
    assert set(objects) == PARTS
    assert all(o.parent is generic_face for name, o in objects.items() if name != "skin")
    names = [block.name for block in generic_face.data.shape_keys.key_blocks]
    assert len(names) == 1 + 52 + 15
    assert {"jawOpen", "eyeBlinkLeft", "tongueOut", "viseme_sil", "viseme_U"} <= set(names)
    assert all(len(p.vertices) == 4 for p in generic_face.data.polygons), "quads"
    assert generic_face.data.attributes["generic_position"].data_type == "FLOAT_VECTOR"
    assert generic_face.data.uv_layers["UVMap"] is not None


def test_the_face_looks_along_minus_y_and_is_of_human_size(generic_face: bpy.types.Object) -> None:
    positions = evaluated(generic_face)
    nose = positions[positions[:, 1].argmin()]
    assert abs(nose[0]) < 0.005 and -0.08 < nose[2] < 0.02
    height = np.ptp(positions[:, 2])
    assert 0.25 < height < 0.45


def test_a_key_of_the_face_moves_the_other_parts(generic_face: bpy.types.Object, heads: ModuleType) -> None:
    teeth = parts_of(heads)["teeth_lower"]
    before = evaluated(teeth)
    generic_face.data.shape_keys.key_blocks["jawOpen"].value = 1.0
    assert (evaluated(teeth) - before)[:, 2].mean() < -0.004


@pytest.mark.parametrize("side", ["Left", "Right"])
def test_blinking_brings_the_lids_together(generic_face: bpy.types.Object, side: str) -> None:
    sign = 1 if side == "Left" else -1
    rest = evaluated(generic_face)
    generic_face.data.shape_keys.key_blocks[f"eyeBlink{side}"].value = 1.0
    moved = evaluated(generic_face) - rest
    lids = moved[(rest[:, 0] * sign > 0.015) & (rest[:, 1] < 0)]
    assert lids[:, 2].min() < -0.004, "the upper lid comes down"
    other = moved[(rest[:, 0] * sign < -0.015) & (np.abs(rest[:, 2]) < 0.02) & (rest[:, 1] < -0.012)]
    assert np.abs(other).max() < 5e-4, "the other eye stays open"


def test_keys_can_be_keyframed_and_play_back(generic_face: bpy.types.Object) -> None:
    block = generic_face.data.shape_keys.key_blocks["jawOpen"]
    for frame, value in ((1, 0.0), (11, 1.0)):
        block.value = value
        assert block.keyframe_insert("value", frame=frame)
    action = generic_face.data.shape_keys.animation_data.action
    assert action is not None
    if bpy.app.version >= (4, 4, 0):
        assert generic_face.data.shape_keys.animation_data.action_slot is not None
    bpy.context.scene.frame_set(6)
    assert block.value == pytest.approx(0.5, abs=0.05)
    chin_down = evaluated(generic_face)
    bpy.context.scene.frame_set(1)
    assert (evaluated(generic_face) - chin_down)[:, 2].max() > 0.003


def test_an_expression_sets_its_keys_and_neutral_clears_them(generic_face: bpy.types.Object) -> None:
    blocks = generic_face.data.shape_keys.key_blocks
    assert bpy.ops.facewright.expression(name="happiness") == {"FINISHED"}
    assert blocks["mouthSmileLeft"].value > 0.5
    assert bpy.ops.facewright.expression(name="neutral") == {"FINISHED"}
    assert all(block.value == 0.0 for block in list(blocks)[1:])


def test_auto_keying_inserts_keyframes(generic_face: bpy.types.Object) -> None:
    bpy.context.scene.tool_settings.use_keyframe_insert_auto = True
    bpy.ops.facewright.expression(name="surprise")
    assert generic_face.data.shape_keys.animation_data.action is not None


def test_a_second_run_updates_the_same_objects_and_keeps_animation(
    generic_face: bpy.types.Object, scene_head: ModuleType, heads: ModuleType, engine: ModuleType
) -> None:
    block = generic_face.data.shape_keys.key_blocks["jawOpen"]
    block.value = 0.7
    block.keyframe_insert("value", frame=5)
    generic_face.location.x = 0.5
    count = len(bpy.data.objects)
    again = scene_head.place(bpy.context.scene, engine.generic_head(), head=heads.heads(bpy.context.scene)[0])
    assert again is generic_face and len(bpy.data.objects) == count
    assert generic_face.location.x == 0.5
    assert block.value == pytest.approx(0.7)
    assert generic_face.data.shape_keys.animation_data.action is not None


def test_a_new_face_takes_the_parts_of_a_deleted_one(
    generic_face: bpy.types.Object, scene_head: ModuleType, heads: ModuleType, engine: ModuleType
) -> None:
    parts = parts_of(heads)
    own = parts["tongue"].data.shape_keys.key_blocks["jawOpen"]
    own.driver_remove("value")
    own.driver_add("value").driver.expression = "0.25"
    bpy.data.objects.remove(generic_face)
    face = scene_head.place(bpy.context.scene, engine.generic_head(), head=heads.heads(bpy.context.scene)[0])
    assert parts_of(heads) == parts | {"skin": face}
    assert all(part.parent == face for name, part in parts.items() if name != "skin")
    before = evaluated(parts["teeth_lower"])
    face.data.shape_keys.key_blocks["jawOpen"].value = 1.0
    assert (evaluated(parts["teeth_lower"]) - before)[:, 2].mean() < -0.004
    assert own.value == pytest.approx(0.25), "an artist's own driver stays"


def test_images_are_packed_into_the_file(generic_face: bpy.types.Object) -> None:
    for name in ("Face skin", "Face eyes"):
        assert bpy.data.images[name].packed_file is not None


def test_head_glb_is_imported_with_its_parts_and_keys(engine: ModuleType, tmp_path: Path) -> None:
    if not hasattr(bpy.ops.import_scene, "gltf"):
        pytest.skip("this Blender has no glTF importer")
    head = engine.generic_head()
    head.write(str(tmp_path))
    assert bpy.ops.import_scene.gltf(filepath=str(tmp_path / "head.glb")) == {"FINISHED"}
    assert {o.name for o in bpy.data.objects} == PARTS
    blocks = bpy.data.objects["skin"].data.shape_keys.key_blocks
    assert [block.name for block in blocks] == ["Basis", *(name for name, _, _ in head.keys)]
    assert len(blocks) == 1 + 52 + 15


def test_a_generic_head_needs_no_nets(engine: ModuleType, tmp_path: Path) -> None:
    name = "generic_head.safetensors.gz"
    shutil.copy(Path(engine.assets_folder()) / name, tmp_path / name)
    head = facewright.generic_head(tmp_path)
    assert (head.positions == engine.generic_head().positions).all()


def test_a_report_is_text_and_a_class(engine: ModuleType) -> None:
    head = engine.generic_head()
    assert isinstance(head.report, str) and json.loads(head.report) == json.loads(str(head.parsed_report))
    assert head.parsed_report == engine.Report.parse(head.report) and head.parsed_report.frames == []
