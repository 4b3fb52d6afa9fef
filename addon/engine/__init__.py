"""The only importer of the native library: numpy in, numpy out, no bpy."""

import os
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from facewright import (
    Assets,
    CalibrateOptions,
    Camera,
    Cancelled,
    Command,
    FacewrightError,
    Job,
    Motion,
    MotionOptions,
    Reconstruction,
    ReconstructOptions,
    Report,
    Rig,
    Survey,
    SurveyedFrame,
    TrackOptions,
    Tracks,
    UsageError,
)
from facewright import calibrate as _calibrate
from facewright import calibrate_rig as _calibrate_rig
from facewright import check_face as _check_face
from facewright import check_folder as check_folder
from facewright import generic_head as _generic_head
from facewright import motion as _motion
from facewright import parse_command as parse_command
from facewright import pictures_in as pictures_in
from facewright import reconstruct as _reconstruct
from facewright import run as _run
from facewright import save_board as save_board
from facewright import save_calibration_picture as save_calibration_picture
from facewright import survey as _survey
from facewright import track as _track
from facewright import video_size as video_size
from numpy.typing import NDArray

__all__ = [
    "CalibrateOptions",
    "Camera",
    "Cancelled",
    "Command",
    "FacewrightError",
    "Job",
    "Motion",
    "MotionOptions",
    "Progress",
    "ReconstructOptions",
    "Reconstruction",
    "Report",
    "Rig",
    "Survey",
    "SurveyedFrame",
    "TrackOptions",
    "Tracks",
    "UsageError",
    "assets_folder",
    "calibrate",
    "calibrate_rig",
    "check_face",
    "check_folder",
    "generic_head",
    "parse_command",
    "pictures_in",
    "reconstruct",
    "run_command",
    "save_board",
    "save_calibration_picture",
    "solve_motion",
    "survey",
    "track",
    "use_assets",
    "video_size",
]

Method = Literal["default", "paper"]
Page = Literal["A4", "A3", "Letter"]
Bend = Literal["never", "judged", "always"]


class Progress(NamedTuple):
    """How far some work is, and (n, 3) vertices of what it has made so far, where they have changed."""

    stage: str
    # Of the whole work, 0 to 1.
    fraction: float
    # Seconds left, where that is known.
    remaining_s: float | None = None
    # The present step, counted from 1, and the last.
    step: tuple[int, int] | None = None
    sketch: NDArray[np.float32] | None = None


# The folder of assets that the user prefers; empty: the extension's own.
_preferred = ""


def use_assets(folder: str) -> None:
    """Take the generic head and the landmark nets from a folder; empty: from the extension's own."""
    global _preferred
    _preferred = folder


def assets_folder() -> str:
    """Folder of the generic head and the nets: what FACEWRIGHT_ASSETS names, the preferred, or the extension's own."""
    return os.environ.get("FACEWRIGHT_ASSETS") or _preferred or str(Path(__file__).parent.parent / "assets")


@lru_cache(maxsize=1)
def _assets(folder: str) -> Assets:
    """One handle for all jobs: the head and the nets are read once."""
    return Assets(folder)


def reconstruct(
    frames: Sequence[str],
    *,
    numbers: Sequence[int] | None = None,
    camera: str | None = None,
    faces: str | None = None,
    tracks: Tracks | str | None = None,
    motion: str | None = None,
    options: ReconstructOptions | None = None,
) -> Job[Reconstruction]:
    """Start to reconstruct the head in image files or folders, or in the frames of a video that have these numbers.

    `camera`, `faces`, `tracks` and `motion` are what other commands found, or the texts of their files: what is given
    is not found anew.
    """
    given = {"camera": camera, "faces": faces, "tracks": tracks, "motion": motion}
    return _reconstruct(list(frames), numbers=numbers, assets=_assets(assets_folder()), **given, options=options)


def survey(frames: Sequence[str], *, numbers: Sequence[int] | None = None, camera: str | None = None) -> Job[Survey]:
    """Start to look at some of a clip's image files, or of the frames of a video that have these numbers.

    `camera` is the text of a camera.json.
    """
    return _survey(list(frames), numbers=numbers, assets=_assets(assets_folder()), camera=camera)


def check_face(pictures: Sequence[str], frames: int) -> Job[None]:
    """Start to look for a face in some pictures of a clip of so many frames; the job refuses those without one."""
    return _check_face(list(pictures), assets=_assets(assets_folder()), frames=frames)


def track(
    frames: Sequence[str],
    *,
    numbers: Sequence[int] | None = None,
    camera: str | None,
    faces: str | None = None,
    options: TrackOptions | None = None,
) -> Job[Tracks]:
    """Start to track a face in image files, or in the frames of a video that have these numbers.

    `camera` and `faces` are the texts of a camera.json and a faces.json.
    """
    given = {"camera": camera, "faces": faces}
    return _track(list(frames), numbers=numbers, assets=_assets(assets_folder()), **given, options=options)


def solve_motion(tracks: Tracks | str, *, camera: str | None, **options: Any) -> Job[Motion]:
    """Start to find the motion of a head from its tracks.

    `camera` is the text of a camera.json, further keywords those of `MotionOptions`.
    """
    return _motion(tracks, camera=camera, **options)


def calibrate(
    pictures: Sequence[str],
    *,
    numbers: Sequence[int] | None = None,
    options: CalibrateOptions | None = None,
    picture: str | None = None,
) -> Job[Camera]:
    """Start to calibrate a camera from board pictures, or from the frames of a video that have these numbers.

    The result is also drawn into `picture`.
    """
    return _calibrate(list(pictures), numbers=numbers, options=options, picture=picture)


def calibrate_rig(cameras: Sequence[tuple[str, Sequence[str]]], *, options: CalibrateOptions | None = None) -> Job[Rig]:
    """Start to calibrate cameras, each with its name and board pictures, and where they stand."""
    return _calibrate_rig([(name, list(pictures)) for name, pictures in cameras], options=options)


def generic_head() -> Reconstruction:
    """The generic head with its own keys."""
    return _generic_head(_assets(assets_folder()))


def run_command(arguments: Sequence[str], program: str) -> int:
    """Do what a command line of the `facewright` program asks for; the exit code."""
    given = any(argument.split("=")[0] == "--assets" for argument in arguments)
    return _run([*arguments, *([] if given else ["--assets", assets_folder()])], program=program)
