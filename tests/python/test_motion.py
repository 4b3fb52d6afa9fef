"""motion.json: what is read from it, and a sentence for what is broken."""

import copy
import json
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest

Content = dict[str, Any]


def content() -> Content:
    pose = [[1.0, 0.0, 0.0, 0.01], [0.0, -1.0, 0.0, 0.02], [0.0, 0.0, -1.0, 0.6], [0.0, 0.0, 0.0, 1.0]]
    posed = {"used": True, "reason": "", "rotation_sigma_deg": 0.1, "translation_sigma_mm": 0.4, "points": 40}
    frames = [{"name": f"frame_{k}", "cam_from_head": pose, "reprojection_rms_px": 0.2} | posed for k in range(3)]
    frames[1] |= {"used": False, "reason": "blurred", "reason_kind": "blurred", "points": 0}
    frames[1] |= dict.fromkeys(("cam_from_head", "rotation_sigma_deg", "translation_sigma_mm", "reprojection_rms_px"))
    point = {"sigma_mm": 0.3, "frames": 2, "reprojection_rms_px": 0.1, "moves": False}
    return {
        "version": "0.1.0",
        "method": "default",
        "camera": {"width": 640, "height": 480, "fx": 700, "fy": 700.0, "cx": 319.5, "cy": 239.5, "source": "exif"},
        "focal_sigma_px": 2.5,
        "frames": frames,
        "points": [
            point | {"id": 7, "position": [0.01, -0.02, 0.03], "region": "skin"},
            point | {"id": 9, "position": [0, 0, 0], "region": "mouth", "moves": True},
        ],
        "scale": {"source": "eyes", "metres_per_unit": 1.0, "relative_sigma": 0.03},
        "reprojection_rms_px": 0.15,
        "roughness": {"rotation_deg": 0.02, "translation_mm": 0.1},
        "timings_s": {"bundle": 0.4},
        "warnings": ["turn the head more"],
    }


def test_what_is_in_the_file_is_read(facewright: ModuleType) -> None:
    read = facewright.Motion.parse(json.dumps(content()))
    assert read.size == (640, 480) and read.camera.fx == 700.0 and read.focal_sigma_px == 2.5
    assert read.posed == [0, 2] and read.frames[1].reason == "blurred" and read.frames[1].reprojection_rms_px is None
    assert read.frames[1].reason_kind == "blurred" and read.frames[0].reason_kind is None
    assert read.frames[0].cam_from_head[2, 3] == 0.6 and read.frames[0].rotation_sigma_deg == 0.1
    assert read.poses.shape == (3, 4, 4) and np.isnan(read.poses[1]).all() and read.poses[2, 1, 1] == -1.0
    points = read.points
    assert len(points) == 2 and points.ids.tolist() == [7, 9] and points.regions == ["skin", "mouth"]
    assert points.positions[0].tolist() == [0.01, -0.02, 0.03] and points.moves.tolist() == [False, True]
    assert read.scale.source == "eyes" and read.scale.relative_sigma == 0.03 and read.reprojection_rms_px == 0.15
    assert read.roughness.translation_mm == 0.1 and read.warnings == ["turn the head more"]
    assert json.loads(str(read)) == written(content())


def written(whole: Content) -> Content:
    """As the library writes it: with its schema, and with all that a camera has."""
    return whole | {"schema": 1, "camera": {"k1": 0.0, "k2": 0.0} | whole["camera"]}


def test_what_is_not_known_may_be_null(facewright: ModuleType) -> None:
    whole = content() | {"focal_sigma_px": None, "points": []}
    whole["frames"][0] |= {"rotation_sigma_deg": None, "translation_sigma_mm": None, "reason": None}
    read = facewright.Motion.parse(json.dumps(whole))
    assert read.focal_sigma_px is None and read.frames[0].rotation_sigma_deg is None and len(read.points) == 0


def frame_with(**more: Any) -> Callable[[Content], None]:
    return lambda whole: whole["frames"][0].update(more)


def point_with(**more: Any) -> Callable[[Content], None]:
    return lambda whole: whole["points"][0].update(more)


def posed(*rows: list[float]) -> Callable[[Content], None]:
    return frame_with(cam_from_head=list(rows))


LAST = [0.0, 0.0, 0.0, 1.0]
# Whatever a reader in Python or the library ever refused.
BROKEN: dict[str, tuple[Callable[[Content], Any], str]] = {
    "no version": (lambda whole: whole.pop("version"), "it has no version"),
    "another method": (lambda whole: whole.update(method="other"), "its method is other, not paper or default"),
    "no camera": (lambda whole: whole.pop("camera"), "it has no camera"),
    "half a camera": (lambda whole: whole["camera"].pop("fy"), "its camera has no fy"),
    "a focal length that is surer than sure": (
        lambda whole: whole.update(focal_sigma_px=-1.0),
        "its focal_sigma_px is -1",
    ),
    "no frames": (lambda whole: whole.update(frames={}), "its frames is an object, not a list"),
    "a nameless frame": (frame_with(name=3), "the name of frame 3 is integer 3, not a string"),
    "a frame that may be used": (frame_with(used=1), "the used of frame frame_0 is integer 1, not a boolean"),
    "a frame twice": (frame_with(name="frame_1"), "the frame frame_1 twice"),
    "no frame posed": (lambda whole: [f.update(cam_from_head=None) for f in whole["frames"]], "none of its frames"),
    "a pose of three rows": (posed([1.0] * 4, [1.0] * 4, [1.0] * 4), "frame frame_0 has 3 values"),
    "a pose of words": (frame_with(cam_from_head="x"), "frame frame_0 is string"),
    "a pose that stretches": (posed([2.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, 1.0, 0], LAST), "frame_0 is not a rotation"),
    "a pose that mirrors": (posed([-1.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, 1.0, 0], LAST), "frame_0 is not a rotation"),
    "a pose with a perspective": (
        posed([1.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, 1.0, 0], [0, 0, 1.0, 1.0]),
        "not a rotation",
    ),
    "an error in words": (
        frame_with(reprojection_rms_px="small"),
        "the reprojection_rms_px of frame frame_0 is string",
    ),
    "an error below 0": (frame_with(reprojection_rms_px=-0.1), "the reprojection_rms_px of frame frame_0 is -0.1"),
    "half a point of a frame": (frame_with(points=1.5), "the points of frame frame_0 is floating point 1.5"),
    "a point without a number": (point_with(id="a"), "the id of point a is string"),
    "a point twice": (lambda whole: whole["points"].append(copy.deepcopy(whole["points"][0])), "the point 7 twice"),
    "a foreign region": (point_with(region="ear"), "the region of point 7 is ear, not one of skin"),
    "a flat position": (point_with(position=[1.0, 2.0]), "the position of point 7 has 2 values, not 3"),
    "no finite position": (point_with(position=[1.0, 2.0, float("nan")]), "it is not JSON"),
    "no deviation": (point_with(sigma_mm=None), "the sigma_mm of point 7 is null, not a number"),
    "a deviation below 0": (point_with(sigma_mm=-0.1), "the sigma_mm of point 7 is -0.1"),
    "a point that may move": (point_with(moves="no"), "the moves of point 7 is string"),
    "no error": (lambda whole: whole.update(reprojection_rms_px=None), "its reprojection_rms_px is null"),
    "no number at all": (lambda whole: whole.update(reprojection_rms_px=float("inf")), "it is not JSON"),
    "feet": (lambda whole: whole["scale"].update(metres_per_unit=0.3048), "its unit is not the metre"),
    "a scale from nowhere": (lambda whole: whole["scale"].pop("source"), "its scale has no source"),
    "no roughness": (lambda whole: whole.update(roughness={}), "its roughness has no rotation_deg"),
    "warnings that are numbers": (lambda whole: whole.update(warnings=[1]), "is integer 1, not a string"),
}


@pytest.mark.parametrize("kind", BROKEN)
def test_what_is_broken_gets_a_sentence(facewright: ModuleType, kind: str) -> None:
    damage, sentence = BROKEN[kind]
    whole = content()
    damage(whole)
    with pytest.raises(facewright.FacewrightError, match=sentence):
        facewright.Motion.parse(json.dumps(whole))


@pytest.mark.parametrize(
    ("text", "sentence"), [("{", "not JSON"), ("[]", "no motion"), ('{"frames": []}', "no motion")]
)
def test_what_is_no_motion_file_gets_a_sentence(facewright: ModuleType, text: str, sentence: str) -> None:
    with pytest.raises(facewright.FacewrightError, match=sentence):
        facewright.Motion.parse(text)
