"""OpenCV's side of the bench `calibrate`."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from common import Run, median_ms
from opencv import main, read_grey

# The camera that both sides solve for: focal lengths, principal point, two radial terms.
LENS = cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K3
SUBPIXEL_STEPS = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 0.001)

Board = np.ndarray | None


def find_and_refine(picture: np.ndarray, inner: tuple[int, int]) -> Board:
    """The classic way: the fastest one."""
    found, corners = cv2.findChessboardCorners(picture, inner)
    return cv2.cornerSubPix(picture, corners, (5, 5), (-1, -1), SUBPIXEL_STEPS) if found else None


def find_by_sectors(picture: np.ndarray, inner: tuple[int, int]) -> Board:
    """The most exact way."""
    found, corners = cv2.findChessboardCornersSB(picture, inner, flags=cv2.CALIB_CB_ACCURACY)
    return corners if found else None


FINDERS: dict[str, Callable[[np.ndarray, tuple[int, int]], Board]] = {
    "findChessboardCorners + cornerSubPix": find_and_refine,
    "findChessboardCornersSB accurate": find_by_sectors,
}


def measure(case: dict[str, Any], folder: Path) -> list[Run]:
    """Each way to find the board, and the camera it leads to."""
    pictures = [read_grey(folder / name) for name in case["pictures"]]
    return [run(case, setting, finder, pictures) for setting, finder in FINDERS.items()] + [solve_corners(case)]


def solve_corners(case: dict[str, Any]) -> Run:
    """The camera from corners that are given."""
    views = [np.array(corners, np.float32).reshape(-1, 1, 2) for corners in case["corners"]]
    camera, rms = solve(case, views)
    times = {"solve": median_ms(lambda: solve(case, views))}
    return Run(case["name"], "corners", "calibrateCamera", times, {"boards": [], "camera": camera, "rms_px": rms})


def run(case: dict[str, Any], setting: str, finder: Callable[..., Board], pictures: list[np.ndarray]) -> Run:
    """One way."""
    inner = tuple(case["inner"])
    boards = [finder(picture, inner) for picture in pictures]
    views = [board for board in boards if board is not None]
    times = {"find": median_ms(lambda: [finder(picture, inner) for picture in pictures]) / len(pictures)}
    camera, rms = None, None
    if len(views) >= 3:
        camera, rms = solve(case, views)
        times["solve"] = median_ms(lambda: solve(case, views))
    found = [None if board is None else board.reshape(-1, 2).tolist() for board in boards]
    return Run(case["name"], "board", setting, times, {"boards": found, "camera": camera, "rms_px": rms})


def solve(case: dict[str, Any], views: list[np.ndarray]) -> tuple[dict[str, float], float]:
    """The camera from all boards, and the root mean square error."""
    columns, rows = case["inner"]
    plane = np.zeros((columns * rows, 3), np.float32)
    plane[:, :2] = np.mgrid[0:columns, 0:rows].T.reshape(-1, 2) * case["square"]
    size = (case["width"], case["height"])
    rms, k, distortion, *_ = cv2.calibrateCamera([plane] * len(views), views, size, None, None, flags=LENS)
    numbers = {"fx": k[0, 0], "fy": k[1, 1], "cx": k[0, 2], "cy": k[1, 2]}
    numbers |= {"k1": distortion.ravel()[0], "k2": distortion.ravel()[1]}
    camera = {"width": size[0], "height": size[1]} | {name: float(value) for name, value in numbers.items()}
    return camera, rms


if __name__ == "__main__":
    main(measure)
