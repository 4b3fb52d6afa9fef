"""matches.json: what is read from it, and a sentence for what is broken."""

import json
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

Content = dict[str, Any]


def content() -> Content:
    pair = {
        "a": "frame_1",
        "b": "frame_4",
        "points": [[1.0, 2.0, 3.25, 4.0, 1], [5.0, 6.0, 7.0, 8.0, 0]],
        "tracked": [[3.5, 4.0], None],
        "outcomes": ["moved: its neighbours", "rejected: no match"],
        "violations_before": 2,
        "violations_after": 0,
    }
    return {"schema": 1, "pairs": [pair]}


def test_what_is_in_the_file_is_read_and_written_again(facewright: ModuleType, tmp_path: Path) -> None:
    matches = facewright.Matches.parse(json.dumps(content()))
    (pair,) = matches.pairs
    assert len(matches) == 1 and len(pair) == 2 and (pair.a, pair.b) == ("frame_1", "frame_4")
    assert pair.points_a.tolist() == [[1.0, 2.0], [5.0, 6.0]] and pair.points_b[0].tolist() == [3.25, 4.0]
    assert pair.kept.tolist() == [True, False] and pair.outcomes == content()["pairs"][0]["outcomes"]
    assert pair.tracked[0].tolist() == [3.5, 4.0] and np.isnan(pair.tracked[1]).all()
    assert (pair.violations_before, pair.violations_after) == (2, 0)
    matches.write(tmp_path / "matches.json")
    assert json.loads((tmp_path / "matches.json").read_text()) == content() == json.loads(str(matches))
    assert facewright.Matches.read(tmp_path / "matches.json") == matches


def test_an_older_file_has_no_schema(facewright: ModuleType) -> None:
    older = {"pairs": content()["pairs"]}
    assert json.loads(str(facewright.Matches.parse(json.dumps(older)))) == content()


@pytest.mark.parametrize(
    ("field", "value", "sentence"),
    [
        ("tracked", [None], "frame_1 and frame_4 have 2 points and 1 tracked"),
        ("outcomes", [], "frame_1 and frame_4 have 2 points and 0 outcomes"),
        ("points", [[1.0, 2.0, 3.0, 4.0, 2]] * 2, "match 0 of frame_1 and frame_4 is marked 2"),
        ("points", [[1.0, 2.0, 3.0, 4.0]] * 2, "has 4 values, not"),
    ],
)
def test_what_cannot_be_is_told(facewright: ModuleType, field: str, value: Any, sentence: str) -> None:
    broken = content()
    broken["pairs"][0][field] = value
    with pytest.raises(facewright.InputError, match=sentence):
        facewright.Matches.parse(json.dumps(broken))
