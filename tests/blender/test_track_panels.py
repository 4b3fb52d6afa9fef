"""Tracking by panel, editor, shell and reconstruction; videos and long clips."""

import json
import time
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import bpy
import numpy as np
import pytest
from conftest import snapshot
from test_operators import numbered_clip
from tracking import CLIP, NAMES, SIZE, TRUTH, Finished, drawn, in_editor, made_up, module, place, read


def test_greyed_buttons(addon: ModuleType) -> None:
    operators = bpy.ops.facewright
    assert not operators.track.poll() and not operators.open_tracks.poll()
    clip = bpy.data.movieclips.load(str(CLIP / "frames/frame_00.jpg"))
    assert operators.track.poll() and operators.open_tracks.poll()
    assert not operators.save_tracks.poll() and not operators.remove_tracks.poll()
    place(clip, made_up())
    assert operators.save_tracks.poll() and operators.remove_tracks.poll()


def test_in_the_editor_its_clip_is_used(tracked: bpy.types.MovieClip, library: Any) -> None:
    library()
    other = bpy.data.movieclips.load(str(CLIP / "frames/frame_03.jpg"))
    with pytest.raises(RuntimeError, match="no movie clip is open"):
        bpy.ops.facewright.track()
    panel, tracks = bpy.types.FACEWRIGHT_PT_tracks, bpy.ops.facewright.save_tracks
    assert in_editor(other, lambda: panel.poll(bpy.context) and not tracks.poll())
    assert in_editor(other, bpy.ops.facewright.track) == {"FINISHED"}
    assert in_editor(other, tracks.poll) and len(read(other)["frames"]) == 18


@pytest.mark.parametrize("is_there", [True, False])
def test_a_videos_frames_have_their_numbers_with_ffmpeg_and_without(
    tmp_path: Path, library: Any, monkeypatch: pytest.MonkeyPatch, is_there: bool
) -> None:
    monkeypatch.setattr(module("scene.video"), "is_decoded_by_library", lambda _path: is_there)
    monkeypatch.setattr(module("scene.video"), "check_face", lambda *_frames: Finished())
    numbered_clip(tmp_path / "clip.mp4", 24)
    bpy.ops.wm.read_homefile(use_empty=True)
    actions, asked = module("track.actions"), library()
    clip = bpy.data.movieclips.load(str(tmp_path / "clip.mp4"))
    source = module("scene.footage").of_clip(clip).part(3, 9)
    before = snapshot()
    tracks = json.loads(str(module("jobs").wait(actions.tracked(source, actions.Settings()))))
    assert [frame["name"] for frame in tracks["frames"]] == [f"frame_{k:06d}" for k in range(2, 9)]
    if is_there:
        assert asked[0]["frames"] == [str(tmp_path / "clip.mp4")] and asked[0]["numbers"] == [*range(2, 9)]
    else:
        assert asked[0]["numbers"] is None and not Path(asked[0]["frames"][0]).exists()
    assert snapshot() == before
    tracks["camera"] |= {"width": 64, "height": 64}
    place(clip, tracks)
    assert min(m.frame for m in clip.tracking.objects["Face"].tracks[0].markers if not m.mute) >= 3


def test_a_long_clip_is_written_in_seconds(clip: bpy.types.MovieClip) -> None:
    """300 tracks of 200 frames."""
    markers, rng = module("scene.markers"), np.random.default_rng(1)
    face, look = clip.tracking.objects.new("Many"), markers.Look(1, 15.0, (1.0, 0.5, 0.2), 1.0)
    started = time.process_time()
    for number in range(300):
        markers.write(face, f"FW skin {number:04d}", np.arange(1, 201), rng.uniform(0, 300, (200, 2)), look, SIZE, 200)
    written = time.process_time() - started
    assert sum(len(track.markers) for track in face.tracks) == 60000
    print(f"300 × 200 markers written in {written:.2f} s")
    assert written < 10.0


def test_the_reconstruction_uses_the_markers(tracked: bpy.types.MovieClip, monkeypatch: pytest.MonkeyPatch) -> None:
    settings, asked = bpy.context.scene.facewright_clip, []
    error = module("engine").FacewrightError("enough")

    def reconstruct(_frames: list[str], **more: Any) -> Finished:
        asked.append(more["tracks"])
        return Finished(None, error)

    monkeypatch.setattr(module("reconstruct.actions"), "reconstruct", reconstruct)
    settings.path = str(CLIP / "frames")
    for settings.use_markers in (False, True):
        with pytest.raises(RuntimeError, match="enough"):
            bpy.ops.facewright.reconstruct()
    assert asked[0] is None and json.loads(asked[1].to_json()) == read(tracked)
    settings.use_range, settings.first, settings.last = True, 5, 14
    with pytest.raises(RuntimeError, match="enough"):
        bpy.ops.facewright.reconstruct()
    part = json.loads(asked[2].to_json())
    assert [frame["name"] for frame in part["frames"]] == NAMES[5:15] and len(part["tracks"]) == 12
    settings.use_range = False
    settings.path = str(CLIP / "board")
    with pytest.raises(RuntimeError, match="track the face in the Clip editor, or turn Use Markers off"):
        bpy.ops.facewright.reconstruct()


def test_the_panels_tell_what_there_is(clip: bpy.types.MovieClip) -> None:
    space = SimpleNamespace(clip=clip)
    assert "estimated" in drawn("FACEWRIGHT_PT_track", space_data=space)
    bpy.context.scene.facewright_camera.text = json.dumps(TRUTH["camera"] | {"width": 640})
    assert "calibrated at 640 × 300" in drawn("FACEWRIGHT_PT_track", space_data=space)
    drawn("FACEWRIGHT_PT_track_advanced", space_data=space)
    assert drawn("FACEWRIGHT_PT_tracks", space_data=space) == "The face is not tracked yet"
    place(clip, made_up())
    clip.tracking.objects["Face"].tracks.new(name="Mine", frame=1)
    clip.tracking.objects["Face"].tracks["FW skin 0000"].lock = True
    assert drawn("FACEWRIGHT_PT_tracks", space_data=space) == "12 tracks of the face 1 of your own, 1 locked"
    assert "track the face in the Clip editor" in drawn("FACEWRIGHT_PT_advanced")
    bpy.context.scene.facewright_clip.path = str(CLIP / "frames")
    assert drawn("FACEWRIGHT_PT_advanced") == ""
    bpy.context.scene.facewright_clip.method = "paper"
    assert "choose Default to use markers" in drawn("FACEWRIGHT_PT_advanced")


def test_the_shell_command_tracks(addon: ModuleType, library: Any, tmp_path: Path) -> None:
    cli, asked = module("cli"), library()
    camera, out, blend = (str(tmp_path / name) for name in ("camera.json", "tracks.json", "scene.blend"))
    Path(camera).write_text(json.dumps(TRUTH["camera"]))
    frames = str(CLIP / "frames")
    more = ["--camera", camera, "--frames", "3-14", "--points", "50", "--blend", blend]
    assert cli.run(["track", frames, "-o", out, *more]) == 0
    assert [Path(frame).stem for frame in asked[0]["frames"]] == NAMES[3:15] and asked[0]["options"].points == 50
    assert [frame["name"] for frame in json.loads(Path(out).read_text())["frames"]] == NAMES[3:15]
    bpy.ops.wm.open_mainfile(filepath=blend)
    assert len(read(bpy.data.movieclips[0])["tracks"]) == 12
    before = snapshot()
    assert cli.run(["track", str(tmp_path / "none.mp4"), "-o", str(tmp_path / "none.json")]) == 1
    assert cli.run(["track", frames, "--frames", "few"]) == 2
    assert snapshot() == before and not (tmp_path / "none.json").exists()


def test_the_synthetic_person_is_tracked_and_reconstructed_from_the_markers(clip: bpy.types.MovieClip) -> None:
    """The whole way through the native library."""
    bpy.context.scene.facewright_camera.text = json.dumps(TRUTH["camera"])
    bpy.context.scene.facewright_track.points = 80
    assert bpy.ops.facewright.track(clip=clip.name) == {"FINISHED"}
    tracks = read(clip)
    assert len(tracks["tracks"]) > 30 and [frame["name"] for frame in tracks["frames"]] == NAMES
    settings = bpy.context.scene.facewright_clip
    settings.path, settings.texture_size, settings.use_markers = str(CLIP / "frames"), "1024", True
    assert bpy.ops.facewright.reconstruct() == {"FINISHED"}
    with pytest.raises(RuntimeError, match="face"):
        empty = bpy.data.movieclips.load(str(CLIP / "board/board_0.png"))
        bpy.ops.facewright.track(clip=empty.name)
