"""What all of OpenCV's sides share."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from common import Run, write_runs


def read_grey(path: Path) -> np.ndarray:
    """A picture as grey levels."""
    picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if picture is None:
        raise SystemExit(f"cannot read {path}")
    return picture


def main(measure: Callable[[dict[str, Any], Path], list[Run]]) -> None:
    """`WORD.py FOLDER RESULT`: measures every case of `inputs.json`, on one thread."""
    cv2.setNumThreads(1)
    write_runs(f"OpenCV {cv2.__version__}", measure)
