"""Tracks of a face as markers of a movie clip: written, edited by hand, read back."""

from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from conftest import ROOT
from tracking import NAMES, REGIONS, SIZE, by_id, in_editor, made_up, marker, place, read, same, written


def test_tracks_become_markers_of_an_object_of_their_own(clip: bpy.types.MovieClip) -> None:
    tracks = made_up()
    message = place(clip, tracks)
    assert message == "12 tracks in 20 of 21 frames"
    assert [face.name for face in clip.tracking.objects] == ["Camera", "Face"]
    assert clip.tracking.objects.active.name == "Face" and len(clip.tracking.objects["Camera"].tracks) == 0
    for track in tracks["tracks"]:
        made = clip.tracking.objects["Face"].tracks[f"FW {track['region']} {track['id']:04d}"]
        assert made.use_custom_color and 0.0 < made.weight <= 1.0 and not made.select and not made.lock
        for frame, u, v, _ in track["observations"]:
            there = marker(made, frame + 1)
            assert there.co[:] == pytest.approx(((u + 0.5) / 400, (299.5 - v) / 300), abs=1e-6)
            assert not there.mute and there.is_keyed == (frame == track["reference"])
    colours = {tuple(track.color) for track in clip.tracking.objects["Face"].tracks}
    assert len(colours) == len(REGIONS)


def test_the_first_pixel_is_the_upper_left_one(clip: bpy.types.MovieClip) -> None:
    tracks = made_up(1)
    tracks["tracks"][0]["observations"][0][1:3] = [0.0, 0.0]
    tracks["tracks"][0]["observations"][1][1:3] = [399.0, 299.0]
    first, second = (row[0] + 1 for row in tracks["tracks"][0]["observations"][:2])
    place(clip, tracks)
    track = clip.tracking.objects["Face"].tracks[0]
    assert marker(track, first).co[:] == pytest.approx((0.5 / 400, 1.0 - 0.5 / 300), abs=1e-7)
    assert marker(track, second).co[:] == pytest.approx((1.0 - 0.5 / 400, 0.5 / 300), abs=1e-7)


def test_disabled_markers_end_every_run(clip: bpy.types.MovieClip) -> None:
    tracks = made_up()
    place(clip, tracks)
    for track in tracks["tracks"]:
        made = clip.tracking.objects["Face"].tracks[f"FW {track['region']} {track['id']:04d}"]
        seen = {row[0] + 1 for row in track["observations"]}
        ends = {frame + step for frame in seen for step in (-1, 1)} - seen
        assert {m.frame for m in made.markers if m.mute} == {frame for frame in ends if 1 <= frame <= 21}
        assert [m.frame for m in made.markers] == sorted(m.frame for m in made.markers)


def test_the_pattern_is_the_trackers_window(clip: bpy.types.MovieClip) -> None:
    place(clip, made_up())
    for there in clip.tracking.objects["Face"].tracks[0].markers:
        low, high = np.array(there.pattern_corners).min(axis=0), np.array(there.pattern_corners).max(axis=0)
        assert (high - low) * SIZE == pytest.approx((15, 15), abs=1e-4)
        assert (there.search_min[:] < low).all() and (there.search_max[:] > high).all()
        assert (np.array(there.search_max) * SIZE)[0] == pytest.approx(3.4 * 7.5, abs=1e-3)


def test_what_is_written_is_read_back(clip: bpy.types.MovieClip) -> None:
    tracks = made_up(40)
    place(clip, tracks)
    back = read(clip)
    assert same(back | {"tracks": []}, written(tracks) | {"tracks": []})
    for mine, theirs in zip(back["tracks"], tracks["tracks"], strict=True):
        assert {k: v for k, v in mine.items() if k != "observations"} == {
            k: v for k, v in theirs.items() if k != "observations"
        }
        mine, theirs = np.array(mine["observations"]), np.array(theirs["observations"])
        assert (mine[:, 0] == theirs[:, 0]).all()
        assert np.abs(mine[:, 1:3] - theirs[:, 1:3]).max() < 1e-4
        assert np.abs(mine[:, 3] - theirs[:, 3]).max() < 1e-5


def test_the_tracks_are_kept_in_the_file_without_a_path(tracked: bpy.types.MovieClip, tmp_path: Path) -> None:
    before, name = read(tracked), tracked.name
    bpy.context.scene.active_clip = tracked
    assert str(ROOT) not in tracked["facewright_tracks"]
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    assert read(bpy.data.movieclips[name]) == before


def test_a_clip_that_starts_elsewhere_has_the_same_markers(clip: bpy.types.MovieClip, library: Any) -> None:
    asked, scene = library(), bpy.context.scene
    clip.frame_start = 101
    scene.facewright_track.span, scene.frame_start, scene.frame_end = "SCENE", 104, 113
    assert bpy.ops.facewright.track(clip=clip.name) == {"FINISHED"}
    assert [Path(frame).stem for frame in asked[0]["frames"]] == NAMES[3:13]
    frames = {m.frame for track in clip.tracking.objects["Face"].tracks for m in track.markers if not m.mute}
    assert min(frames) >= 4 and max(frames) <= 13
    assert [frame["name"] for frame in read(clip)["frames"]] == NAMES[3:13]


def test_a_clip_with_an_offset_shows_later_files(clip: bpy.types.MovieClip, library: Any) -> None:
    clip.frame_offset = 5
    asked = library()
    assert bpy.ops.facewright.track(clip=clip.name) == {"FINISHED"}
    assert [Path(frame).stem for frame in asked[0]["frames"]] == NAMES[5:]
    track = by_id(read(clip))[0]
    made = clip.tracking.objects["Face"].tracks["FW skin 0000"]
    assert made.markers.find_frame(track["observations"][0][0] + 1) is not None


def test_the_range_of_the_panel_is_used(clip: bpy.types.MovieClip, library: Any) -> None:
    asked, settings = library(), bpy.context.scene.facewright_track
    settings.span, settings.first, settings.last, settings.points = "CUSTOM", 2, 12, 77
    settings.use_window, settings.window = True, 14
    assert bpy.ops.facewright.track(clip=clip.name) == {"FINISHED"}
    assert [Path(frame).stem for frame in asked[0]["frames"]] == NAMES[1:12]
    assert asked[0]["camera"] is None
    assert asked[0]["options"].points == 77 and asked[0]["options"].window == 15


def test_an_edited_marker_is_read_where_it_is(tracked: bpy.types.MovieClip) -> None:
    before = by_id(read(tracked))[0]
    frame, u, v, _ = before["observations"][4]
    track = tracked.tracking.objects["Face"].tracks["FW skin 0000"]
    there = marker(track, frame + 1)
    there.co = (there.co[0] + 3.0 / 400, there.co[1] + 2.0 / 300)
    # As Blender's own tools do.
    there.is_keyed = True
    after = by_id(read(tracked))[0]
    assert after["observations"][4] == pytest.approx([frame, u + 3.0, v - 2.0, 0.5], abs=1e-4)
    others = [k for k in range(len(after["observations"])) if k != 4]
    assert [after["observations"][k] for k in others] == [before["observations"][k] for k in others]


def test_a_disabled_marker_is_a_gap_with_its_reason(tracked: bpy.types.MovieClip) -> None:
    before = by_id(read(tracked))[5]
    track = next(t for t in tracked.tracking.objects["Face"].tracks if t.name.endswith("0005"))
    marker(track, before["reference"] + 1).mute = True
    after = by_id(read(tracked))[5]
    assert [before["reference"]] * 2 + ["disabled by hand"] in after["gaps"]
    assert after["reference"] in [row[0] for row in after["observations"]]
    assert len(after["observations"]) == len(before["observations"]) - 1
    assert len(read(tracked)["tracks"]) == 12
    at = next(row for row in before["observations"] if row[0] == before["reference"])
    assert read(tracked)["disabled"] == [pytest.approx(at[:3], abs=1e-4)], (
        "the markers that end runs are nobody's verdict"
    )
    for there in track.markers:
        there.mute = True
    assert 5 not in by_id(read(tracked)), "a track without an enabled marker is left out"
    assert len(read(tracked)["disabled"]) == len(before["observations"])


def test_without_edits_nothing_is_disabled(tracked: bpy.types.MovieClip) -> None:
    assert "disabled" not in read(tracked)


def test_the_markers_of_a_track_without_weight_are_disabled(tracked: bpy.types.MovieClip) -> None:
    before = by_id(read(tracked))[5]
    next(t for t in tracked.tracking.objects["Face"].tracks if t.name.endswith("0005")).weight = 0.0
    assert [row[0] for row in read(tracked)["disabled"]] == [row[0] for row in before["observations"]]


def test_a_marker_that_is_dragged_in_the_editor_counts_as_set_by_hand(tracked: bpy.types.MovieClip) -> None:
    """By Blender's own transformation, which marks what it moves as keyed."""
    before = by_id(read(tracked))[0]
    frame, u, v, _ = before["observations"][4]
    track = tracked.tracking.objects["Face"].tracks["FW skin 0000"]
    track.select = True
    bpy.context.scene.frame_set(frame + 1)
    in_editor(tracked, lambda: bpy.ops.transform.translate(value=(0.01, 0.02, 0.0)))
    after = by_id(read(tracked))[0]["observations"][4]
    assert after[3] == 0.5 and np.hypot(after[1] - u, after[2] - v) > 1.0
    assert "1 edited" in place(tracked, made_up(seed=5))


def test_a_marker_in_a_gap_fills_it(tracked: bpy.types.MovieClip) -> None:
    before = by_id(read(tracked))[2]
    first, last, reason = before["gaps"][0]
    track = next(t for t in tracked.tracking.objects["Face"].tracks if t.name.endswith("0002"))
    for frame in range(first, last + 1):
        there = track.markers.insert_frame(frame + 1, co=(0.25, 0.5))
        there.mute = False
    after = by_id(read(tracked))[2]
    assert [first, last, reason] not in after["gaps"]
    rows = {row[0]: row[1:] for row in after["observations"]}
    assert rows[first] == pytest.approx([99.5, 149.5, 0.5], abs=1e-4)


def test_the_artists_own_tracks_are_read_with_new_numbers(tracked: bpy.types.MovieClip) -> None:
    face = tracked.tracking.objects["Face"]
    for name, frame in (("Track", 3), ("left mouth corner", 7)):
        track = face.tracks.new(name=name, frame=frame)
        track.markers[0].co = (0.5, 0.5)
        track.markers.insert_frame(frame + 1, co=(0.5, 0.25))
    face.tracks["Track"].hide = True
    tracks = by_id(read(tracked))
    assert tracks[12]["region"] == "skin" and tracks[13]["region"] == "mouth"
    assert tracks[12]["observations"][1] == pytest.approx([3, 199.5, 224.5, 0.5], abs=1e-4)
    assert tracks[12]["reference"] == 2 and tracks[12]["gaps"] == []
    assert read(tracked)["frames"][3]["points"] == sum(3 in [r[0] for r in t["observations"]] for t in tracks.values())


def test_offset_and_weight_count(tracked: bpy.types.MovieClip) -> None:
    before = by_id(read(tracked))[0]["observations"][0]
    track = tracked.tracking.objects["Face"].tracks["FW skin 0000"]
    track.offset = (4.0 / 400, 0.0)
    track.weight *= 0.5
    after = by_id(read(tracked))[0]["observations"][0]
    assert after == pytest.approx([before[0], before[1] + 4.0, before[2], 2.0 * before[3]], abs=1e-4)
    track.weight = 0.0
    assert 0 not in by_id(read(tracked))
