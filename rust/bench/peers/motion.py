"""OpenCV's side of the bench `motion`."""

from pathlib import Path
from typing import Any

import cv2
import numpy as np
from common import Run, timed
from opencv import main

METHODS = {"USAC_ACCURATE": cv2.USAC_ACCURATE, "USAC_MAGSAC": cv2.USAC_MAGSAC, "RANSAC": cv2.RANSAC}
CONFIDENCE = 0.999


def measure(case: dict[str, Any], _folder: Path) -> list[Run]:
    """Every robust method."""
    lens = case["camera"]
    camera = np.array([[lens["fx"], 0, lens["cx"]], [0, lens["fy"], lens["cy"]], [0, 0, 1]])
    pairs = [(np.array(trial["a"]), np.array(trial["b"])) for trial in case["trials"]]

    def run(setting: str, method: int) -> Run:
        def solve_all() -> list[list[list[float]] | None]:
            return [solve(a, b, camera, method, case["threshold_px"]) for a, b in pairs]

        all_ms, answer = timed(solve_all)
        times = {"solve": all_ms / len(pairs)}
        return Run(case["name"], "robust motion", setting, times, answer)

    return [run(setting, method) for setting, method in METHODS.items()]


def solve(
    a: np.ndarray, b: np.ndarray, camera: np.ndarray, method: int, threshold_px: float
) -> list[list[float]] | None:
    """The motion as the four rows of a matrix; none where no essential matrix was found."""
    essential, kept = cv2.findEssentialMat(a, b, camera, method=method, prob=CONFIDENCE, threshold=threshold_px)
    if essential is None or len(essential) < 3:
        return None
    # Several solutions come one below the other: the first is as good as any.
    _, rotation, translation, _ = cv2.recoverPose(essential[:3], a, b, camera, mask=kept)
    return [*np.hstack([rotation, translation]).tolist(), [0.0, 0.0, 0.0, 1.0]]


if __name__ == "__main__":
    main(measure)
