"""OpenCV's side of the bench `track`."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from common import Run, median_ms
from opencv import main, read_grey

CORNER_WINDOW = 5
LEVELS = 4
STEPS = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 30, 0.01)
# A point that comes back further than this from where it began is given up, pixels.
BACK_PX = 0.5

Points = np.ndarray


def forward(a: np.ndarray, b: np.ndarray, points: Points, window: int) -> tuple[Points, np.ndarray]:
    """Where the points are in `b`, and which of them were found."""
    found, status, _ = cv2.calcOpticalFlowPyrLK(
        a, b, points, None, winSize=(window, window), maxLevel=LEVELS - 1, criteria=STEPS
    )
    return found, status.ravel() > 0


def checked(a: np.ndarray, b: np.ndarray, points: Points, window: int) -> tuple[Points, np.ndarray]:
    """The same, tracked back."""
    found, kept = forward(a, b, points, window)
    back, returned = forward(b, a, found, window)
    return found, kept & returned & (np.linalg.norm(back - points, axis=-1).ravel() < BACK_PX)


TRACKERS: dict[str, tuple[Callable[..., tuple[Points, np.ndarray]], int]] = {
    "window 7": (forward, 7),
    "window 15": (forward, 15),
    "window 21": (forward, 21),
    "window 11, checked": (checked, 11),
}


def measure(case: dict[str, Any], folder: Path) -> list[Run]:
    """Pyramids, corners and all trackers."""
    pictures = [read_grey(folder / name) for name in case["pictures"]]
    masks = [read_grey(folder / name) for name in case["masks"]]
    return [pyramids(case, pictures), corners(case, pictures, masks)] + [tracks(case, pictures, t) for t in TRACKERS]


def pyramids(case: dict[str, Any], pictures: list[np.ndarray]) -> Run:
    """Both pyramids of every pair, with derivatives, as the tracker of the smallest window needs them."""
    window = min(window for _, window in TRACKERS.values())

    def build_all() -> None:
        for pair in case["pairs"]:
            for picture in (pictures[pair["a"]], pictures[pair["b"]]):
                cv2.buildOpticalFlowPyramid(picture, (window, window), LEVELS - 1)

    times = {"build": median_ms(build_all) / len(case["pairs"])}
    return Run(case["name"], "pyramids", "buildOpticalFlowPyramid", times, {})


def corners(case: dict[str, Any], pictures: list[np.ndarray], masks: list[np.ndarray]) -> Run:
    """Corners of every picture."""

    def find(picture: np.ndarray, mask: np.ndarray) -> Points:
        count, quality, distance = case["corners"], case["quality"], case["min_distance"]
        return cv2.goodFeaturesToTrack(picture, count, quality, distance, mask=mask, blockSize=CORNER_WINDOW)

    def find_all() -> list[Points]:
        return [find(picture, mask) for picture, mask in zip(pictures, masks)]

    found = [points.reshape(-1, 2).tolist() for points in find_all()]
    times = {"find": median_ms(find_all) / len(pictures)}
    return Run(case["name"], "corners", "goodFeaturesToTrack", times, {"corners": found})


def tracks(case: dict[str, Any], pictures: list[np.ndarray], task: str) -> Run:
    """Every pair by one tracker."""
    tracker, window = TRACKERS[task]
    pairs = [
        (pictures[pair["a"]], pictures[pair["b"]], np.float32(pair["points"]).reshape(-1, 1, 2))
        for pair in case["pairs"]
    ]

    def calls(count: int | None) -> list[tuple[Points, np.ndarray]]:
        return [tracker(a, b, points[:count], window) for a, b, points in pairs]

    times = {
        "call": median_ms(lambda: calls(None)) / len(pairs),
        "call_with_one_point": median_ms(lambda: calls(1)) / len(pairs),
    }
    found = [
        [at if ok else None for at, ok in zip(points.reshape(-1, 2).tolist(), kept)] for points, kept in calls(None)
    ]
    return Run(case["name"], task, "calcOpticalFlowPyrLK", times, {"tracks": found})


if __name__ == "__main__":
    main(measure)
