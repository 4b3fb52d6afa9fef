"""A motion.json as data, read strictly: where the camera was in each frame, and the points of the head that it saw."""

import json
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from facewright import FacewrightError
from numpy.typing import NDArray

from . import calibration
from .calibration import Camera
from .checks import need, number, number_or_none, numbers, once
from .tracks import METHODS, REGIONS

# By how much the product of a rotation and its transpose may differ from one.
RIGID = 1e-4


@dataclass(frozen=True, eq=False)
class Frame:
    """What became of a frame; `cam_from_head` is its (4, 4) pose, None where it was left out for the reason."""

    name: str
    used: bool
    reason: str
    cam_from_head: NDArray[np.float64] | None
    rotation_sigma_deg: float | None
    translation_sigma_mm: float | None
    rms_px: float | None
    points: int


@dataclass(frozen=True)
class Point:
    """A point of the head, metres in the head frame; one that `moves` against the head took no part in the solution."""

    id: int
    position: tuple[float, float, float]
    sigma_mm: float
    frames: int
    rms_px: float
    region: str
    moves: bool


@dataclass(frozen=True)
class Scale:
    """Where the size of things comes from, and its standard deviation as a part of it."""

    source: str
    relative_sigma: float


@dataclass(frozen=True)
class Roughness:
    """How much the path shakes from frame to frame."""

    rotation_deg: float
    translation_mm: float


@dataclass(frozen=True, eq=False)
class Motion:
    """All of a motion.json; `focal_sigma_px` is None where the focal length was given."""

    version: str
    method: str
    camera: Camera
    focal_sigma_px: float | None
    frames: tuple[Frame, ...]
    points: tuple[Point, ...]
    scale: Scale
    rms_px: float
    roughness: Roughness
    warnings: tuple[str, ...]

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the pictures."""
        return self.camera.width, self.camera.height

    @property
    def posed(self) -> list[int]:
        """Numbers of the frames that have a pose."""
        return [k for k, frame in enumerate(self.frames) if frame.cam_from_head is not None]


@lru_cache(maxsize=4)
def parse(text: str) -> Motion:
    """Read a motion.json; raises FacewrightError with what is wrong. Cheap when asked again, so that panels may."""
    try:
        content = json.loads(text)
    except ValueError as error:
        raise FacewrightError(f"it is not JSON: {error}") from error
    if not isinstance(content, dict) or "frames" not in content or "scale" not in content:
        raise FacewrightError("it holds no motion")
    version, method = need(content, "version", str), need(content, "method", str)
    if method not in METHODS:
        raise FacewrightError(f"its method is {method}, not one of {', '.join(METHODS)}")
    frames = tuple(_frame(row, k) for k, row in enumerate(need(content, "frames", list)))
    once([frame.name for frame in frames], "frame")
    points = tuple(_point(row, k) for k, row in enumerate(need(content, "points", list)))
    once([point.id for point in points], "point")
    if all(frame.cam_from_head is None for frame in frames):
        raise FacewrightError("none of its frames has a pose")
    return Motion(
        version=version,
        method=method,
        camera=calibration.parse(json.dumps(need(content, "camera", dict))).camera,
        focal_sigma_px=_at_least_0(content, "focal_sigma_px", "it"),
        frames=frames,
        points=points,
        scale=_scale(need(content, "scale", dict)),
        rms_px=number(content, "reprojection_rms_px"),
        roughness=_roughness(need(content, "roughness", dict)),
        warnings=_warnings(need(content, "warnings", list)),
    )


def _frame(row: Any, index: int) -> Frame:
    where = f"frame {index}"
    name, used = need(row, "name", str, where), need(row, "used", bool, where)
    where = f"frame {name}"
    return Frame(
        name=name,
        used=used,
        reason=need(row, "reason", str, where) if row.get("reason") is not None else "",
        cam_from_head=_pose(row["cam_from_head"], name) if row.get("cam_from_head") is not None else None,
        rotation_sigma_deg=_at_least_0(row, "rotation_sigma_deg", where),
        translation_sigma_mm=_at_least_0(row, "translation_sigma_mm", where),
        rms_px=_at_least_0(row, "reprojection_rms_px", where),
        points=need(row, "points", int, where),
    )


def _pose(rows: Any, name: str) -> NDArray[np.float64]:
    pose = numbers(rows, (4, 4))
    if pose is None:
        raise FacewrightError(f"the pose of {name} is no 4 × 4 matrix")
    rotation = pose[:3, :3]
    skew = np.abs(rotation @ rotation.T - np.eye(3)).max()
    if skew > RIGID or np.linalg.det(rotation) < 0.0 or (pose[3] != (0.0, 0.0, 0.0, 1.0)).any():
        raise FacewrightError(f"the pose of {name} is no rotation with a translation")
    return pose


def _point(row: Any, index: int) -> Point:
    point_id = need(row, "id", int, f"point number {index}")
    where = f"point {point_id}"
    region = need(row, "region", str, where)
    if region not in REGIONS:
        raise FacewrightError(f"{where} has the region {region}, not one of {', '.join(REGIONS)}")
    position = numbers([need(row, "position", list, where)], (1, 3))
    if position is None:
        raise FacewrightError(f"{where} has no position of the form x, y, z")
    sigma = number(row, "sigma_mm", where)
    if sigma < 0.0:
        raise FacewrightError(f"{where} has a sigma_mm below 0")
    x, y, z = position[0].tolist()
    return Point(
        id=point_id,
        position=(x, y, z),
        sigma_mm=sigma,
        frames=need(row, "frames", int, where),
        rms_px=number(row, "reprojection_rms_px", where),
        region=region,
        moves=need(row, "moves", bool, where),
    )


def _scale(row: Any) -> Scale:
    if number(row, "metres_per_unit", "its scale") != 1.0:
        raise FacewrightError("its unit is no metre")
    return Scale(need(row, "source", str, "its scale"), number(row, "relative_sigma", "its scale"))


def _roughness(row: Any) -> Roughness:
    where = "its roughness"
    return Roughness(number(row, "rotation_deg", where), number(row, "translation_mm", where))


def _at_least_0(row: Any, key: str, where: str) -> float | None:
    value = number_or_none(row, key, where)
    if value is not None and value < 0.0:
        raise FacewrightError(f"{where} has a {key} below 0")
    return value


def _warnings(rows: list[Any]) -> tuple[str, ...]:
    if not all(isinstance(row, str) for row in rows):
        raise FacewrightError("its warnings are no sentences")
    return tuple(rows)
