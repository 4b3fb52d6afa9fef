"""What a movie clip remembers of a tracks.json besides the markers: a custom property of the clip, JSON.

Frames are the clip's own.
"""

import json
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from typing import Any

import bpy

from ..engine import Tracks

RECORD = "facewright_tracks"


@dataclass(frozen=True)
class Gap:
    """Frames, first and last, in which a track was not found."""

    first: int
    last: int
    reason: str


@dataclass(frozen=True)
class Mark:
    """A track as it was written: `sigmas` from the frame `first` on, 0 where it was not found."""

    id: int
    reference: int
    region: str
    first: int
    sigmas: tuple[float, ...]
    gaps: tuple[Gap, ...]
    weight: float
    fingerprint: int
    place: tuple[float, float, float] | None = None

    def sigma(self, frame: int) -> float:
        """Standard deviation in a frame, pixels; 0 where the track was not found."""
        index = frame - self.first
        return self.sigmas[index] if 0 <= index < len(self.sigmas) else 0.0


@dataclass(frozen=True)
class Record:
    """A tracks.json without its observations; `frames` are its rows, each with the clip's number as `clip_frame`."""

    object: str
    version: str
    method: str
    camera: dict[str, Any]
    window: int
    frames: tuple[dict[str, Any], ...]
    marks: dict[str, Mark] = field(default_factory=dict)
    interocular: float | None = None
    warnings: tuple[str, ...] = ()

    @property
    def tracks(self) -> Tracks:
        """As a tracks.json without tracks; raises FacewrightError where the record is broken."""
        fields = ("version", "method", "camera", "window", "frames", "interocular", "warnings")
        return Tracks.parse(json.dumps({key: getattr(self, key) for key in fields} | {"tracks": []}))


def store(clip: bpy.types.MovieClip, record: Record) -> None:
    """Keep a record with a clip."""
    clip[RECORD] = json.dumps(asdict(record), ensure_ascii=False, separators=(",", ":"))


def load(clip: bpy.types.MovieClip) -> Record | None:
    """The record of a clip; None without one, or with one that is broken. Cheap when asked again, for panels."""
    text = clip.get(RECORD)
    return _parse(text) if isinstance(text, str) else None


def forget(clip: bpy.types.MovieClip) -> None:
    """Take the record away."""
    if RECORD in clip:
        del clip[RECORD]


@lru_cache(maxsize=4)
def _parse(text: str) -> Record | None:
    try:
        content = json.loads(text)
        marks = {name: _mark(mark) for name, mark in content.pop("marks").items()}
        lists = {key: tuple(content[key]) for key in ("frames", "warnings") if key in content}
        return Record(**content | lists, marks=marks)
    except (AttributeError, KeyError, TypeError, ValueError):
        return None


def _mark(content: dict[str, Any]) -> Mark:
    gaps = tuple(Gap(**gap) for gap in content["gaps"])
    place = content.get("place")
    more: dict[str, Any] = {"gaps": gaps, "sigmas": tuple(content["sigmas"]), "place": place and tuple(place)}
    return Mark(**content | more)
