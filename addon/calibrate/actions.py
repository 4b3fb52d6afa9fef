"""What the camera's buttons do."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..engine import CalibrateOptions, FacewrightError, Page, calibrate, save_calibration_picture
from ..engine import save_board as _save_board
from ..engine.calibration import Calibration, parse
from ..engine.files import write_text
from ..jobs import Work, watch
from ..scene import boards as scene_boards
from ..scene import video

# Of a film, this many frames are looked at; the library takes those that differ.
MAX_FRAMES = 120


@dataclass(frozen=True)
class BoardSettings:
    """A board of `columns × rows` inner corners, or of separate squares `gap_mm` apart."""

    columns: int
    rows: int
    square_mm: float
    gap_mm: float | None = None

    @classmethod
    def of(cls, settings: Any) -> "BoardSettings":
        """What the panel says."""
        gap = settings.gap_mm if settings.pattern == "SQUARES" else None
        return cls(settings.columns, settings.rows, settings.square_mm, gap)

    @property
    def arguments(self) -> dict[str, Any]:
        """As the library's keywords."""
        size = (self.columns, self.rows)
        if self.gap_mm is None:
            return {"inner": size, "square_mm": self.square_mm}
        return {"squares": size, "gap_mm": self.gap_mm, "square_mm": self.square_mm}


def calibrated(pictures: list[str], board: BoardSettings | CalibrateOptions, picture: str | None = None) -> Work[str]:
    """Calibrate from image files, a folder of them or one video; the result is the text of a camera.json.

    It is also drawn into `picture`.
    """
    if not pictures:
        raise FacewrightError("choose pictures of the board, a folder of them, or a video")
    missing = [path for path in pictures if not Path(path).exists()]
    if missing:
        raise FacewrightError(f"{missing[0]} does not exist: choose the pictures again")
    if len(pictures) > 1 and any(video.is_video(path) for path in pictures):
        raise FacewrightError("choose one video alone, or pictures without videos")
    options = board if isinstance(board, CalibrateOptions) else CalibrateOptions(**board.arguments)
    return _calibrated(pictures, options, picture)


def _calibrated(pictures: list[str], options: CalibrateOptions, picture: str | None) -> Work[str]:
    folder = None
    try:
        if video.is_video(pictures[0]):
            folder = yield from video.decode(pictures[0], spread(pictures[0]))
            pictures = [folder.name]
        return (yield from watch(calibrate(pictures, options=options, picture=picture)))
    finally:
        if folder is not None:
            folder.cleanup()


def spread(path: str) -> list[int]:
    """Frames of a video to look at: all of a short one, else evenly many."""
    count = video.frame_count(path)
    if count == 0:
        raise FacewrightError(f"{path} cannot be read as a video")
    return np.unique(np.linspace(0, count - 1, min(count, MAX_FRAMES)).round().astype(int)).tolist()


def read_camera(path: str) -> str:
    """The text of a camera file, checked."""
    try:
        text = Path(path).read_text(encoding="utf-8")
        parse(text)
    except (OSError, ValueError, FacewrightError) as error:
        raise FacewrightError(f"{path} is no camera file: {error}") from error
    return text


def save_camera(path: str, text: str) -> None:
    """Write a camera.json, whole or not at all."""
    write_text(path, json.dumps(json.loads(text), indent=2, ensure_ascii=False) + "\n")


def save_picture(path: str, text: str) -> None:
    """Draw boards, corners, errors and numbers, as the SVG, PDF or PNG that the path's extension says."""
    save_calibration_picture(text, path)


def save_board(path: str, board: BoardSettings, page: Page) -> None:
    """Write a board to print, as the SVG, PDF or PNG that the path's extension says."""
    _save_board(path, page=page, **board.arguments)


def known(text: str) -> Calibration | None:
    """The calibration that a scene holds; None without one, or with text that is none."""
    try:
        return parse(text) if text else None
    except FacewrightError:
        return None


def summary(text: str) -> list[str]:
    """A camera in two lines; empty without one."""
    calibration = known(text)
    if calibration is None:
        return []
    camera = calibration.camera
    lines = [f"{camera.width} × {camera.height}, focal {camera.fx:.1f} px"]
    if calibration.rms is not None:
        pictures = calibration.pictures
        found, used = sum(p.found for p in pictures), sum(p.used for p in pictures)
        some = f", {used} used" if used < found else ""
        lines.append(f"{found} of {len(pictures)} boards{some}, error {calibration.rms:.3f} px")
    return lines


def warnings(text: str) -> list[str]:
    """What to photograph next, and what to distrust."""
    calibration = known(text)
    return calibration.warnings if calibration else []


def fill_table(settings: Any) -> None:
    """Make the table of pictures anew from the camera's text."""
    settings.pictures.clear()
    calibration = known(settings.text)
    if calibration is None:
        return
    for picture in calibration.pictures:
        row = settings.pictures.add()
        row.name, row.found, row.used = picture.name, picture.found, picture.used
        row.rms, row.worst, row.hold_out = picture.rms or 0.0, picture.worst or 0.0, picture.hold_out or 0.0
        row.bad = calibration.is_bad(picture)
        row.reason = picture.reason or calibration.complaint(picture)
    if settings.active >= len(settings.pictures):
        settings.active = 0


def set_camera(scene: Any, text: str) -> None:
    """Let a scene have this camera; boards that are shown follow."""
    scene.facewright_camera.text = text
    if scene_boards.collection(scene) is not None:
        show_boards(scene)


def show_boards(scene: Any) -> None:
    """Put the scene's camera and its boards into it, or bring them up to date."""
    calibration = known(scene.facewright_camera.text)
    if calibration is not None:
        scene_boards.place(scene, calibration, scene.facewright_camera.wire)


def select_board(settings: Any, context: Any) -> None:
    """Select the board of the table's row in the scene."""
    if context.view_layer is not None and settings.active < len(settings.pictures):
        scene_boards.select(settings.id_data, context.view_layer, settings.pictures[settings.active].name)


def follow_board(scene: Any, obj: Any) -> None:
    """Make the row of a board object the active one; other objects change nothing."""
    settings = scene.facewright_camera
    row = settings.pictures.find(scene_boards.picture_of(obj)) if obj is not None else -1
    if row not in (-1, settings.active):
        settings.active = row


def set_wire(settings: Any) -> None:
    """Show the boards in the scene as wires, or solid."""
    scene_boards.set_wire(settings.id_data, settings.wire)
