"""The only importer of the native library: numpy in, numpy out, no bpy."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from facewright import Camera, Cancelled, FacewrightError, Job, Motion, Reconstruction, Report, Rig, Tracks
from facewright import calibrate as _calibrate
from facewright import calibrate_rig as _calibrate_rig
from facewright import check_folder as check_folder
from facewright import generic_head as _generic_head
from facewright import motion as _motion
from facewright import reconstruct as _reconstruct
from facewright import save_board as _save_board
from facewright import save_calibration_picture as save_calibration_picture
from facewright import track as _track

__all__ = [
    "Camera",
    "Cancelled",
    "FacewrightError",
    "Job",
    "Motion",
    "Reconstruction",
    "Report",
    "Rig",
    "Tracks",
    "assets_folder",
    "calibrate",
    "calibrate_rig",
    "check_folder",
    "generic_head",
    "reconstruct",
    "save_board",
    "save_calibration_picture",
    "solve_motion",
    "track",
]

Method = Literal["default", "paper"]
Page = Literal["A4", "A3", "Letter"]
Bend = Literal["never", "judged", "always"]


def assets_folder() -> str:
    """Folder of the generic head and the landmark nets: the extension's own, or the one FACEWRIGHT_ASSETS names."""
    return os.environ.get("FACEWRIGHT_ASSETS") or str(Path(__file__).parent.parent / "assets")


def reconstruct(
    frames: Sequence[str],
    *,
    camera: str | None,
    method: Method,
    texture_size: int,
    interocular_mm: float | None,
    tracks: str | None = None,
) -> Job[Reconstruction]:
    """Start to reconstruct the head in image files or folders; `camera` is the text of a camera.json.

    `tracks` is the text of a tracks.json that is used instead of tracking anew.
    """
    return _reconstruct(
        list(frames),
        assets=assets_folder(),
        camera=camera,
        method=method,
        texture_size=texture_size,
        interocular_mm=interocular_mm,
        tracks=tracks,
    )


def track(
    frames: Sequence[str],
    *,
    camera: str | None,
    method: Method,
    points: int,
    window: int | None,
) -> Job[Tracks]:
    """Start to track a face in image files; `camera` is the text of a camera.json."""
    return _track(list(frames), assets=assets_folder(), camera=camera, method=method, points=points, window=window)


def solve_motion(
    tracks: Tracks | str,
    *,
    camera: str | None,
    interocular_mm: float | None,
    lengths: Sequence[tuple[int, int, float]] = (),
) -> Job[Motion]:
    """Start to find the motion of a head from its tracks.

    `camera` is the text of a camera.json, `lengths` are distances that were measured: two tracks and millimetres.
    """
    return _motion(tracks, camera=camera, interocular_mm=interocular_mm, lengths=list(lengths))


def calibrate(pictures: Sequence[str], *, picture: str | None = None, **options: Any) -> Job[Camera]:
    """Start to calibrate a camera from board pictures; the result is also drawn into `picture`.

    The board has `inner` corners or separate `squares`, and `square_mm`; further options are those of the lens.
    """
    return _calibrate(list(pictures), picture=picture, **options)


def calibrate_rig(cameras: Sequence[tuple[str, Sequence[str]]], **options: Any) -> Job[Rig]:
    """Start to calibrate cameras, each with its name and board pictures, and where they stand; options as above."""
    return _calibrate_rig([(name, list(pictures)) for name, pictures in cameras], **options)


def generic_head() -> Reconstruction:
    """The generic head with its own keys."""
    return _generic_head(assets_folder())


def save_board(
    path: str,
    *,
    inner: tuple[int, int] = (9, 6),
    squares: tuple[int, int] | None = None,
    gap_mm: float | None = None,
    square_mm: float,
    page: Page,
) -> None:
    """Write a board to print, as the SVG, PDF or PNG that the path's extension says."""
    _save_board(path, inner=inner, squares=squares, gap_mm=gap_mm, square_mm=square_mm, page=page)
