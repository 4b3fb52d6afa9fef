"""A camera.json for panels: its numbers as they are shown, and the pictures that fit badly."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from facewright import Board as Board
from facewright import BoardImage as BoardImage
from facewright import Camera

# How many times worse than the median picture one must fit to be pointed out; as in the library's report picture.
BAD = 2.0

LENGTHS = ("fx", "fy", "cx", "cy")
LENS = ("k1", "k2", "k3", "p1", "p2")


@lru_cache(maxsize=4)
def parse(text: str) -> Camera:
    """Read a camera.json; raises FacewrightError with what is wrong. Cheap when asked again, so that panels may."""
    return Camera.parse(text)


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


def numbers(camera: Camera) -> list[Number]:
    """The numbers that tell something, and the board's bend."""
    shown = [*LENGTHS, *(key for key in LENS if key in ("k1", "k2") or getattr(camera, key) != 0.0)]
    unit, deviations = {key: "px" for key in LENGTHS}, camera.deviations
    found = [Number(key, getattr(camera, key), deviations.get(key), unit.get(key, "")) for key in shown]
    if camera.bend is not None:
        found.append(Number("Board's bulge", camera.bend.bulge_mm, camera.bend.deviation_mm, "mm"))
    return found


@dataclass(frozen=True)
class Picture:
    """A picture of the board by a name that no other has, and what it does badly; empty if nothing."""

    name: str
    image: BoardImage
    complaint: str

    @property
    def is_bad(self) -> bool:
        """Whether it shows no board, or fits more than twice as badly as the median one."""
        return not self.image.found or bool(self.complaint)


def pictures(camera: Camera) -> list[Picture]:
    """All pictures; those of one name, from two folders, are told apart by a number."""
    images = camera.images
    rms, hold_out = _median([i.rms_px for i in images]), _median([i.hold_out_rms_px for i in images])
    names: dict[str, int] = {}
    found = []
    for image in images:
        count = names[image.name] = names.get(image.name, 0) + 1
        name = image.name if count == 1 else f"{image.name} ({count})"
        found.append(Picture(name, image, _complaint(image, rms, hold_out)))
    return found


def _complaint(image: BoardImage, rms: float, hold_out: float) -> str:
    if image.rms_px is not None and image.rms_px > BAD * rms:
        return f"its error is {image.rms_px / rms:.1f} times the median picture's"
    if image.hold_out_rms_px is not None and image.hold_out_rms_px > BAD * hold_out:
        return f"its hold-out error is {image.hold_out_rms_px / hold_out:.1f} times the median picture's"
    return ""


def _median(values: list[float | None]) -> float:
    known = [value for value in values if value is not None]
    return float(np.median(known)) if known else float("inf")
