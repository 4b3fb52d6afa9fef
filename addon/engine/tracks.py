"""A tracks.json as data: read strictly, and written again."""

import json
from collections import Counter
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from facewright import FacewrightError
from numpy.typing import NDArray

from . import calibration

REGIONS = ("skin", "mouth", "eyes", "brows")
METHODS = ("default", "paper")

# Decimals that are written: what single precision keeps of a pixel.
DECIMALS = 5
# As the library chooses a tracker's window: of the distance between the eyes, within limits.
EYES_M, PATCH, WINDOWS_PX = 0.063, 0.22, (7, 31)


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
    """

    id: int
    reference: int
    region: str
    frames: NDArray[np.int64]
    points: NDArray[np.float64]
    sigmas: NDArray[np.float64]
    gaps: tuple[Gap, ...] = ()


@dataclass(frozen=True, eq=False)
class Tracks:
    """All of a tracks.json. `camera` is as in a camera.json; `window` is the tracker's, pixels, when it is told."""

    version: str
    method: str
    camera: dict[str, Any]
    frames: tuple[Frame, ...]
    tracks: tuple[Track, ...]
    window: int | None = None

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the pictures."""
        return self.camera["width"], self.camera["height"]

    def window_px(self, frame: int) -> int:
        """Side of the tracker's window around points of a frame: the one that is told, or the library's choice."""
        pose = self.frames[frame].cam_from_head
        if self.window is not None or pose is None or not pose[2][3] > 0.0:
            return self.window or WINDOWS_PX[1]
        wanted = round(PATCH * EYES_M * self.camera["fx"] / pose[2][3]) | 1
        return int(np.clip(wanted, *WINDOWS_PX))

    def with_tracks(self, tracks: list[Track]) -> "Tracks":
        """The same frames with other tracks."""
        return replace(self, tracks=tuple(tracks))


def parse(text: str) -> Tracks:
    """Read a tracks.json; raises FacewrightError with what is wrong."""
    try:
        content = json.loads(text)
    except ValueError as error:
        raise FacewrightError(f"it is not JSON: {error}") from error
    if not isinstance(content, dict) or "tracks" not in content:
        raise FacewrightError("it holds no tracks")
    version, method = _need(content, "version", str), _need(content, "method", str)
    if method not in METHODS:
        raise FacewrightError(f"its method is {method}, not one of {', '.join(METHODS)}")
    camera = _need(content, "camera", dict)
    calibration.parse(json.dumps(camera))
    frames = tuple(_frame(row, k) for k, row in enumerate(_need(content, "frames", list)))
    _once([frame.name for frame in frames], "frame")
    tracks = tuple(_track(row, k, len(frames)) for k, row in enumerate(_need(content, "tracks", list)))
    _once([track.id for track in tracks], "track")
    window = _need(content, "window", int) if content.get("window") is not None else None
    if window is not None and window < 3:
        raise FacewrightError(f"its window is {window} pixels, which no tracker has")
    return Tracks(version, method, camera, frames, tracks, window)


def to_text(tracks: Tracks) -> str:
    """The text of a tracks.json."""
    points = np.zeros(len(tracks.frames), np.int64)
    for track in tracks.tracks:
        points[track.frames] += 1
    content = {
        "version": tracks.version,
        "method": tracks.method,
        "camera": tracks.camera,
        "frames": [frame.__dict__ | {"points": int(n)} for frame, n in zip(tracks.frames, points)],
        "tracks": [_row(track) for track in tracks.tracks],
    }
    if tracks.window is not None:
        content["window"] = tracks.window
    return json.dumps(content, ensure_ascii=False, separators=(",", ":")) + "\n"


def _row(track: Track) -> dict[str, Any]:
    points, sigmas = np.round(track.points, DECIMALS).tolist(), np.round(track.sigmas, DECIMALS).tolist()
    return {
        "id": track.id,
        "reference": track.reference,
        "region": track.region,
        "observations": [[frame, *uv, sigma] for frame, uv, sigma in zip(track.frames.tolist(), points, sigmas)],
        "gaps": [[gap.first, gap.last, gap.reason] for gap in track.gaps],
    }


def _frame(row: Any, number: int) -> Frame:
    where = f"frame {number}"
    name, used = _need(row, "name", str, where), _need(row, "used", bool, where)
    reason = _need(row, "reason", str, where) if row.get("reason") is not None else ""
    pose = row.get("cam_from_head")
    if pose is not None:
        rows = _numbers(pose, (4, 4))
        if rows is None:
            raise FacewrightError(f"the pose of {name} is no 4 × 4 matrix")
        pose = rows.tolist()
    return Frame(name, used, reason, pose)


def _track(row: Any, number: int, count: int) -> Track:
    track_id = _need(row, "id", int, f"track number {number}")
    where = f"track {track_id}"
    region, reference = _need(row, "region", str, where), _need(row, "reference", int, where)
    if region not in REGIONS:
        raise FacewrightError(f"{where} has the region {region}, not one of {', '.join(REGIONS)}")
    rows = _numbers(_need(row, "observations", list, where), (-1, 4))
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
    gaps = tuple(_gap(gap, where, frames, count) for gap in _need(row, "gaps", list, where))
    return Track(track_id, reference, region, frames, rows[:, 1:3], rows[:, 3], gaps)


def _gap(row: Any, where: str, frames: NDArray[np.int64], count: int) -> Gap:
    if not (isinstance(row, list) and len(row) == 3 and [type(value) for value in row] == [int, int, str]):
        raise FacewrightError(f"{where} has a gap that is not of the form first, last, reason")
    gap = Gap(*row)
    if not 0 <= gap.first <= gap.last < count:
        raise FacewrightError(f"{where} has a gap outside the {count} frames")
    if ((frames >= gap.first) & (frames <= gap.last)).any():
        raise FacewrightError(f"{where} is seen within its gap {gap.first} to {gap.last}")
    return gap


def _need(content: Any, key: str, kind: type, where: str = "") -> Any:
    """A value of a kind that must be there."""
    value = content.get(key) if isinstance(content, dict) else None
    # `True` is an `int` to Python.
    if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
        raise FacewrightError(f"{where or 'it'} has no {key}")
    return value


def _numbers(rows: Any, shape: tuple[int, int]) -> NDArray[np.float64] | None:
    """Finite numbers of a shape; None if they are not."""
    try:
        values = np.array(rows)
        values = values.reshape(shape) if values.ndim == 2 and values.shape[1] == shape[1] else None
    except ValueError:
        return None
    if values is None or values.dtype.kind not in "if" or not np.isfinite(values).all():
        return None
    return values.astype(np.float64)


def _once(names: list[Any], kind: str) -> None:
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise FacewrightError(f"it has the {kind} {twice[0]} twice")
