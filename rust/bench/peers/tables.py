"""OpenCV's side of the bench `tables`."""

from pathlib import Path
from typing import Any

import numpy as np
from common import Run
from opencv import main, read_grey
from track import forward


def measure(case: dict[str, Any], folder: Path) -> list[Run]:
    """Every window."""
    pictures = [read_grey(folder / name) for name in case["pictures"]]
    return [matches(case, pictures, window) for window in case["windows"]]


def matches(case: dict[str, Any], pictures: list[np.ndarray], window: int) -> Run:
    """Every pair, as our tracker of the same window has them before the correction."""

    def of_pair(pair: dict[str, Any]) -> list[list[float] | None]:
        points = np.float32(pair["points"]).reshape(-1, 1, 2)
        found, kept = forward(pictures[pair["a"]], pictures[pair["b"]], points, window)
        return [at if ok else None for at, ok in zip(found.reshape(-1, 2).tolist(), kept)]

    answer = {"matches": [of_pair(pair) for pair in case["pairs"]]}
    return Run(case["name"], f"window {window}", "calcOpticalFlowPyrLK", {}, answer)


if __name__ == "__main__":
    main(measure)
