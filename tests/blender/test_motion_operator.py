"""The motion's buttons, panels and shell command, with a stand-in for the library; bad input gets a sentence."""

import json
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import bpy
import numpy as np
import pytest
from conftest import snapshot
from moving import parsed, projected, saved, seen, show, solution
from tracking import CLIP, NAMES, TRUTH, Finished, drawn, in_editor, made_up, module, place, read, same, written

Asked = list[dict[str, Any]]


@pytest.fixture
def solver(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Asked]:
    """Lets the library find the motion of the truth; tells what it was asked."""

    def install(fails: Exception | None = None, **more: Any) -> Asked:
        asked: Asked = []

        def solve_motion(tracks: Any, **settings: Any) -> Finished:
            asked.append({"tracks": json.loads(str(tracks))} | settings)
            return Finished(parsed(solution(**more)), fails)

        monkeypatch.setattr(module("motion.actions"), "solve_motion", solve_motion)
        return asked

    return install


def test_the_button_solves_from_the_tracks_as_they_are(tracked: bpy.types.MovieClip, solver: Any) -> None:
    asked = solver()
    tracked.tracking.objects["Face"].tracks["FW skin 0000"].markers[3].mute = True
    assert bpy.ops.facewright.motion() == {"FINISHED"}
    (question,) = asked
    assert question["tracks"] == read(tracked)
    assert {key: question[key] for key in ("camera", "interocular_mm", "lengths")} == {
        "camera": None,
        "interocular_mm": None,
        "lengths": [],
    }
    assert np.abs(seen(10) - projected(solution(), 9)).max() < 0.01


def test_what_was_measured_is_given_to_the_library(tracked: bpy.types.MovieClip, solver: Any) -> None:
    asked, scene = solver(), bpy.context.scene
    scene.facewright_camera.text = json.dumps(TRUTH["camera"])
    scene.facewright_person.use_interocular, scene.facewright_person.interocular_mm = True, 61.0
    face = tracked.tracking.objects["Face"]
    own = face.tracks.new(name="Left ear", frame=3)
    own.markers[0].co = (0.2, 0.5)
    for track in face.tracks:
        track.select = track.name in ("FW eyes 0002", "Left ear")
    assert bpy.ops.facewright.length_from_selection() == {"FINISHED"}
    scene.facewright_motion.length_mm = 98.5
    assert bpy.ops.facewright.motion() == {"FINISHED"}
    assert json.loads(asked[0]["camera"]) == TRUTH["camera"] and asked[0]["interocular_mm"] == 61.0
    assert asked[0]["lengths"] == [(2, 12, 98.5)], "the artist's own track has the number that the library reads"


def test_solving_is_one_undo_step(tracked: bpy.types.MovieClip, solver: Any) -> None:
    solver()
    bpy.ops.ed.undo_push(message="Before")
    before = snapshot()
    bpy.ops.facewright.motion("EXEC_DEFAULT", True)
    made = snapshot()
    bpy.ops.facewright.motion("EXEC_DEFAULT", True)
    assert snapshot() == made != before
    bpy.ops.ed.undo()
    assert snapshot() == made
    bpy.ops.ed.undo()
    assert snapshot() == before and not bpy.ops.facewright.save_motion.poll()


def test_looking_through_sets_camera_size_and_view(clip: bpy.types.MovieClip) -> None:
    scene = bpy.context.scene
    show(clip, solution(), "CAMERAS", key_turn=0.0)
    scene.camera, scene.render.resolution_x, scene.render.resolution_y = None, 1920, 1080
    area = bpy.context.window_manager.windows[0].screen.areas[0]
    area.type = "VIEW_3D"
    scene.frame_set(12)
    scene.camera = None
    assert bpy.ops.facewright.look_through() == {"FINISHED"}
    assert scene.camera == bpy.data.objects["Face Camera 0012"]
    assert (scene.render.resolution_x, scene.render.resolution_y) == (400, 300)
    assert area.spaces.active.region_3d.view_perspective == "CAMERA"
    for eye in [obj for obj in scene.objects if obj.type == "CAMERA"]:
        bpy.data.objects.remove(eye)
    with pytest.raises(RuntimeError, match="solve it again"):
        bpy.ops.facewright.look_through()


def pose(rows: Any) -> dict[str, Any]:
    content = solution()
    content["frames"][6]["cam_from_head"] = rows
    return content


BAD = {
    "no motion": ({"cameras": []}, "cannot be read: it holds no motion"),
    "a broken pose": (pose([[1.0] * 4] * 4), "of frame frame_06 is not a rotation"),
    "another size": (solution(camera=TRUTH["camera"] | {"width": 640}), "640 × 300, but frame_00.jpg is 400 × 300"),
    "other frames": (solution(names=[f"x{k}" for k in range(9)]), "have 9 frames, frame_00.jpg has 21"),
    "no pose": (solution(frames=[]), "none of its frames has a pose"),
}


@pytest.mark.parametrize("kind", BAD)
@pytest.mark.parametrize("with_motion", [False, True])
def test_broken_files_get_a_sentence_and_change_nothing(
    clip: bpy.types.MovieClip, tmp_path: Path, kind: str, with_motion: bool
) -> None:
    content, sentence = BAD[kind]
    if with_motion:
        show(clip, solution())
    before, text = snapshot(), module("scene.motion_record").text(bpy.context.scene)
    with pytest.raises(RuntimeError, match=sentence):
        bpy.ops.facewright.open_motion(filepath=saved(content, tmp_path))
    assert snapshot() == before and module("scene.motion_record").text(bpy.context.scene) == text


def test_bad_clips_and_lengths_get_a_sentence_and_change_nothing(
    tracked: bpy.types.MovieClip, solver: Any, tmp_path: Path
) -> None:
    asked, scene, solve = solver(), bpy.context.scene, bpy.ops.facewright.motion
    before, settings = snapshot(), scene.facewright_motion
    with pytest.raises(RuntimeError, match="there is no movie clip named nothing"):
        solve(clip="nothing")
    scene.facewright_camera.text = json.dumps(TRUTH["camera"] | {"width": 640})
    with pytest.raises(RuntimeError, match="is 400 × 300, the camera was calibrated at 640 × 300"):
        solve()
    scene.facewright_camera.text, settings.use_length = "", True
    with pytest.raises(RuntimeError, match="choose the two tracks of the measured length"):
        solve()
    settings.length_from, settings.length_to = "FW skin 0000", "gone"
    with pytest.raises(RuntimeError, match="gone is not a track of the face"):
        solve()
    with pytest.raises(RuntimeError, match="0 tracks of the face are selected"):
        bpy.ops.facewright.length_from_selection()
    other = bpy.data.movieclips.load(str(CLIP / "frames/frame_03.jpg"))
    with pytest.raises(RuntimeError, match="has no tracks of a face"):
        solve(clip=other.name)
    bpy.data.movieclips.remove(other)
    settings.use_length = False
    tracked.filepath = str(tmp_path / "gone.mp4")
    with pytest.raises(RuntimeError, match="does not exist"):
        solve()
    assert not asked and snapshot() == before


def test_an_error_of_the_library_is_told_and_changes_nothing(tracked: bpy.types.MovieClip, solver: Any) -> None:
    solver(fails=module("engine").FacewrightError("the head does not turn"))
    before = snapshot()
    with pytest.raises(RuntimeError, match="the head does not turn"):
        bpy.ops.facewright.motion()
    assert snapshot() == before


def test_closing_the_work_cancels_the_job(tracked: bpy.types.MovieClip, monkeypatch: pytest.MonkeyPatch) -> None:
    actions, job = module("motion.actions"), Finished()
    job.rounds = 100
    monkeypatch.setattr(actions, "solve_motion", lambda _tracks, **_settings: job)
    before = snapshot()
    work = actions.solved(tracked, actions.Settings())
    assert next(work)[:3] == ("track", 0.5, 12.0)
    work.close()
    assert job.cancelled and snapshot() == before


def test_greyed_buttons(addon: ModuleType, clip: bpy.types.MovieClip) -> None:
    operators = bpy.ops.facewright
    assert operators.open_motion.poll() and not operators.motion.poll()
    assert not any(button.poll() for button in (operators.save_motion, operators.remove_motion, operators.look_through))
    place(clip, made_up())
    assert operators.motion.poll()
    show(clip, solution())
    assert all(button.poll() for button in (operators.save_motion, operators.remove_motion, operators.look_through))
    bpy.context.view_layer.objects.active = bpy.data.objects["Face Points"]
    bpy.ops.object.mode_set(mode="EDIT")
    assert not operators.motion.poll() and not operators.open_motion.poll() and not operators.remove_motion.poll()


def test_the_panels_clip_or_the_editors_is_used(tracked: bpy.types.MovieClip, solver: Any) -> None:
    solver()
    other = bpy.data.movieclips.load(str(CLIP / "frames/frame_03.jpg"))
    assert bpy.ops.facewright.motion() == {"FINISHED"}, "the only one with tracks"
    assert bpy.context.scene.facewright_motion.clip == tracked
    with pytest.raises(RuntimeError, match="has no tracks of a face"):
        bpy.context.scene.facewright_motion.clip = other
        bpy.ops.facewright.motion()
    assert in_editor(tracked, bpy.ops.facewright.motion) == {"FINISHED"}


def test_the_panels_tell_what_was_found(tracked: bpy.types.MovieClip) -> None:
    for panel, space in (("FACEWRIGHT_PT_motion", "VIEW_3D"), ("FACEWRIGHT_PT_clip_motion", "CLIP_EDITOR")):
        bpy.context.scene.facewright_motion.use_length = True
        assert drawn(panel, space_data=SimpleNamespace(type=space)) == ""
        show(tracked, solution(focal_sigma_px=1.23))
        said = drawn(panel, space_data=SimpleNamespace(type=space))
        assert "20 of 21 frames posed 45 points, 15 that move, error 0.20 px" in said
        assert "Focal 520.0 ± 1.2 px Scale: eyes ± 3.1 %" in said
        assert "frame_04: blurred frame_07: error 0.90 px" in said and "The head turns little" in said
        bpy.ops.facewright.remove_motion()
    assert "Focal 520.0 px, as given" in " ".join(module("motion.actions").summary(parsed(solution())))


def test_of_many_frames_some_are_told() -> None:
    content = solution()
    for frame in content["frames"][:9]:
        frame |= {"used": False, "reason": "no face", "cam_from_head": None}
    lines = module("motion.actions").complaints(parsed(content))
    assert lines == ["frame_00: no face", "frame_01: no face", "frame_02: no face", "and 6 more"]


def test_the_shell_command_solves(addon: ModuleType, solver: Any, library: Any, tmp_path: Path) -> None:
    cli, asked, tracked = module("cli"), solver(), library()
    out, blend, tracks = (str(tmp_path / name) for name in ("motion.json", "scene.blend", "tracks.json"))
    Path(tracks).write_text(json.dumps(made_up()))
    frames = str(CLIP / "frames")
    more = ["--length", "2-7=61.5", "--length", "3-4=20", "--interocular-mm", "60", "--show", "head", "--blend", blend]
    assert cli.run(["motion", frames, "--tracks", tracks, "-o", out, *more]) == 0
    assert asked[0]["lengths"] == [(2, 7, 61.5), (3, 4, 20.0)] and asked[0]["interocular_mm"] == 60.0
    assert len(asked[0]["tracks"]["tracks"]) == 12 and same(json.loads(Path(out).read_text()), written(solution()))
    bpy.ops.wm.open_mainfile(filepath=blend)
    assert bpy.data.objects["Face Head"].parent == bpy.data.objects["Face Camera"] and bpy.context.scene.active_clip
    before = snapshot()
    assert cli.run(["motion", frames, "-o", out]) == 0
    assert [Path(frame).stem for frame in tracked[0]["frames"]] == NAMES and len(asked) == 2
    assert cli.run(["motion", str(tmp_path / "none.mp4"), "-o", str(tmp_path / "none.json")]) == 1
    assert cli.run(["motion", frames, "--length", "2-7"]) == 2 and cli.run(["motion", frames, "--length", "2=7"]) == 2
    assert snapshot() == before and not (tmp_path / "none.json").exists()
