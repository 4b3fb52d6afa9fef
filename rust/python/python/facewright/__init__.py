"""Facewright's library: from a filmed head to an animatable head.

Long work runs in a :class:`Job` on a thread of its own, which never touches Python; poll it, cancel it, take its result.
"""

from facewright._native import (
    Cancelled,
    FacewrightError,
    Job,
    Reconstruction,
    board_svg,
    calibrate,
    check_folder,
    generic_head,
    reconstruct,
    version,
)

__all__ = [
    "Cancelled",
    "FacewrightError",
    "Job",
    "Reconstruction",
    "board_svg",
    "calibrate",
    "check_folder",
    "generic_head",
    "reconstruct",
    "version",
]
