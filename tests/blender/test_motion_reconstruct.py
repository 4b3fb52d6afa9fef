"""A head that is reconstructed when its scene has a motion already; the library has a stand-in."""

from pathlib import Path
from types import ModuleType

import bpy
import pytest
from conftest import snapshot
from moving import assert_follows, places, show, solution
from tracking import CLIP, Finished, module


@pytest.fixture(autouse=True)
def reconstructor(monkeypatch: pytest.MonkeyPatch, engine: ModuleType) -> None:
    """Lets the library reconstruct the generic head from any frames."""
    head = engine.generic_head()
    monkeypatch.setattr(module("reconstruct.actions"), "reconstruct", lambda _frames, **_settings: Finished(head))


def reconstruct() -> bpy.types.Object:
    bpy.context.scene.facewright_clip.path = str(CLIP / "frames")
    assert bpy.ops.facewright.reconstruct() == {"FINISHED"}
    return bpy.data.objects["Face"]


def test_a_head_made_after_the_motion_follows_at_once(clip: bpy.types.MovieClip) -> None:
    show(clip, solution(), "HEAD")
    assert_follows(reconstruct())


def test_a_further_reconstruction_goes_on_following(clip: bpy.types.MovieClip) -> None:
    show(clip, solution(), "HEAD")
    face = reconstruct()
    face.location, face.constraints[0].influence = (0.3, 0.0, 0.0), 0.5
    assert reconstruct() == face and face.constraints[0].influence == 0.5
    face.constraints[0].influence = 1.0
    assert_follows(face)
    face.constraints.clear()
    assert_follows(reconstruct())
    assert face.location[:] == pytest.approx((0.3, 0.0, 0.0)), "its own place"


def test_a_head_that_shall_not_follow_stands(clip: bpy.types.MovieClip) -> None:
    show(clip, solution(), "HEAD", follow=False)
    for _ in range(2):
        face = reconstruct()
        assert len(face.constraints) == 0 and face.matrix_world.is_identity
    bpy.context.scene.facewright_motion.follow = True
    assert_follows(face)
    bpy.context.scene.facewright_motion.follow = False
    assert len(reconstruct().constraints) == 0


@pytest.mark.parametrize("kind", ["CAMERA", "CAMERAS"])
def test_a_new_head_comes_to_where_the_motion_stands(clip: bpy.types.MovieClip, kind: str) -> None:
    show(clip, solution(), kind)
    empty = bpy.data.objects["Face Head"]
    empty.location, empty.rotation_euler, empty.scale = (0.3, -1.2, 0.5), (0.2, -0.4, 1.0), (2.0, 2.0, 2.0)
    eyes = [obj.name for obj in bpy.context.scene.objects if obj.type == "CAMERA"]
    before = places("Face Head", "Face Points", *eyes)
    face = reconstruct()
    assert places("Face Head", "Face Points", *eyes) == before and len(face.constraints) == 0
    for place in places("Face", "Face tongue"):
        assert place == pytest.approx(before[0], abs=1e-6)


def test_a_head_that_was_there_stays_where_it_was_put(clip: bpy.types.MovieClip) -> None:
    show(clip, solution())
    face = reconstruct()
    face.location = (0.4, 0.1, 0.0)
    bpy.data.objects["Face Head"].location = (-0.2, 0.0, 0.3)
    before = places("Face", "Face Head", "Face Camera")
    assert reconstruct() == face and places("Face", "Face Head", "Face Camera") == before


def test_after_a_motion_was_removed_a_new_head_stands_in_the_middle(clip: bpy.types.MovieClip) -> None:
    show(clip, solution(), "HEAD")
    bpy.data.objects["Face Camera"].location = (2.0, 0.0, 0.0)
    assert bpy.ops.facewright.remove_motion() == {"FINISHED"}
    face = reconstruct()
    assert face.matrix_world.is_identity and len(face.constraints) == 0


@pytest.mark.parametrize("kind", ["HEAD", "CAMERA"])
def test_one_undo_step_takes_the_head_and_not_the_motion(clip: bpy.types.MovieClip, kind: str) -> None:
    show(clip, solution(), kind)
    bpy.context.scene.facewright_clip.path = str(CLIP / "frames")
    bpy.ops.ed.undo_push(message="Before")
    before, stood = snapshot(), places("Face Head", "Face Camera")
    bpy.ops.facewright.reconstruct("EXEC_DEFAULT", True)
    assert len(bpy.data.objects["Face"].constraints) == (kind == "HEAD")
    bpy.ops.ed.undo()
    assert snapshot() == before and places("Face Head", "Face Camera") == stood
    bpy.ops.ed.redo()
    assert len(bpy.data.objects["Face"].constraints) == (kind == "HEAD")


def test_the_shell_command_lets_the_head_follow_the_motion_of_its_scene(
    clip: bpy.types.MovieClip, tmp_path: Path
) -> None:
    show(clip, solution(), "HEAD")
    out, blend = str(tmp_path / "out"), str(tmp_path / "scene.blend")
    assert module("cli").run(["reconstruct", str(CLIP / "frames"), "-o", out, "--blend", blend]) == 0
    bpy.ops.wm.open_mainfile(filepath=blend)
    assert_follows(bpy.data.objects["Face"])
