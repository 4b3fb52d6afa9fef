"""Tracks of a face that are there already: replaced, kept, removed, saved and opened."""

import json
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from conftest import snapshot
from tracking import NAMES, by_id, in_editor, made_up, marker, place, read


def test_constraints_stay_on_the_tracking_object(tracked: bpy.types.MovieClip) -> None:
    follower = bpy.data.objects.new("Follower", None)
    bpy.context.scene.collection.objects.link(follower)
    constraint = follower.constraints.new("FOLLOW_TRACK")
    constraint.use_active_clip, constraint.clip = False, tracked
    constraint.object, constraint.track = "Face", "FW skin 0004"
    place(tracked, made_up())
    assert (constraint.object, constraint.track) == ("Face", "FW skin 0004")


def test_a_second_run_replaces_ours_and_keeps_the_artists(tracked: bpy.types.MovieClip) -> None:
    face = tracked.tracking.objects["Face"]
    mine = face.tracks.new(name="Mine", frame=2)
    mine.markers.insert_frame(3, co=(0.9, 0.8))
    mine.color, mine.correlation_min = (0.1, 0.2, 0.3), 0.4
    camera = tracked.tracking.objects["Camera"].tracks.new(name="Background", frame=5)
    camera.markers[0].co = (0.1, 0.1)
    locked = face.tracks["FW eyes 0002"]
    locked.lock = True
    edited = marker(face.tracks["FW mouth 0001"], 8)
    edited.co = (0.33, 0.44)
    before = by_id(read(tracked))
    message = place(tracked, made_up(10, seed=8))
    assert message == "10 tracks in 20 of 21 frames; kept: 1 your own, 1 locked, 1 edited"
    assert [f.name for f in tracked.tracking.objects] == ["Camera", "Face"]
    face, after = tracked.tracking.objects["Face"], by_id(read(tracked))
    assert len(face.tracks) == 13 and tracked.tracking.objects["Camera"].tracks[0].markers[0].co[:] == pytest.approx(
        (0.1, 0.1)
    )
    assert after[1] == before[1] and after[2] == before[2], "kept to the last bit, with their numbers"
    assert face.tracks["FW eyes 0002"].lock and face.tracks["Mine"].color[:] == pytest.approx((0.1, 0.2, 0.3))
    assert face.tracks["Mine"].correlation_min == pytest.approx(0.4)
    assert marker(face.tracks["FW mouth 0001"], 8).co[:] == pytest.approx((0.33, 0.44))
    assert sorted(after) == list(range(13)), "new ones take other numbers than those that are kept"
    again = place(tracked, made_up(10, seed=9))
    assert "kept: 1 your own, 1 locked, 1 edited" in again and len(tracked.tracking.objects["Face"].tracks) == 13


def test_a_new_track_at_the_place_of_a_kept_one_is_left_out(tracked: bpy.types.MovieClip) -> None:
    face = tracked.tracking.objects["Face"]
    face.tracks["FW eyes 0002"].lock = True
    off = face.tracks["FW brows 0003"]
    for there in off.markers:
        there.mute = True
    message = place(tracked, made_up())
    assert message == "10 tracks in 20 of 21 frames; kept: 1 locked, 1 edited; 2 new ones left out as duplicates"
    assert 3 not in by_id(read(tracked)), "what was switched off does not come back"


def test_a_second_run_changes_no_counts(tracked: bpy.types.MovieClip) -> None:
    before = snapshot()
    place(tracked, made_up())
    assert snapshot() == before and len(read(tracked)["tracks"]) == 12


def test_a_renamed_tracking_object_is_known_and_a_foreign_one_left_alone(clip: bpy.types.MovieClip) -> None:
    foreign = clip.tracking.objects.new("Face")
    foreign.tracks.new(name="FW skin 0001", frame=1)
    place(clip, made_up())
    assert [len(face.tracks) for face in clip.tracking.objects] == [0, 1, 12]
    clip.tracking.objects[2].name = "Actor"
    place(clip, made_up(9))
    assert {face.name: len(face.tracks) for face in clip.tracking.objects} == {"Camera": 0, "Face": 1, "Actor": 9}


def test_plane_tracks_of_the_artist_stay(tracked: bpy.types.MovieClip) -> None:
    in_editor(tracked, lambda: plane_track(tracked))
    assert len(tracked.tracking.objects["Face"].plane_tracks) == 1
    message = place(tracked, made_up(9))
    assert "Face stays for its plane tracks" in message
    assert {face.name: len(face.tracks) for face in tracked.tracking.objects} == {
        "Camera": 0,
        "Face": 12,
        "Face.001": 9,
    }
    assert len(read(tracked)["tracks"]) == 9


def plane_track(clip: bpy.types.MovieClip) -> None:
    for track in list(clip.tracking.objects["Face"].tracks)[:4]:
        track.select = True
    bpy.context.scene.frame_set(9)
    assert bpy.ops.clip.create_plane_track() == {"FINISHED"}


def test_removing_removes_exactly_ours(clip: bpy.types.MovieClip) -> None:
    before = snapshot()
    place(clip, made_up())
    assert bpy.ops.facewright.remove_tracks(clip=clip.name) == {"FINISHED"}
    assert snapshot() == before and not bpy.ops.facewright.remove_tracks.poll()
    place(clip, made_up())
    face = clip.tracking.objects["Face"]
    face.tracks.new(name="Mine", frame=1)
    face.tracks["FW skin 0004"].lock = True
    face.tracks["FW skin 0008"].markers[2].co = (0.5, 0.5)
    assert bpy.ops.facewright.remove_tracks() == {"FINISHED"}
    assert {track.name for track in clip.tracking.objects["Face"].tracks} == {"Mine", "FW skin 0004"}
    place(clip, made_up())
    assert [face.name for face in clip.tracking.objects] == ["Camera", "Face"]


def test_each_button_is_one_undo_step(clip: bpy.types.MovieClip, library: Any) -> None:
    library()
    name = clip.name
    bpy.ops.ed.undo_push(message="Before")
    before = snapshot()
    bpy.ops.facewright.track("EXEC_DEFAULT", True, clip=name)
    made = snapshot()
    assert made["tracks"] == 12
    bpy.ops.facewright.remove_tracks("EXEC_DEFAULT", True, clip=name)
    assert snapshot() == before
    bpy.ops.ed.undo()
    assert snapshot() == made and len(read(bpy.data.movieclips[name])["tracks"]) == 12
    bpy.ops.ed.undo()
    assert snapshot() == before


def test_saved_tracks_are_opened_again(tracked: bpy.types.MovieClip, tmp_path: Path) -> None:
    path, before = str(tmp_path / "tracks.json"), read(tracked)
    assert bpy.ops.facewright.save_tracks(filepath=path, clip=tracked.name) == {"FINISHED"}
    assert json.loads(Path(path).read_text()) == before
    bpy.ops.facewright.remove_tracks(clip=tracked.name)
    assert bpy.ops.facewright.open_tracks(filepath=path, clip=tracked.name) == {"FINISHED"}
    back = read(tracked)
    for mine, theirs in zip(back["tracks"], before["tracks"], strict=True):
        assert np.allclose(mine["observations"], theirs["observations"], rtol=0.0, atol=1e-4)
    (tmp_path / "none").touch()
    with pytest.raises(RuntimeError, match="cannot be written"):
        bpy.ops.facewright.save_tracks(filepath=str(tmp_path / "none/tracks.json"))


def test_tracks_of_frames_with_other_names_are_taken_by_their_order(clip: bpy.types.MovieClip) -> None:
    tracks = made_up(names=[f"shot_{k}" for k in range(21)])
    place(clip, tracks)
    back = read(clip)
    assert [frame["name"] for frame in back["frames"]] == NAMES, "the clip's own names"
    assert [frame.get("reason_kind") for frame in back["frames"][3:6]] == [None, "blurred", None]
    assert back["tracks"][3]["gaps"] == tracks["tracks"][3]["gaps"]


def test_tracks_of_frames_in_another_order_are_put_in_the_clips(clip: bpy.types.MovieClip) -> None:
    tracks = made_up(names=NAMES[::-1])
    place(clip, tracks)
    back = read(clip)
    assert [frame["name"] for frame in back["frames"]] == NAMES
    for mine, theirs in zip(back["tracks"], tracks["tracks"], strict=True):
        turned = [[20 - frame, *rest] for frame, *rest in theirs["observations"]][::-1]
        assert np.allclose(mine["observations"], turned, rtol=0.0, atol=1e-4)
