"""A survey of a clip as Python sees it."""

import os
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(os.environ["FACEWRIGHT_ROOT"])
CLIP = ROOT / "tests/data/clip"


def test_a_survey_tells_of_each_look_and_of_a_part(facewright: ModuleType, assets: Path) -> None:
    found = facewright.survey([CLIP / "frames"], assets=assets, numbers=range(2, 19, 2)).result()
    assert (found.frames, found.size, found.findings) == (9, (400, 300), []) and len(found.summary) == 2
    assert [look.number for look in found.looks] == list(range(2, 19, 2)) and found.looks[1].name == "frame_04"
    look = found.looks[0]
    assert look.usable and look.reason_kind == "yaw" and look.thumbnail.shape == (72, 96, 3)
    left, top, width, height = look.rectangle
    assert left + width <= 400 and top + height <= 300 and look.eye_distance_px > 30 and look.sharpness > 0.0
    assert -30 < look.turn_deg[0] < -10 and abs(look.turn_deg[2]) < 5
    part = found.part({2, 4, 6})
    assert part.frames == 3 and part.findings[0][0] in {"one_sided", "turns_little"}
    assert '"looks":[{' in found.to_json()


def test_pictures_without_a_face_are_refused_for_their_clip(facewright: ModuleType, assets: Path) -> None:
    with pytest.raises(facewright.FilmError, match="in any of the 99 frames") as refused:
        facewright.check_face([CLIP / "no_face.jpg"], assets=assets, frames=99).result()
    assert refused.value.kind == "no_face"
    assert facewright.check_face([CLIP / "frames/frame_10.jpg"], assets=assets, frames=9).result() is None
