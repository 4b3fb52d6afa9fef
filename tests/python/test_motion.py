"""motion.json: what is read from it, and a sentence for what is broken; without Blender and the library."""

import copy
import json
from collections.abc import Callable
from types import ModuleType
from typing import Any

import pytest
from engines import Error

Content = dict[str, Any]


@pytest.fixture(scope="module")
def motion(engine_module: Callable[[str], ModuleType]) -> ModuleType:
    """`engine/motion.py`."""
    return engine_module("motion")


def content() -> Content:
    pose = [[1.0, 0.0, 0.0, 0.01], [0.0, -1.0, 0.0, 0.02], [0.0, 0.0, -1.0, 0.6], [0.0, 0.0, 0.0, 1.0]]
    posed = {"used": True, "reason": "", "rotation_sigma_deg": 0.1, "translation_sigma_mm": 0.4, "points": 40}
    frames = [{"name": f"frame_{k}", "cam_from_head": pose, "reprojection_rms_px": 0.2} | posed for k in range(3)]
    frames[1] |= {"used": False, "reason": "blurred", "points": 0}
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


def test_what_is_in_the_file_is_read(motion: ModuleType) -> None:
    read = motion.parse(json.dumps(content()))
    assert read.size == (640, 480) and read.camera.fx == 700.0 and read.focal_sigma_px == 2.5
    assert read.posed == [0, 2] and read.frames[1].reason == "blurred" and read.frames[1].rms_px is None
    assert read.frames[0].cam_from_head[2, 3] == 0.6 and read.frames[0].rotation_sigma_deg == 0.1
    assert read.points[0].position == (0.01, -0.02, 0.03) and [p.moves for p in read.points] == [False, True]
    assert read.scale.source == "eyes" and read.scale.relative_sigma == 0.03 and read.rms_px == 0.15
    assert read.roughness.translation_mm == 0.1 and read.warnings == ("turn the head more",)


def test_what_is_not_known_may_be_null(motion: ModuleType) -> None:
    whole = content() | {"focal_sigma_px": None, "points": []}
    whole["frames"][0] |= {"rotation_sigma_deg": None, "translation_sigma_mm": None, "reason": None}
    read = motion.parse(json.dumps(whole))
    assert read.focal_sigma_px is None and read.frames[0].rotation_sigma_deg is None and read.points == ()


def frame_with(**more: Any) -> Callable[[Content], None]:
    return lambda whole: whole["frames"][0].update(more)


def point_with(**more: Any) -> Callable[[Content], None]:
    return lambda whole: whole["points"][0].update(more)


def posed(*rows: list[float]) -> Callable[[Content], None]:
    return frame_with(cam_from_head=list(rows))


LAST = [0.0, 0.0, 0.0, 1.0]
BROKEN: dict[str, tuple[Callable[[Content], Any], str]] = {
    "no version": (lambda whole: whole.pop("version"), "it has no version"),
    "another method": (lambda whole: whole.update(method="other"), "method is other"),
    "no camera": (lambda whole: whole.pop("camera"), "it has no camera"),
    "half a camera": (lambda whole: whole["camera"].pop("fy"), "it has no fy"),
    "a focal length that is surer than sure": (
        lambda whole: whole.update(focal_sigma_px=-1.0),
        "focal_sigma_px below 0",
    ),
    "no frames": (lambda whole: whole.update(frames={}), "it has no frames"),
    "a nameless frame": (frame_with(name=3), "frame 0 has no name"),
    "a frame that may be used": (frame_with(used=1), "frame 0 has no used"),
    "a frame twice": (frame_with(name="frame_1"), "the frame frame_1 twice"),
    "no frame posed": (lambda whole: [f.update(cam_from_head=None) for f in whole["frames"]], "none of its frames"),
    "a pose of three rows": (posed([1.0] * 4, [1.0] * 4, [1.0] * 4), "frame_0 is no 4 × 4 matrix"),
    "a pose of words": (frame_with(cam_from_head="x"), "frame_0 is no 4 × 4 matrix"),
    "a pose that stretches": (posed([2.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, 1.0, 0], LAST), "frame_0 is no rotation"),
    "a pose that mirrors": (posed([-1.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, 1.0, 0], LAST), "frame_0 is no rotation"),
    "a pose with a perspective": (
        posed([1.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, 1.0, 0], [0, 0, 1.0, 1.0]),
        "no rotation",
    ),
    "an error in words": (frame_with(reprojection_rms_px="small"), "frame frame_0 has no reprojection_rms_px"),
    "half a point of a frame": (frame_with(points=1.5), "frame frame_0 has no points"),
    "a point without a number": (point_with(id="a"), "point number 0 has no id"),
    "a point twice": (lambda whole: whole["points"].append(copy.deepcopy(whole["points"][0])), "the point 7 twice"),
    "a foreign region": (point_with(region="ear"), "point 7 has the region ear"),
    "a flat position": (point_with(position=[1.0, 2.0]), "point 7 has no position"),
    "no finite position": (point_with(position=[1.0, 2.0, float("nan")]), "point 7 has no position"),
    "no deviation": (point_with(sigma_mm=None), "point 7 has no sigma_mm"),
    "a deviation below 0": (point_with(sigma_mm=-0.1), "sigma_mm below 0"),
    "a point that may move": (point_with(moves="no"), "point 7 has no moves"),
    "no error": (lambda whole: whole.update(reprojection_rms_px=None), "it has no reprojection_rms_px"),
    "no number at all": (lambda whole: whole.update(reprojection_rms_px=float("inf")), "it has no reprojection_rms_px"),
    "feet": (lambda whole: whole["scale"].update(metres_per_unit=0.3048), "its unit is no metre"),
    "a scale from nowhere": (lambda whole: whole["scale"].pop("source"), "its scale has no source"),
    "no roughness": (lambda whole: whole.update(roughness={}), "its roughness has no rotation_deg"),
    "warnings that are numbers": (lambda whole: whole.update(warnings=[1]), "its warnings are no sentences"),
}


@pytest.mark.parametrize("kind", BROKEN)
def test_what_is_broken_gets_a_sentence(motion: ModuleType, kind: str) -> None:
    damage, sentence = BROKEN[kind]
    whole = content()
    damage(whole)
    with pytest.raises(Error, match=sentence):
        motion.parse(json.dumps(whole))


@pytest.mark.parametrize(
    ("text", "sentence"), [("{", "not JSON"), ("[]", "no motion"), ('{"frames": []}', "no motion")]
)
def test_what_is_no_motion_file_gets_a_sentence(motion: ModuleType, text: str, sentence: str) -> None:
    with pytest.raises(Error, match=sentence):
        motion.parse(text)
