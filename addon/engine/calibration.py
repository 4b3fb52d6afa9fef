"""A camera.json as data: what is read from it, checked, for panels and scenes."""

import json
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from facewright import FacewrightError
from numpy.typing import NDArray

# How many times worse than the median picture one must fit to be pointed out; as in the library's report picture.
BAD = 2.0

LENGTHS = ("fx", "fy", "cx", "cy")
LENS = ("k1", "k2", "k3", "p1", "p2")


@dataclass(frozen=True)
class Camera:
    """A pinhole camera with a lens: x right, y down, z forward; pixels, centres at integers."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    p1: float = 0.0
    p2: float = 0.0


@dataclass(frozen=True)
class Board:
    """A board of squares; `gap` between separate ones in parts of a square's side, None for a checkerboard."""

    columns: int
    rows: int
    square: float
    gap: float | None


@dataclass(frozen=True)
class Picture:
    """What became of a picture of the board; errors in pixels."""

    name: str
    found: bool
    used: bool
    reason: str
    board: int
    rms: float | None
    worst: float | None
    hold_out: float | None
    # (4, 4), of a picture that was used.
    cam_from_board: NDArray[np.float64] | None


@dataclass(frozen=True)
class Number:
    """A number of the camera with its standard deviation, if that is known."""

    name: str
    value: float
    deviation: float | None
    unit: str = ""

    def __str__(self) -> str:
        """Both with two digits of the deviation."""
        unit = f" {self.unit}" if self.unit else ""
        if not self.deviation:
            return f"{self.value:.6g}{unit}"
        digits = min(6, max(0, int(1 - np.floor(np.log10(self.deviation)))))
        return f"{self.value:.{digits}f} ± {self.deviation:.{digits}f}{unit}"


@dataclass(frozen=True)
class Calibration:
    """All of a camera.json; one that was only typed in has no boards and no pictures."""

    camera: Camera
    rms: float | None
    hold_out: float | None
    numbers: list[Number]
    boards: list[Board]
    pictures: list[Picture]
    warnings: list[str]

    def is_bad(self, picture: Picture) -> bool:
        """Whether a picture has no board, or fits more than twice as badly as the median one."""
        return not picture.found or bool(self.complaint(picture))

    def complaint(self, picture: Picture) -> str:
        """What a picture that was used does badly; empty if nothing."""
        limit = BAD * self.median_rms
        if picture.rms is not None and picture.rms > limit:
            return f"it fits {picture.rms / self.median_rms:.1f} times worse than the median picture"
        if picture.hold_out is not None and picture.hold_out > BAD * self.median_hold_out:
            times = picture.hold_out / self.median_hold_out
            return f"the others foretell it {times:.1f} times worse than the median picture"
        return ""

    @property
    def median_rms(self) -> float:
        return _median([p.rms for p in self.pictures])

    @property
    def median_hold_out(self) -> float:
        return _median([p.hold_out for p in self.pictures])


def _median(values: list[float | None]) -> float:
    known = [value for value in values if value is not None]
    return float(np.median(known)) if known else float("inf")


@lru_cache(maxsize=4)
def parse(text: str) -> Calibration:
    """Read a camera.json; raises FacewrightError with what is wrong. Cheap when asked again, so that panels may."""
    try:
        content = json.loads(text)
    except ValueError as error:
        raise FacewrightError(f"it is not JSON: {error}") from error
    if not isinstance(content, dict):
        raise FacewrightError("it holds no camera")
    if "cameras" in content:
        raise FacewrightError("it holds a rig of several cameras: open one of its cameras alone")
    # A report.json holds its camera inside.
    content = content["camera"] if isinstance(content.get("camera"), dict) else content
    missing = [key for key in ("width", "height", *LENGTHS) if key not in content]
    if missing:
        raise FacewrightError(f"it has no {missing[0]}")
    try:
        return _calibration(content)
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        raise FacewrightError(f"something in it is not as in a camera.json: {error}") from error


def _calibration(content: dict[str, Any]) -> Calibration:
    lens = {key: float(content.get(key, 0.0)) for key in LENS}
    lengths = {key: float(content[key]) for key in LENGTHS}
    camera = Camera(int(content["width"]), int(content["height"]), **lengths, **lens)
    impossible = [k for k in ("width", "height", "fx", "fy") if not 0.0 < getattr(camera, k) < float("inf")]
    if impossible:
        raise FacewrightError(f"its {impossible[0]} is {getattr(camera, impossible[0])}, which no camera has")
    return Calibration(
        camera=camera,
        rms=content.get("rms_px"),
        hold_out=content.get("hold_out_rms_px"),
        numbers=_numbers(camera, content.get("deviations") or {}, content.get("bend")),
        boards=[_board(board) for board in content.get("boards", [])],
        pictures=_pictures(content.get("images", [])),
        warnings=list(content.get("warnings", [])),
    )


def _numbers(camera: Camera, deviations: dict[str, float], bend: dict[str, Any] | None) -> list[Number]:
    shown = [*LENGTHS, *(key for key in LENS if key in ("k1", "k2") or getattr(camera, key) != 0.0)]
    unit = {key: "px" for key in LENGTHS}
    numbers = [Number(key, getattr(camera, key), deviations.get(key), unit.get(key, "")) for key in shown]
    if bend:
        numbers.append(Number("Board's bulge", bend["bulge_mm"], bend["deviation_mm"], "mm"))
    return numbers


def _board(board: dict[str, Any]) -> Board:
    pattern = board["pattern"]
    gap = float(pattern["squares"]["gap"]) if isinstance(pattern, dict) else None
    return Board(int(board["columns"]), int(board["rows"]), float(board["square"]), gap)


def _pictures(images: list[dict[str, Any]]) -> list[Picture]:
    """All pictures; pictures of one name, from two folders, are told apart by a number."""
    names: dict[str, int] = {}
    pictures = []
    for image in images:
        count = names[image["name"]] = names.get(image["name"], 0) + 1
        pictures.append(_picture(image, image["name"] if count == 1 else f"{image['name']} ({count})"))
    return pictures


def _picture(image: dict[str, Any], name: str) -> Picture:
    pose = image.get("cam_from_board")
    return Picture(
        name=name,
        found=image["found"],
        used=image["used"],
        reason=image.get("reason") or "",
        board=image.get("board") or 0,
        rms=image.get("rms_px"),
        worst=image.get("worst_px"),
        hold_out=image.get("hold_out_rms_px"),
        cam_from_board=np.array(pose, np.float64).reshape(4, 4) if pose is not None else None,
    )
