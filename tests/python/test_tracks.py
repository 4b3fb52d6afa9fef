"""tracks.json: what is read comes out again, what is broken gets a sentence; without Blender and the library."""

import copy
import json
from collections.abc import Callable
from types import ModuleType
from typing import Any

import pytest
from engines import Error

Content = dict[str, Any]


@pytest.fixture(scope="module")
def engine(engine_module: Callable[[str], ModuleType]) -> ModuleType:
    """`engine/tracks.py`."""
    return engine_module("tracks")


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


def test_what_is_read_is_written_again(engine: ModuleType) -> None:
    assert json.loads(engine.to_text(engine.parse(json.dumps(content())))) == content()


def test_an_older_file_knows_no_places_and_no_pupils(engine: ModuleType) -> None:
    older = content()
    for key in ("interocular", "warnings"):
        del older[key]
    del older["tracks"][0]["place"]
    assert json.loads(engine.to_text(engine.parse(json.dumps(older)))) == older


def test_the_points_of_frames_are_counted(engine: ModuleType) -> None:
    tracks = engine.parse(json.dumps(content()))
    assert [frame["points"] for frame in json.loads(engine.to_text(tracks.with_tracks([])))["frames"]] == [0] * 6


def of_frames(engine: ModuleType, names: list[str]) -> Content:
    return json.loads(engine.to_text(engine.parse(json.dumps(content())).of_frames(names)))


def test_of_a_part_of_the_frames_the_numbers_follow(engine: ModuleType) -> None:
    part = of_frames(engine, ["frame_2", "frame_4", "other", "frame_5"])
    assert [frame["name"] for frame in part["frames"]] == ["frame_2", "frame_4", "other", "frame_5"]
    assert part["frames"][2] | {"reason": ""} == {
        "name": "other",
        "used": False,
        "reason": "",
        "cam_from_head": None,
        "points": 0,
    }
    (track,) = part["tracks"]
    assert track["observations"] == [[0, 11.0, 21.0, 0.2], [3, 12.0, 22.0, 0.15]]
    assert track["reference"] == 0 and track["gaps"] == [[1, 1, "turned away"]]
    assert of_frames(engine, [f"frame_{k}" for k in range(6)]) == content()


def test_a_track_that_is_in_none_of_the_frames_is_left_out(engine: ModuleType) -> None:
    assert of_frames(engine, ["frame_0", "frame_3"])["tracks"] == []
    assert of_frames(engine, ["frame_5", "frame_0"])["tracks"][0]["reference"] == 0


def track_with(**more: Any) -> Callable[[Content], None]:
    return lambda whole: whole["tracks"][0].update(more)


def frame_with(**more: Any) -> Callable[[Content], None]:
    return lambda whole: whole["frames"][1].update(more)


def rows(*observations: list[Any]) -> Callable[[Content], None]:
    return track_with(observations=list(observations), reference=1, gaps=[])


BROKEN: dict[str, tuple[Callable[[Content], None], str]] = {
    "no version": (lambda whole: whole.pop("version"), "it has no version"),
    "another method": (lambda whole: whole.update(method="other"), "method is other"),
    "no camera": (lambda whole: whole.update(camera=None), "it has no camera"),
    "half a camera": (lambda whole: whole["camera"].pop("fy"), "it has no fy"),
    "no frames": (lambda whole: whole.update(frames={}), "it has no frames"),
    "a nameless frame": (frame_with(name=3), "frame 1 has no name"),
    "a frame that may be used": (frame_with(used="yes"), "frame 1 has no used"),
    "a pose of three rows": (frame_with(cam_from_head=[[1.0] * 4] * 3), "frame_1 is no 4 × 4 matrix"),
    "a pose of words": (frame_with(cam_from_head=[["x"] * 4] * 4), "frame_1 is no 4 × 4 matrix"),
    "a frame twice": (frame_with(name="frame_0"), "the frame frame_0 twice"),
    "no number": (track_with(id="a"), "track number 0 has no id"),
    "a track twice": (lambda whole: whole["tracks"].append(copy.deepcopy(whole["tracks"][0])), "the track 4 twice"),
    "a foreign region": (track_with(region="ear"), "track 4 has the region ear"),
    "no observations": (rows(), "track 4 has no observations of the form"),
    "short rows": (rows([1, 2.0, 3.0]), "track 4 has no observations of the form"),
    "uneven rows": (rows([1, 2.0, 3.0, 0.1], [2, 3.0]), "track 4 has no observations of the form"),
    "rows of words": (rows(["1", "2", "3", "4"]), "track 4 has no observations of the form"),
    "no finite place": (rows([1, float("nan"), 3.0, 0.1]), "track 4 has no observations of the form"),
    "half a frame": (rows([1.5, 2.0, 3.0, 0.1]), "not ascending whole numbers"),
    "frames that go back": (rows([1, 2.0, 3.0, 0.1], [1, 2.0, 3.0, 0.1]), "not ascending whole numbers"),
    "a frame beyond the end": (rows([1, 2.0, 3.0, 0.1], [6, 2.0, 3.0, 0.1]), "outside the 6 frames"),
    "a frame before the start": (rows([-1, 2.0, 3.0, 0.1], [1, 2.0, 3.0, 0.1]), "outside the 6 frames"),
    "no deviation": (rows([1, 2.0, 3.0, 0.0]), "a sigma that is not above 0"),
    "an unseen reference": (track_with(reference=3), "own reference frame 3"),
    "a gap where it is seen": (track_with(gaps=[[2, 3, ""]]), "seen within its gap 2 to 3"),
    "a gap backwards": (track_with(gaps=[[4, 3, ""]]), "a gap outside"),
    "a gap without a reason": (track_with(gaps=[[3, 4]]), "not of the form first, last, reason"),
    "a place in a plane": (track_with(place=[1.0, 2.0]), "the place of track 4 is no point"),
    "no distance of the pupils": (lambda whole: whole.update(interocular=-0.06), "its pupils is no length"),
    "no window": (lambda whole: whole.pop("window"), "it has no window"),
    "a window of nothing": (lambda whole: whole.update(window=0), "its window is 0"),
}


@pytest.mark.parametrize("kind", BROKEN)
def test_what_is_broken_gets_a_sentence(engine: ModuleType, kind: str) -> None:
    damage, sentence = BROKEN[kind]
    whole = content()
    damage(whole)
    with pytest.raises(Error, match=sentence):
        engine.parse(json.dumps(whole))


@pytest.mark.parametrize(("text", "sentence"), [("{", "not JSON"), ("[]", "no tracks"), ("3", "no tracks")])
def test_what_is_no_tracks_file_gets_a_sentence(engine: ModuleType, text: str, sentence: str) -> None:
    with pytest.raises(Error, match=sentence):
        engine.parse(text)
