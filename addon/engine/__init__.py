"""The only importer of the native library: numpy in, numpy out, no bpy."""

import os
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

from facewright import (
    Assets,
    CalibrateOptions,
    Cancelled,
    Command,
    FacewrightError,
    Job,
    MotionOptions,
    Reconstruction,
    ReconstructOptions,
    TrackOptions,
    UsageError,
)
from facewright import calibrate as calibrate
from facewright import check_folder as check_folder
from facewright import generic_head as _generic_head
from facewright import motion as _motion
from facewright import parse_command as parse_command
from facewright import reconstruct as _reconstruct
from facewright import run as _run
from facewright import save_board as save_board
from facewright import save_calibration_picture as save_calibration_picture
from facewright import track as _track

__all__ = [
    "CalibrateOptions",
    "Cancelled",
    "Command",
    "FacewrightError",
    "Job",
    "MotionOptions",
    "ReconstructOptions",
    "Reconstruction",
    "TrackOptions",
    "UsageError",
    "assets_folder",
    "calibrate",
    "check_folder",
    "generic_head",
    "parse_command",
    "reconstruct",
    "run_command",
    "save_board",
    "save_calibration_picture",
    "solve_motion",
    "track",
]

Method = Literal["default", "paper"]
Page = Literal["A4", "A3", "Letter"]


def assets_folder() -> str:
    """Folder of the generic head and the landmark nets: the extension's own, or the one FACEWRIGHT_ASSETS names."""
    return os.environ.get("FACEWRIGHT_ASSETS") or str(Path(__file__).parent.parent / "assets")


@lru_cache(maxsize=1)
def _assets(folder: str) -> Assets:
    """One handle for all jobs: the head and the nets are read once."""
    return Assets(folder)


def reconstruct(
    frames: Sequence[str],
    *,
    camera: str | None = None,
    tracks: str | None = None,
    motion: str | None = None,
    options: ReconstructOptions | None = None,
) -> Job[Reconstruction]:
    """Start to reconstruct the head in image files or folders.

    `camera`, `tracks` and `motion` are the texts of a camera.json, a tracks.json and a motion.json: what is given is
    not found anew.
    """
    assets = _assets(assets_folder())
    return _reconstruct(list(frames), assets=assets, camera=camera, tracks=tracks, motion=motion, options=options)


def track(frames: Sequence[str], *, camera: str | None, options: TrackOptions | None = None) -> Job[str]:
    """Start to track a face in image files; `camera` is the text of a camera.json, the result that of a tracks.json."""
    return _track(list(frames), assets=_assets(assets_folder()), camera=camera, options=options)


def solve_motion(tracks: str, *, camera: str | None, **options: Any) -> Job[str]:
    """Start to find the motion of a head from the text of a tracks.json; the result is the text of a motion.json.

    `camera` is the text of a camera.json, further keywords those of `MotionOptions`.
    """
    return _motion(tracks, camera=camera, **options)


def generic_head() -> Reconstruction:
    """The generic head with its own keys."""
    return _generic_head(_assets(assets_folder()))


def run_command(arguments: Sequence[str], program: str) -> int:
    """Do what a command line of the `facewright` program asks for; the exit code."""
    given = any(argument.split("=")[0] == "--assets" for argument in arguments)
    return _run([*arguments, *([] if given else ["--assets", assets_folder()])], program=program)
