"""report.json: what is read from it, and by what its frames are counted."""

import json
from types import ModuleType
from typing import Any

import pytest

Content = dict[str, Any]


def frame(name: str, reason: str, kind: str | None, used: bool = False) -> Content:
    told = {"reason_kind": kind} if kind else {}
    return {"name": name, "used": used, "reason": reason, "cam_from_head": None, "reprojection_rms_px": None} | told


def content(*frames: Content) -> Content:
    return {
        "version": "0.1.0",
        "method": "default",
        "camera": {"width": 640, "height": 480, "fx": 700.0, "fy": 700.0, "cx": 319.5, "cy": 239.5, "source": "exif"},
        "frames": list(frames),
        "points": 30,
        "landmarks68": [[0.0, 0.01, 0.02]] * 68,
        "scale": {"source": "eyes", "metres_per_unit": 1.0, "relative_sigma": 0.03},
        "warnings": ["turn the head more"],
    }


def read(facewright: ModuleType, *frames: Content) -> Any:
    return facewright.Report.parse(json.dumps(content(*frames)))


def test_frames_that_were_left_out_are_counted_by_the_kind_of_their_reason(facewright: ModuleType) -> None:
    report = read(
        facewright,
        frame("a", "yaw +3°", "yaw", used=True),
        frame("b", "10 % as sharp as the others", "blurred"),
        frame("c", "its sharpness is 30 % of what is usual", "blurred"),
        frame("d", "eyes closed, posed by its landmarks alone", "eyes_closed"),
    )
    assert report.left_out == [(2, "blurred"), (1, "eyes closed")]
    assert [f.reason_kind for f in report.frames] == ["yaw", "blurred", "blurred", "eyes_closed"]


def test_an_older_report_is_counted_by_how_its_sentences_begin(facewright: ModuleType) -> None:
    older = (
        frame("a", "yaw +3°", None, used=True),
        frame("b", "blurred: 10 % of the clip's usual sharpness", None),
        frame("c", "blurred: 30 % of the clip's usual sharpness", None),
        frame("d", "expression too strong (0.61)", None),
    )
    report = read(facewright, *older)
    assert report.left_out == [(2, "blurred"), (1, "expression too strong")]
    assert {f.reason_kind for f in report.frames} == {None}
    assert all("reason_kind" not in f for f in json.loads(str(report))["frames"])


def test_a_kind_that_is_no_word_is_refused(facewright: ModuleType) -> None:
    with pytest.raises(facewright.InputError, match="the reason_kind of frame a"):
        read(facewright, frame("a", "", None) | {"reason_kind": 3})


def measure(name: str, value: float) -> Content:
    ranges = {"usual": [55.0, 72.0], "possible": [48.0, None]}
    return {"name": name, "value": value, "unit": "mm", "sentence": f"{name} are {value} mm"} | ranges


def test_a_verdict_is_read_with_its_measures_and_an_older_report_has_none(facewright: ModuleType) -> None:
    assert read(facewright).quality is None
    measures = [measure("eyes", 63.0), measure("ears", 52.0)]
    judged = content() | {"quality": {"verdict": "warned", "measures": measures}}
    quality = facewright.Report.parse(json.dumps(judged)).quality
    assert quality.verdict == "warned" and [m.name for m in quality.measures] == ["eyes", "ears"]
    (unusual,) = quality.unusual
    assert (unusual.value, unusual.unit, unusual.sentence) == (52.0, "mm", "ears are 52.0 mm")
    assert (unusual.usual, unusual.possible) == ((55.0, 72.0), (48.0, None))


def test_a_measure_that_is_no_number_is_refused(facewright: ModuleType) -> None:
    judged = content() | {"quality": {"verdict": "good", "measures": [measure("eyes", 1e999)]}}
    with pytest.raises(facewright.InputError):
        facewright.Report.parse(json.dumps(judged))
