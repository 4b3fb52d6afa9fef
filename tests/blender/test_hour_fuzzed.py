"""Whatever an artist does in whatever order, the file stays one to go on with.

Two hundred sequences of sixteen actions take about a minute, as each action is followed by a look at all that is in the
file; their heads have few vertices and keys, so that it is not more.
"""

import random
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import artist_features  # noqa: F401 — its actions are the artist's too
import bpy
import pytest
from artist import Artist, do, drawn
from consistent import faults
from people import ANNA, BEN, Person, clip_of
from small_people import VERTICES, library
from tracking import module

SEQUENCES, LENGTH = 200, 16
FRAMES = 8
Sequence = list[tuple[str, int]]


def failure(sequence: Sequence, folder: Path, monkeypatch: Any) -> tuple[int, list[str]]:
    """The number of actions after which a file is not consistent, and what is wrong; none where all is well."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
    folder = Path(mkdtemp(dir=folder))
    artist = Artist(folder, [_film_of(folder, person) for person in (ANNA, BEN)], monkeypatch)
    artist.opened()
    for done, (name, seed) in enumerate(sequence, 1):
        try:
            do(artist, name, seed)
            wrong = faults(VERTICES)
        except Exception as error:  # noqa: BLE001 — whatever an action raises is a fault, to be replayed
            wrong = [f"{name}: {error!r}"]
        if wrong:
            return done, wrong
    return len(sequence), []


def _film_of(folder: Path, person: Person) -> str:
    """A clip of a few frames."""
    clip = clip_of(folder, person)
    for number in range(1, FRAMES):
        (Path(clip) / f"frame_{number:02}.png").touch()
    return clip


def shortest(sequence: Sequence, folder: Path, monkeypatch: Any) -> Sequence:
    """A failing sequence without the actions that it fails without."""
    for number in reversed(range(len(sequence) - 1)):
        shorter = sequence[:number] + sequence[number + 1 :]
        if failure(shorter, folder, monkeypatch)[1]:
            sequence = shorter
    return sequence


@pytest.mark.parametrize("seed", range(SEQUENCES))
def test_whatever_an_artist_does_leaves_a_consistent_file(seed: int, tmp_path: Path, monkeypatch: Any) -> None:
    library(monkeypatch, {person.name: person for person in (ANNA, BEN)}, rounds=1)
    # Portraits are most of the time otherwise.
    monkeypatch.setattr(module("scene.portrait"), "SIDE", 64)
    sequence = drawn(random.Random(seed), LENGTH)
    done, wrong = failure(sequence, tmp_path, monkeypatch)
    if wrong:
        short = shortest(sequence[:done], tmp_path, monkeypatch)
        _, said = failure(short, tmp_path, monkeypatch)
        pytest.fail(f"seed {seed}, action {done}: {wrong}\nshortest: {short}\nthere: {said}", pytrace=False)
