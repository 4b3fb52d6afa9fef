"""Tracks of a face as markers of a movie clip: written, edited, locked, read back, removed."""

import importlib
import json
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import bpy
import numpy as np
import pytest
from conftest import PACKAGE, ROOT, snapshot
from test_operators import numbered_clip

CLIP = ROOT / "tests/data/clip"
TRUTH = json.loads((CLIP / "truth.json").read_text())
NAMES = [f"frame_{k:02d}" for k in range(21)]
REGIONS = ("skin", "mouth", "eyes", "brows")
SIZE = (400, 300)
Text = dict[str, Any]


def made_up(count: int = 12, names: list[str] | None = None, seed: int = 3, first_id: int = 0) -> Text:
    """A tracks.json: points that wander over the picture, found from some frame on to some other, with gaps."""
    names, rng = NAMES if names is None else names, np.random.default_rng(seed)
    tracks = [one_track(first_id + k, REGIONS[k % 4], len(names), rng) for k in range(count)]
    poses = {frame["name"]: frame["cam_from_head"] for frame in TRUTH["frames"]}
    frames = [
        {"name": name, "used": k != 4, "reason": "blurred" if k == 4 else "", "cam_from_head": poses.get(name)}
        for k, name in enumerate(names)
    ]
    for k, frame in enumerate(frames):
        frame["points"] = sum(k in [row[0] for row in track["observations"]] for track in tracks)
    camera = TRUTH["camera"] | {"source": "board"}
    return {"version": "0.1.0", "method": "default", "camera": camera, "window": 15, "frames": frames, "tracks": tracks}


def one_track(number: int, region: str, frames: int, rng: np.random.Generator) -> Text:
    """At least two frames, a gap of one or two, a frame again; `frames` are seven or more."""
    first, last = int(rng.integers(0, max(frames // 5, 1))), int(rng.integers(frames * 3 // 4, frames))
    gap = (first + last) // 2
    gap_end = min(gap + int(rng.integers(0, 2)), last - 1)
    points = rng.uniform((20, 20), (380, 280)) + rng.normal(0.0, 2.0, (frames, 2)).cumsum(axis=0)
    seen = [k for k in range(first, last + 1) if not gap <= k <= gap_end]
    rows = [[k, *points[k].tolist(), float(rng.uniform(0.05, 0.4))] for k in seen]
    gaps = [[gap, gap_end, "turned away"]] + ([[last + 1, frames - 1, "outside"]] if last + 1 < frames else [])
    return {"id": number, "reference": seen[1], "region": region, "observations": rows, "gaps": gaps}


def module(name: str) -> ModuleType:
    return importlib.import_module(f"{PACKAGE}.{name}")


def place(clip: bpy.types.MovieClip, tracks: Text) -> str:
    return module("track.actions").place(clip, json.dumps(tracks))


def read(clip: bpy.types.MovieClip) -> Text:
    return json.loads(module("track.actions").read(clip))


def by_id(tracks: Text) -> dict[int, Text]:
    return {track["id"]: track for track in tracks["tracks"]}


def marker(track: bpy.types.MovieTrackingTrack, frame: int) -> bpy.types.MovieTrackingMarker:
    found = track.markers.find_frame(frame)
    assert found is not None
    return found


@pytest.fixture
def clip() -> bpy.types.MovieClip:
    """The synthetic person's frames."""
    return bpy.data.movieclips.load(str(CLIP / "frames/frame_00.jpg"))


@pytest.fixture
def tracked(clip: bpy.types.MovieClip) -> bpy.types.MovieClip:
    """The same with made-up tracks."""
    place(clip, made_up())
    return clip


class Finished:
    """A native job that has made a tracks.json; `fails` is raised instead."""

    def __init__(self, text: str, fails: Exception | None = None) -> None:
        self.text, self.fails, self.cancelled, self.rounds = text, fails, False, 2

    def progress(self) -> tuple[str, float]:
        return "track", 0.5

    def finished(self) -> bool:
        self.rounds -= 1
        return self.cancelled or self.rounds < 0

    def cancel(self) -> None:
        self.cancelled = True

    def result(self) -> str:
        if self.fails is not None:
            raise self.fails
        return self.text


@pytest.fixture
def library(monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[Text]]:
    """Lets the library's tracking give made-up tracks of the frames it is asked for; tells what it was asked."""

    def install(fails: Exception | None = None, **more: Any) -> list[Text]:
        asked: list[Text] = []

        def track(frames: list[str], **settings: Any) -> Finished:
            asked.append({"frames": frames} | settings)
            return Finished(json.dumps(made_up(names=[Path(frame).stem for frame in frames], **more)), fails)

        monkeypatch.setattr(module("track.actions"), "track", track)
        return asked

    return install


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
    assert {key: back[key] for key in back if key != "tracks"} == {
        key: tracks[key] for key in tracks if key != "tracks"
    }
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
    assert asked[0]["points"] == 77 and asked[0]["window"] == 15 and asked[0]["camera"] is None


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
    for there in track.markers:
        there.mute = True
    assert 5 not in by_id(read(tracked)), "a track without an enabled marker is left out"


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


def test_constraints_stay_on_the_tracking_object(tracked: bpy.types.MovieClip) -> None:
    follower = bpy.data.objects.new("Follower", None)
    bpy.context.scene.collection.objects.link(follower)
    constraint = follower.constraints.new("FOLLOW_TRACK")
    constraint.use_active_clip, constraint.clip = False, tracked
    constraint.object, constraint.track = "Face", "FW skin 0004"
    place(tracked, made_up())
    assert (constraint.object, constraint.track) == ("Face", "FW skin 0004")


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
    assert message == "10 tracks in 20 of 21 frames; kept: 1 locked, 1 edited; 2 new ones left out where kept ones are"
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


def in_editor(clip: bpy.types.MovieClip, work: Callable[[], Any]) -> Any:
    """What is done in a Clip editor."""
    window = bpy.context.window_manager.windows[0]
    area = window.screen.areas[0]
    area.type = "CLIP_EDITOR"
    area.spaces.active.clip = clip
    area.spaces.active.clip_user.frame_current = bpy.context.scene.frame_current
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        return work()


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
    with pytest.raises(RuntimeError, match="cannot be written"):
        bpy.ops.facewright.save_tracks(filepath=str(tmp_path / "none/tracks.json"))


def test_tracks_of_frames_with_other_names_are_taken_by_their_order(clip: bpy.types.MovieClip) -> None:
    tracks = made_up(names=[f"shot_{k}" for k in range(21)])
    place(clip, tracks)
    back = read(clip)
    assert [frame["name"] for frame in back["frames"]] == NAMES, "the clip's own names"
    assert back["tracks"][3]["gaps"] == tracks["tracks"][3]["gaps"]


def test_tracks_of_frames_in_another_order_are_put_in_the_clips(clip: bpy.types.MovieClip) -> None:
    tracks = made_up(names=NAMES[::-1])
    place(clip, tracks)
    back = read(clip)
    assert [frame["name"] for frame in back["frames"]] == NAMES
    for mine, theirs in zip(back["tracks"], tracks["tracks"], strict=True):
        turned = [[20 - frame, *rest] for frame, *rest in theirs["observations"]][::-1]
        assert np.allclose(mine["observations"], turned, rtol=0.0, atol=1e-4)


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
        "640 × 480, frame_00.jpg is 400 × 300",
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
    with pytest.raises(RuntimeError, match="there is no movie clip nothing"):
        track(clip="nothing")
    scene.facewright_camera.text = json.dumps(TRUTH["camera"] | {"width": 640})
    with pytest.raises(RuntimeError, match="is 400 × 300, the camera was calibrated at 640 × 300"):
        track(clip=clip.name)
    scene.facewright_camera.text = ""
    scene.facewright_track.span, scene.facewright_track.first, scene.facewright_track.last = "CUSTOM", 5, 4
    with pytest.raises(RuntimeError, match="the last frame must come after the first"):
        track(clip=clip.name)
    scene.facewright_track.first, scene.facewright_track.last = 90, 95
    with pytest.raises(RuntimeError, match="nothing from frame 90 to 95"):
        track(clip=clip.name)
    scene.facewright_track.first, scene.facewright_track.last = 3, 3
    with pytest.raises(RuntimeError, match="one frame only"):
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
    actions, job = module("track.actions"), Finished("")
    job.rounds = 100
    monkeypatch.setattr(actions, "track", lambda _frames, **_settings: job)
    before = snapshot()
    work = actions.tracked(module("scene.footage").of_clip(clip), actions.Settings())
    assert next(work) == ("track", 0.5)
    work.close()
    assert job.cancelled and snapshot() == before


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
    with pytest.raises(RuntimeError, match="no movie clip is shown"):
        bpy.ops.facewright.track()
    panel, tracks = bpy.types.FACEWRIGHT_PT_tracks, bpy.ops.facewright.save_tracks
    assert in_editor(other, lambda: panel.poll(bpy.context) and not tracks.poll())
    assert in_editor(other, bpy.ops.facewright.track) == {"FINISHED"}
    assert in_editor(other, tracks.poll) and len(read(other)["frames"]) == 18


def test_a_video_is_decoded_and_its_frames_have_their_numbers(tmp_path: Path, library: Any) -> None:
    numbered_clip(tmp_path / "clip.mp4", 24)
    bpy.ops.wm.read_homefile(use_empty=True)
    actions, asked = module("track.actions"), library()
    clip = bpy.data.movieclips.load(str(tmp_path / "clip.mp4"))
    source = module("scene.footage").of_clip(clip).part(3, 9)
    before = snapshot()
    tracks = json.loads(module("jobs").wait(actions.tracked(source, actions.Settings())))
    assert [frame["name"] for frame in tracks["frames"]] == [f"frame_{k:06d}" for k in range(2, 9)]
    assert not Path(asked[0]["frames"][0]).exists() and snapshot() == before
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
        return Finished("", error)

    monkeypatch.setattr(module("reconstruct.actions"), "reconstruct", reconstruct)
    settings.path = str(CLIP / "frames")
    for settings.use_markers in (False, True):
        with pytest.raises(RuntimeError, match="enough"):
            bpy.ops.facewright.reconstruct()
    assert asked[0] is None and json.loads(asked[1]) == read(tracked)
    settings.use_range, settings.first, settings.last = True, 5, 14
    with pytest.raises(RuntimeError, match="enough"):
        bpy.ops.facewright.reconstruct()
    part = json.loads(asked[2])
    assert [frame["name"] for frame in part["frames"]] == NAMES[5:15] and len(part["tracks"]) == 12
    settings.use_range = False
    settings.path = str(CLIP / "board")
    with pytest.raises(RuntimeError, match="track the face in the Clip editor, or turn Use Markers off"):
        bpy.ops.facewright.reconstruct()


class Layout:
    """Takes what a panel draws; refuses properties and operators that there are not."""

    def __init__(self) -> None:
        self.said: list[str] = []

    def prop(self, data: Any, name: str, **_more: Any) -> None:
        assert name in data.bl_rna.properties

    def operator(self, name: str, **_more: Any) -> SimpleNamespace:
        category, _, call = name.partition(".")
        assert getattr(bpy.ops, category) and hasattr(bpy.types, f"{category.upper()}_OT_{call}")
        return SimpleNamespace()

    def label(self, text: str = "", **_more: Any) -> None:
        self.said.append(text)

    def row(self, **_more: Any) -> "Layout":
        return self

    column = row


def drawn(panel: str, **context: Any) -> str:
    layout, preferences = Layout(), SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))
    shown = SimpleNamespace(
        scene=bpy.context.scene, region=SimpleNamespace(width=400), preferences=preferences, **context
    )
    cls = getattr(bpy.types, panel)
    me = SimpleNamespace(layout=layout, draw_markers=lambda context: cls.draw_markers(me, context))
    cls.draw(me, shown)
    return " ".join(layout.said)


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
    assert [Path(frame).stem for frame in asked[0]["frames"]] == NAMES[3:15] and asked[0]["points"] == 50
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
