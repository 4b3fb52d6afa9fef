"""PoseLib's side of the bench `motion`."""

from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import poselib
from common import Run, timed, write_runs


def measure(case: dict[str, Any], _folder: Path) -> list[Run]:
    """Locally optimised consensus and refinement, as set by default."""
    lens = case["camera"]
    numbers = [lens[name] for name in ("fx", "fy", "cx", "cy")]
    camera = {"model": "PINHOLE", "width": lens["width"], "height": lens["height"], "params": numbers}
    pairs = [(np.array(trial["a"]), np.array(trial["b"])) for trial in case["trials"]]

    def solve_all() -> list[list[list[float]]]:
        return [solve(a, b, camera, case["threshold_px"]) for a, b in pairs]

    all_ms, answer = timed(solve_all)
    times = {"solve": all_ms / len(pairs)}
    return [Run(case["name"], "robust motion", "estimate_relative_pose", times, answer)]


def solve(a: np.ndarray, b: np.ndarray, camera: dict[str, Any], threshold_px: float) -> list[list[float]]:
    """The motion as the four rows of a matrix."""
    pose, _ = poselib.estimate_relative_pose(a, b, camera, camera, {"max_epipolar_error": threshold_px}, {})
    return [*np.hstack([pose.R, np.reshape(pose.t, (3, 1))]).tolist(), [0.0, 0.0, 0.0, 1.0]]


if __name__ == "__main__":
    write_runs(f"PoseLib {version('poselib')}", measure)
