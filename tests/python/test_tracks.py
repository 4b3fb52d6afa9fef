"""tracks.json: what is read comes out again, what is broken gets a sentence."""

import copy
import json
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

Content = dict[str, Any]


def content() -> Content:
    pose = [[1.0, 0.0, 0.0, 0.01], [0.0, -1.0, 0.0, 0.02], [0.0, 0.0, -1.0, 0.6], [0.0, 0.0, 0.0, 1.0]]
    frames = [
        {
            "name": f"frame_{k}",
            "used": k != 3,
            "reason": "blurred" if k == 3 else "",
            "cam_from_head": pose,
            "points": 0,
        }
        for k in range(6)
    ]
    frames[3]["cam_from_head"] = None
    rows = [[1, 10.25, 20.5, 0.1], [2, 11.0, 21.0, 0.2], [5, 12.0, 22.0, 0.15]]
    for frame, _, _, _ in rows:
        frames[frame]["points"] = 1
    track = {"id": 4, "reference": 2, "region": "mouth", "observations": rows, "gaps": [[3, 4, "turned away"]]}
    track["place"] = [0.01, -0.02, 0.09]
    camera = {"width": 640, "height": 480, "fx": 700.0, "fy": 700.0, "cx": 319.5, "cy": 239.5, "source": "exif"}
    return {
        "version": "0.1.0",
        "method": "default",
        "camera": camera,
        "window": 15,
        "frames": frames,
        "tracks": [track],
        "interocular": 0.0627,
        "warnings": ["2 frames show several faces: the largest one was followed"],
    }


def test_what_is_read_is_written_again(facewright: ModuleType, tmp_path: Path) -> None:
    tracks = facewright.Tracks.parse(json.dumps(content()))
    assert json.loads(str(tracks)) == written(content())
    assert tracks.to_json().startswith('{"schema":1,')
    tracks.write(tmp_path / "tracks.json")
    assert facewright.Tracks.read(tmp_path / "tracks.json") == tracks


def written(whole: Content) -> Content:
    """As the library writes it: with its schema, and with all that a camera has."""
    return whole | {"schema": 1, "camera": {"k1": 0.0, "k2": 0.0} | whole["camera"]}


def test_what_is_in_the_file_is_told(facewright: ModuleType) -> None:
    tracks = facewright.Tracks.parse(json.dumps(content()))
    assert (tracks.version, tracks.method, tracks.window, tracks.size) == ("0.1.0", "default", 15, (640, 480))
    assert tracks.camera.fx == 700.0 and tracks.camera.source == "exif" and tracks.interocular == 0.0627
    assert len(tracks) == 1 and len(tracks.frames) == 6 and tracks.warnings == content()["warnings"]
    assert tracks.frames[3].cam_from_head is None and tracks.frames[3].reason == "blurred"
    assert tracks.frames[0].cam_from_head.shape == (4, 4) and tracks.frames[0].cam_from_head[2, 3] == 0.6
    (track,) = tracks.tracks
    assert (track.id, track.reference, track.region, track.place) == (4, 2, "mouth", (0.01, -0.02, 0.09))
    assert track.frames.tolist() == [1, 2, 5] and track.points.shape == (3, 2) and track.sigmas[1] == 0.2
    assert track.gaps == [(3, 4, "turned away")] and repr(tracks) == "<facewright.Tracks: 1 tracks in 6 frames>"


def test_an_older_file_knows_no_schema_no_places_and_no_pupils(facewright: ModuleType) -> None:
    older = content()
    for key in ("interocular", "warnings"):
        del older[key]
    del older["tracks"][0]["place"]
    assert json.loads(str(facewright.Tracks.parse(json.dumps(older)))) == written(older)
    older["frames"][0] |= {"reason": None}
    del older["frames"][1]["points"]
    assert facewright.Tracks.parse(json.dumps(older)).frames[0].reason == ""


def test_kinds_of_reasons_are_kept_and_older_files_have_none(facewright: ModuleType) -> None:
    whole = content()
    whole["frames"][3] |= {"reason": "whatever it is called", "reason_kind": "blurred"}
    told = facewright.Tracks.parse(json.dumps(whole))
    assert told.frames[3].reason_kind == "blurred" and told.frames[0].reason_kind is None
    assert json.loads(str(told)) == written(whole)
    whole["frames"][3] |= {"reason_kind": "struck_by_lightning"}
    newer = facewright.Tracks.parse(json.dumps(whole)).frames[3]
    assert newer.reason_kind is None and newer.reason == "whatever it is called"


def test_a_newer_file_is_told_of(facewright: ModuleType) -> None:
    newer = json.dumps({"schema": 2, "tracks": "of another kind"})
    with pytest.raises(facewright.FacewrightError, match=r"a newer Facewright wrote it \(schema 2"):
        facewright.Tracks.parse(newer)


def test_the_points_of_frames_are_counted(facewright: ModuleType) -> None:
    tracks = facewright.Tracks.parse(json.dumps(content()))
    assert [frame.points for frame in tracks.with_tracks([]).frames] == [0] * 6


def test_a_track_is_put_together(facewright: ModuleType) -> None:
    tracks, seen = facewright.Tracks.parse(json.dumps(content())), {"frames": np.array([0, 3]), "reference": 3}
    missing = {1: "hidden", 2: "hidden", 4: "dark"}
    made = facewright.Track(9, region="skin", points=[[1, 2], [3, 4]], sigmas=[0.1, 0.2], missing=missing, **seen)
    assert made.gaps == [(1, 2, "hidden"), (4, 4, "dark")] and made.place is None and made.with_id(3).id == 3
    assert tracks.with_tracks([made]).tracks == [made]
    with pytest.raises(ValueError, match="region is ear"):
        facewright.Track(9, region="ear", points=[[1, 2], [3, 4]], sigmas=[0.1, 0.2], **seen)
    with pytest.raises(ValueError, match="2 frames need"):
        facewright.Track(9, region="skin", points=[[1, 2]], sigmas=[0.1], **seen)
    nowhere = facewright.Track(9, region="skin", points=[[1, 2], [3, np.nan]], sigmas=[0.1, 0.2], **seen)
    for tracks_of, sentence in (([nowhere], "not a finite number"), ([made, made], "the track 9 twice")):
        with pytest.raises(facewright.FacewrightError, match=sentence):
            tracks.with_tracks(tracks_of)


def of_frames(facewright: ModuleType, names: list[str]) -> Content:
    return json.loads(str(facewright.Tracks.parse(json.dumps(content())).of_frames(names)))


def test_of_a_part_of_the_frames_the_numbers_follow(facewright: ModuleType) -> None:
    part = of_frames(facewright, ["frame_2", "frame_4", "other", "frame_5"])
    assert [frame["name"] for frame in part["frames"]] == ["frame_2", "frame_4", "other", "frame_5"]
    assert part["frames"][2] | {"reason": ""} == {
        "name": "other",
        "used": False,
        "reason": "",
        "reason_kind": "not_tracked",
        "cam_from_head": None,
        "points": 0,
    }
    (track,) = part["tracks"]
    assert track["observations"] == [[0, 11.0, 21.0, 0.2], [3, 12.0, 22.0, 0.15]]
    assert track["reference"] == 0 and track["gaps"] == [[1, 1, "turned away"]]
    assert of_frames(facewright, [f"frame_{k}" for k in range(6)]) == written(content())


def test_a_track_that_is_in_none_of_the_frames_is_left_out(facewright: ModuleType) -> None:
    assert of_frames(facewright, ["frame_0", "frame_3"])["tracks"] == []
    assert of_frames(facewright, ["frame_5", "frame_0"])["tracks"][0]["reference"] == 0


def track_with(**more: Any) -> Callable[[Content], None]:
    return lambda whole: whole["tracks"][0].update(more)


def frame_with(**more: Any) -> Callable[[Content], None]:
    return lambda whole: whole["frames"][1].update(more)


def rows(*observations: list[Any]) -> Callable[[Content], None]:
    return track_with(observations=list(observations), reference=1, gaps=[])


# Whatever a reader in Python or the library ever refused.
BROKEN: dict[str, tuple[Callable[[Content], Any], str]] = {
    "no version": (lambda whole: whole.pop("version"), "it has no version"),
    "another method": (lambda whole: whole.update(method="other"), "its method is other, not paper or default"),
    "no camera": (lambda whole: whole.update(camera=None), "its camera is null"),
    "half a camera": (lambda whole: whole["camera"].pop("fy"), "its camera has no fy"),
    "an impossible camera": (lambda whole: whole["camera"].update(fy=-1.0), "fy is -1, which no camera has"),
    "no frames": (lambda whole: whole.update(frames={}), "its frames is an object, not a list"),
    "a nameless frame": (frame_with(name=3), "the name of frame 3 is integer 3, not a string"),
    "a frame that may be used": (frame_with(used="yes"), 'the used of frame frame_1 is string "yes", not a boolean'),
    "a pose of three rows": (frame_with(cam_from_head=[[1.0] * 4] * 3), "cam_from_head of frame frame_1 has 3 values"),
    "a pose of words": (frame_with(cam_from_head=[["x"] * 4] * 4), "frame frame_1 is string"),
    "a pose that stretches": (frame_with(cam_from_head=np.diag([2.0, 1, 1, 1]).tolist()), "frame_1 is not a rotation"),
    "a frame twice": (frame_with(name="frame_0"), "the frame frame_0 twice"),
    "no number": (track_with(id="a"), "the id of track a is string"),
    "a track twice": (lambda whole: whole["tracks"].append(copy.deepcopy(whole["tracks"][0])), "the track 4 twice"),
    "a foreign region": (track_with(region="ear"), "the region of track 4 is ear, not one of skin"),
    "no observations": (rows(), "track 4 has no observations"),
    "short rows": (rows([1, 2.0, 3.0]), "of track 4 has 3 values, not 4"),
    "uneven rows": (rows([1, 2.0, 3.0, 0.1], [2, 3.0]), "of track 4 has 2 values, not 4"),
    "rows of words": (rows(["1", "2", "3", "4"]), "of track 4 is string"),
    "no finite place": (rows([1, float("nan"), 3.0, 0.1]), "it is not JSON"),
    "half a frame": (rows([1.5, 2.0, 3.0, 0.1]), "of track 4 is floating point 1.5, not a whole number"),
    "frames that go back": (rows([1, 2.0, 3.0, 0.1], [1, 2.0, 3.0, 0.1]), "the frames of track 4 are not ascending"),
    "a frame beyond the end": (rows([1, 2.0, 3.0, 0.1], [6, 2.0, 3.0, 0.1]), "outside the 6 frames"),
    "a frame before the start": (rows([-1, 2.0, 3.0, 0.1], [1, 2.0, 3.0, 0.1]), "is integer -1, not a whole number"),
    "no deviation": (rows([1, 2.0, 3.0, 0.0]), "a sigma that is not above 0"),
    "an unseen reference": (track_with(reference=3), "own reference frame 3"),
    "a gap where it is seen": (track_with(gaps=[[2, 3, ""]]), "seen within its gap 2 to 3"),
    "a gap backwards": (track_with(gaps=[[4, 3, ""]]), "a gap outside"),
    "a gap without a reason": (track_with(gaps=[[3, 4]]), "of track 4 has 2 values, not 3"),
    "a place in a plane": (track_with(place=[1.0, 2.0]), "the place of track 4 has 2 values, not 3"),
    "no distance of the pupils": (lambda whole: whole.update(interocular=-0.06), "its pupils is no length"),
    "no window": (lambda whole: whole.pop("window"), "it has no window"),
    "a window of nothing": (lambda whole: whole.update(window=0), "its window is 0"),
}


@pytest.mark.parametrize("kind", BROKEN)
def test_what_is_broken_gets_a_sentence(facewright: ModuleType, kind: str) -> None:
    damage, sentence = BROKEN[kind]
    whole = content()
    damage(whole)
    with pytest.raises(facewright.FacewrightError, match=sentence):
        facewright.Tracks.parse(json.dumps(whole))


@pytest.mark.parametrize(("text", "sentence"), [("{", "not JSON"), ("[]", "no tracks"), ("3", "no tracks")])
def test_what_is_no_tracks_file_gets_a_sentence(facewright: ModuleType, text: str, sentence: str) -> None:
    with pytest.raises(facewright.FacewrightError, match=sentence):
        facewright.Tracks.parse(text)
