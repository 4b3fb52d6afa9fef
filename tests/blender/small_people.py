"""People of few vertices and keys, so that a head of one is made in milliseconds."""

import json
from functools import cache
from typing import Any

import numpy as np
from people import PARTS, Person, result
from tracking import Finished, module

KEYS = ("jawOpen", "mouthSmileLeft", "mouthSmileRight", "eyeBlinkLeft", "eyeBlinkRight", "viseme_aa")
# How these keys turn the left eye, radians to the left and up.
TURNS = {
    "eyeLookOutLeft": (0.2, 0),
    "eyeLookInLeft": (-0.2, 0),
    "eyeLookUpLeft": (0, 0.2),
    "eyeLookDownLeft": (0, -0.2),
}
# Points on a side of each part: a grid.
SIDES = dict.fromkeys(sorted(PARTS), 3) | {"skin": 5}
VERTICES = {name: side * side for name, side in SIDES.items()}
EXPRESSIONS = [("happiness", [("mouthSmileLeft", 0.9), ("mouthSmileRight", 0.9)]), ("surprise", [("jawOpen", 0.6)])]


@cache
def small(person: Person) -> Any:
    """What the library makes of a person, but small."""
    made, parts, grids, quads = result(person), [], [], []
    for number, (name, side) in enumerate(SIDES.items()):
        first, corners = sum(map(len, grids)), sum(map(len, quads))
        grids.append(_grid(side, number))
        quads.append(first + _quads(side))
        parts.append((name, (first, first + side * side), (corners, corners + (side - 1) ** 2)))
    made.parts, made.generic_positions = parts, np.concatenate(grids)
    made.positions = (made.generic_positions * person.size).astype(np.float32)
    made.quads = np.concatenate(quads).astype(np.uint32)
    made.uvs = np.tile(np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32), (len(made.quads), 1, 1))
    made.keys = [_key(name, number, made.positions) for number, name in enumerate((*KEYS, *TURNS))]
    first, last = next(span for name, span, _ in parts if name == "eye_left")
    for name, _, offsets in made.keys:
        if name in TURNS:
            aside, up = TURNS[name]
            offsets[first:last] = _turn(aside, up, made.positions[first:last])
    made.expressions = [(person.name.lower(), [("jawOpen", 0.5)]), *EXPRESSIONS]
    made.report = json.dumps(json.loads(made.report) | {"warnings": [f"this is {person.name}"]})
    return made


def library(monkeypatch: Any, folders: dict[str, Person], rounds: int = 0) -> None:
    """Lets the library reconstruct the small person of a clip's folder, at once or in some steps."""

    def reconstruct(frames: list[str], **_settings: Any) -> Finished:
        job = Finished(small(folders[frames[0].split("/")[-2]]))
        job.rounds = rounds
        return job

    monkeypatch.setattr(module("reconstruct.actions"), "reconstruct", reconstruct)


def _grid(side: int, number: int) -> Any:
    """(side², 3) points of a square of 0.2 m, a little behind that of the part before."""
    x, y = np.meshgrid(np.linspace(-0.1, 0.1, side), np.linspace(-0.1, 0.1, side))
    return np.stack([x.ravel(), y.ravel(), np.full(side * side, -0.01 * number)], axis=-1).astype(np.float32)


def _quads(side: int) -> Any:
    rows, columns = np.meshgrid(np.arange(side - 1), np.arange(side - 1), indexing="ij")
    corner = (rows * side + columns).ravel()
    return np.stack([corner, corner + 1, corner + side + 1, corner + side], axis=-1)


def _key(name: str, number: int, positions: Any) -> tuple[str, Any, Any]:
    """A key that moves every vertex, so that every part has it; each key otherwise."""
    indices = np.arange(len(positions), dtype=np.uint32)
    offsets = np.roll(positions, number, axis=1) * 0.05 * (number + 1)
    return name, indices, np.ascontiguousarray(offsets, np.float32)


def _turn(aside: float, up: float, positions: Any) -> Any:
    """By how much points move that turn about the eye's middle."""
    centre = np.array([0.03, 0.0, -0.05])
    across = np.array([[np.cos(aside), 0, np.sin(aside)], [0, 1, 0], [-np.sin(aside), 0, np.cos(aside)]])
    nod = np.array([[1, 0, 0], [0, np.cos(up), np.sin(up)], [0, -np.sin(up), np.cos(up)]])
    return (positions - centre) @ (across @ nod).T + centre - positions
