"""What the camera's buttons do."""

import json
from pathlib import Path

from ..engine import FacewrightError, Page, calibrate
from ..engine import save_board as _save_board
from ..jobs import Work, watch


def calibrated(pictures: list[str], columns: int, rows: int, square_mm: float) -> Work[str]:
    """Calibrate; the result is the text of a camera.json."""
    return watch(calibrate(pictures, inner=(columns, rows), square_mm=square_mm))


def read_camera(path: str) -> str:
    """The text of a camera file, checked."""
    try:
        text = Path(path).read_text(encoding="utf-8")
        camera = json.loads(text)
    except (OSError, ValueError) as error:
        raise FacewrightError(f"{path} is no camera file: {error}") from error
    missing = [key for key in ("width", "height", "fx", "fy", "cx", "cy") if key not in camera]
    if missing:
        raise FacewrightError(f"{path} is no camera file: it has no {missing[0]}")
    return text


def save_board(path: str, columns: int, rows: int, square_mm: float, page: Page) -> None:
    """Write a board to print, as the SVG, PDF or PNG that the path's extension says."""
    _save_board(path, inner=(columns, rows), square_mm=square_mm, page=page)


def summary(text: str) -> list[str]:
    """A camera in a few lines; empty without one."""
    if not text:
        return []
    camera = json.loads(text)
    lines = [f"{camera['width']} × {camera['height']}, focal {camera['fx']:.1f} px"]
    if "rms_px" in camera:
        found = sum(image["found"] for image in camera["images"])
        lines.append(f"{found} of {len(camera['images'])} boards, error {camera['rms_px']:.3f} px")
    lines += [f"{image['name']}: {image['reason']}" for image in camera.get("images", []) if not image["found"]]
    return lines + camera.get("warnings", [])
