"""A tracks.json as data: read strictly, and written again."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from facewright import FacewrightError
from numpy.typing import NDArray

from . import calibration
from .checks import need, numbers, once

REGIONS = ("skin", "mouth", "eyes", "brows")
METHODS = ("default", "paper")

# Decimals that are written: what single precision keeps of a pixel.
DECIMALS = 5


@dataclass(frozen=True)
class Frame:
    """What became of a frame; `cam_from_head` are the rows of a 4 × 4 pose."""

    name: str
    used: bool
    reason: str
    cam_from_head: list[list[float]] | None


@dataclass(frozen=True)
class Gap:
    """Frames, first and last, in which a track was not found."""

    first: int
    last: int
    reason: str


@dataclass(frozen=True, eq=False)
class Track:
    """A point of the face in the frames in which it was found, ascending.

    `points` are (n, 2) pixels of the picture as filmed: x right, y down, centres at integers; `sigmas` (n,) pixels.
    `place` is where it is on the landmarks' head, head frame, metres.
    """

    id: int
    reference: int
    region: str
    frames: NDArray[np.int64]
    points: NDArray[np.float64]
    sigmas: NDArray[np.float64]
    gaps: tuple[Gap, ...] = ()
    place: tuple[float, float, float] | None = None


@dataclass(frozen=True, eq=False)
class Tracks:
    """All of a tracks.json.

    `camera` is as in a camera.json, `window` the side of the tracker's, pixels, `interocular` the distance of the
    pupils of the landmarks' head, metres.
    """

    version: str
    method: str
    camera: dict[str, Any]
    window: int
    frames: tuple[Frame, ...]
    tracks: tuple[Track, ...]
    interocular: float | None = None
    warnings: tuple[str, ...] = ()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the pictures."""
        return self.camera["width"], self.camera["height"]

    def with_tracks(self, tracks: list[Track]) -> "Tracks":
        """The same frames with other tracks."""
        return replace(self, tracks=tuple(tracks))

    def of_frames(self, names: Sequence[str]) -> "Tracks":
        """As they concern other frames of the same clip, known by their names; some may not have been tracked."""
        rows = {frame.name: frame for frame in self.frames}
        frames = tuple(rows.get(name) or Frame(name, False, "not tracked", None) for name in names)
        places = {name: k for k, name in enumerate(names)}
        index = np.array([places.get(frame.name, -1) for frame in self.frames], np.int64)
        moved = [moved for track in self.tracks if (moved := _moved(track, index)) is not None]
        return replace(self, frames=frames, tracks=tuple(moved))


def parse(text: str) -> Tracks:
    """Read a tracks.json; raises FacewrightError with what is wrong."""
    try:
        content = json.loads(text)
    except ValueError as error:
        raise FacewrightError(f"it is not JSON: {error}") from error
    if not isinstance(content, dict) or "tracks" not in content:
        raise FacewrightError("it holds no tracks")
    version, method = need(content, "version", str), need(content, "method", str)
    if method not in METHODS:
        raise FacewrightError(f"its method is {method}, not one of {', '.join(METHODS)}")
    camera = need(content, "camera", dict)
    calibration.parse(json.dumps(camera))
    frames = tuple(_frame(row, k) for k, row in enumerate(need(content, "frames", list)))
    once([frame.name for frame in frames], "frame")
    tracks = tuple(_track(row, k, len(frames)) for k, row in enumerate(need(content, "tracks", list)))
    once([track.id for track in tracks], "track")
    window = need(content, "window", int)
    if window < 1:
        raise FacewrightError(f"its window is {window} pixels, which no tracker has")
    warnings = tuple(str(warning) for warning in content.get("warnings", []))
    return Tracks(version, method, camera, window, frames, tracks, _length(content), warnings)


def _length(content: dict[str, Any]) -> float | None:
    interocular = content.get("interocular")
    if interocular is not None and not (isinstance(interocular, float) and interocular > 0.0):
        raise FacewrightError("the distance of its pupils is no length")
    return interocular


def _moved(track: Track, index: NDArray[np.int64]) -> Track | None:
    """A track with frames of other numbers, −1 for one that is gone; None if it is seen in none."""
    frames = index[track.frames]
    order = np.argsort(frames)
    order = order[frames[order] >= 0]
    if len(order) == 0:
        return None
    frames, wanted = frames[order], index[track.reference]
    reference = int(frames[np.abs(frames - wanted).argmin()] if wanted >= 0 else frames[0])
    missing = [(int(index[k]), gap.reason) for gap in track.gaps for k in range(gap.first, gap.last + 1)]
    gaps = runs((frame, reason) for frame, reason in missing if frame >= 0)
    points, sigmas = track.points[order], track.sigmas[order]
    return replace(track, reference=reference, frames=frames, points=points, sigmas=sigmas, gaps=gaps)


def runs(missing: Iterable[tuple[int, str]]) -> tuple[Gap, ...]:
    """Gaps of single frames with their reasons, joined where they touch."""
    gaps: list[Gap] = []
    for frame, reason in sorted(missing):
        if gaps and gaps[-1].last == frame - 1 and gaps[-1].reason == reason:
            gaps[-1] = replace(gaps[-1], last=frame)
        else:
            gaps.append(Gap(frame, frame, reason))
    return tuple(gaps)


def to_text(tracks: Tracks) -> str:
    """The text of a tracks.json."""
    points = np.zeros(len(tracks.frames), np.int64)
    for track in tracks.tracks:
        points[track.frames] += 1
    content = {
        "version": tracks.version,
        "method": tracks.method,
        "camera": tracks.camera,
        "window": tracks.window,
        "frames": [frame.__dict__ | {"points": int(n)} for frame, n in zip(tracks.frames, points)],
        "tracks": [_row(track) for track in tracks.tracks],
    }
    if tracks.interocular is not None:
        content["interocular"] = tracks.interocular
    if tracks.warnings:
        content["warnings"] = list(tracks.warnings)
    return json.dumps(content, ensure_ascii=False, separators=(",", ":")) + "\n"


def _row(track: Track) -> dict[str, Any]:
    points, sigmas = np.round(track.points, DECIMALS).tolist(), np.round(track.sigmas, DECIMALS).tolist()
    place = {} if track.place is None else {"place": list(track.place)}
    return place | {
        "id": track.id,
        "reference": track.reference,
        "region": track.region,
        "observations": [[frame, *uv, sigma] for frame, uv, sigma in zip(track.frames.tolist(), points, sigmas)],
        "gaps": [[gap.first, gap.last, gap.reason] for gap in track.gaps],
    }


def _frame(row: Any, number: int) -> Frame:
    where = f"frame {number}"
    name, used = need(row, "name", str, where), need(row, "used", bool, where)
    reason = need(row, "reason", str, where) if row.get("reason") is not None else ""
    pose = row.get("cam_from_head")
    if pose is not None:
        rows = numbers(pose, (4, 4))
        if rows is None:
            raise FacewrightError(f"the pose of {name} is no 4 × 4 matrix")
        pose = rows.tolist()
    return Frame(name, used, reason, pose)


def _track(row: Any, number: int, count: int) -> Track:
    track_id = need(row, "id", int, f"track number {number}")
    where = f"track {track_id}"
    region, reference = need(row, "region", str, where), need(row, "reference", int, where)
    if region not in REGIONS:
        raise FacewrightError(f"{where} has the region {region}, not one of {', '.join(REGIONS)}")
    rows = numbers(need(row, "observations", list, where), (-1, 4))
    if rows is None or len(rows) == 0:
        raise FacewrightError(f"{where} has no observations of the form frame, u, v, sigma")
    frames = rows[:, 0].astype(np.int64)
    if (frames != rows[:, 0]).any() or (np.diff(frames) <= 0).any():
        raise FacewrightError(f"the frames of {where} are not ascending whole numbers")
    if frames[0] < 0 or frames[-1] >= count:
        raise FacewrightError(f"{where} is seen outside the {count} frames")
    if not (rows[:, 3] > 0.0).all():
        raise FacewrightError(f"{where} has a sigma that is not above 0")
    if reference not in frames:
        raise FacewrightError(f"{where} is not seen in its own reference frame {reference}")
    gaps = tuple(_gap(gap, where, frames, count) for gap in need(row, "gaps", list, where))
    return Track(track_id, reference, region, frames, rows[:, 1:3], rows[:, 3], gaps, _place(row, where))


def _place(row: dict[str, Any], where: str) -> tuple[float, float, float] | None:
    if row.get("place") is None:
        return None
    place = numbers([row["place"]], (1, 3))
    if place is None:
        raise FacewrightError(f"the place of {where} is no point")
    x, y, z = place[0].tolist()
    return x, y, z


def _gap(row: Any, where: str, frames: NDArray[np.int64], count: int) -> Gap:
    if not (isinstance(row, list) and len(row) == 3 and [type(value) for value in row] == [int, int, str]):
        raise FacewrightError(f"{where} has a gap that is not of the form first, last, reason")
    gap = Gap(*row)
    if not 0 <= gap.first <= gap.last < count:
        raise FacewrightError(f"{where} has a gap outside the {count} frames")
    if ((frames >= gap.first) & (frames <= gap.last)).any():
        raise FacewrightError(f"{where} is seen within its gap {gap.first} to {gap.last}")
    return gap
