"""Facewright's library: from a filmed head to an animatable head.

Long work runs in a :class:`Job` on a thread of its own, which never touches Python; poll it, cancel it, take its
result.
"""

from facewright._native import (
    Cancelled,
    FacewrightError,
    Job,
    Reconstruction,
    calibrate,
    calibrate_rig,
    check_folder,
    generic_head,
    motion,
    motion_on_rig,
    reconstruct,
    save_board,
    save_calibration_picture,
    track,
    version,
)

__all__ = [
    "Cancelled",
    "FacewrightError",
    "Job",
    "Reconstruction",
    "calibrate",
    "calibrate_rig",
    "check_folder",
    "generic_head",
    "motion",
    "motion_on_rig",
    "reconstruct",
    "save_board",
    "save_calibration_picture",
    "track",
    "version",
]
