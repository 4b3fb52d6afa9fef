"""What is no clip, no tracks or no camera gets a sentence and changes nothing."""

import json
from pathlib import Path
from typing import Any

import bpy
import pytest
from conftest import snapshot
from tracking import TRUTH, Finished, made_up, module, place, read


def test_a_linked_clip_is_refused(tmp_path: Path, tracked: bpy.types.MovieClip) -> None:
    bpy.context.scene.active_clip = tracked
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "scene.blend"), link=True) as (there, here):
        here.movieclips = there.movieclips
    before = snapshot()
    for button in (bpy.ops.facewright.track, bpy.ops.facewright.remove_tracks):
        with pytest.raises(RuntimeError, match="linked from another file"):
            button()
    assert snapshot() == before


def changed(**more: Any) -> str:
    return json.dumps(made_up() | more)


BAD = {
    "no JSON": ("{", "is not JSON"),
    "no tracks": ('{"cameras": []}', "holds no tracks"),
    "another size": (
        changed(camera=TRUTH["camera"] | {"width": 640, "height": 480}),
        "640 × 480, but frame_00.jpg is 400 × 300",
    ),
    "other frames": (json.dumps(made_up(names=[f"x{k}" for k in range(30)])), "have 30 frames, frame_00.jpg has 21"),
    "a broken track": (changed(tracks=[{"id": 7, "region": "skin", "reference": 0}]), "track 7 has no observations"),
    "a broken camera": (changed(camera={"width": 400}), "has no height"),
}


@pytest.mark.parametrize("kind", BAD)
@pytest.mark.parametrize("with_tracks", [False, True])
def test_bad_tracks_get_a_sentence_and_change_nothing(
    clip: bpy.types.MovieClip, tmp_path: Path, kind: str, with_tracks: bool
) -> None:
    content, sentence = BAD[kind]
    if with_tracks:
        place(clip, made_up())
    (tmp_path / "tracks.json").write_text(content)
    before = snapshot()
    with pytest.raises(RuntimeError, match=sentence):
        bpy.ops.facewright.open_tracks(filepath=str(tmp_path / "tracks.json"), clip=clip.name)
    assert snapshot() == before


def test_bad_clips_get_a_sentence_and_change_nothing(clip: bpy.types.MovieClip, library: Any, tmp_path: Path) -> None:
    asked, track, scene = library(), bpy.ops.facewright.track, bpy.context.scene
    before = snapshot()
    with pytest.raises(RuntimeError, match="there is no movie clip named nothing"):
        track(clip="nothing")
    scene.facewright_camera.text = json.dumps(TRUTH["camera"] | {"width": 640})
    with pytest.raises(RuntimeError, match="is 400 × 300, the camera was calibrated at 640 × 300"):
        track(clip=clip.name)
    scene.facewright_camera.text = ""
    scene.facewright_track.span, scene.facewright_track.first, scene.facewright_track.last = "CUSTOM", 5, 4
    with pytest.raises(RuntimeError, match="the last frame must come after the first"):
        track(clip=clip.name)
    scene.facewright_track.first, scene.facewright_track.last = 90, 95
    with pytest.raises(RuntimeError, match="no frames from 90 to 95"):
        track(clip=clip.name)
    scene.facewright_track.first, scene.facewright_track.last = 3, 3
    with pytest.raises(RuntimeError, match="only one frame"):
        track(clip=clip.name)
    clip.filepath = str(tmp_path / "gone.mp4")
    with pytest.raises(RuntimeError, match="does not exist"):
        track(clip=clip.name)
    assert snapshot() == before
    (tmp_path / "broken.mp4").write_bytes(b"no video")
    broken = bpy.data.movieclips.load(str(tmp_path / "broken.mp4"))
    with pytest.raises(RuntimeError, match="cannot be read"):
        track(clip=broken.name)
    bpy.data.movieclips.remove(broken)
    assert snapshot() == before and not asked


def test_an_error_of_the_library_is_told_and_changes_nothing(tracked: bpy.types.MovieClip, library: Any) -> None:
    library(fails=module("engine").FacewrightError("no face was found in any frame"))
    before, text = snapshot(), read(tracked)
    with pytest.raises(RuntimeError, match="no face was found in any frame"):
        bpy.ops.facewright.track(clip=tracked.name)
    assert snapshot() == before and read(tracked) == text


def test_closing_the_work_cancels_the_job(clip: bpy.types.MovieClip, library: Any, monkeypatch: Any) -> None:
    library()
    actions, job = module("track.actions"), Finished()
    job.rounds = 100
    monkeypatch.setattr(actions, "track", lambda _frames, **_settings: job)
    before = snapshot()
    work = actions.tracked(module("scene.footage").of_clip(clip), actions.Settings())
    assert next(work)[:3] == ("track", 0.5, 12.0)
    work.close()
    assert job.cancelled and snapshot() == before
