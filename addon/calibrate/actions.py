"""What the camera's buttons do."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..engine import Bend, CalibrateOptions, Camera, FacewrightError, Page, calibrate, save_calibration_picture
from ..engine import save_board as _save_board
from ..engine.calibration import Number, parse, pictures
from ..engine.calibration import numbers as shown_numbers
from ..jobs import Work, watch
from ..scene import boards as scene_boards
from ..scene import video

# Of a clip, at most this many frames are searched for the board; the library uses those that differ.
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


@dataclass(frozen=True)
class LensSettings:
    """What to solve for: radial terms, the tangential ones, one focal length for both directions, a bent board."""

    distortion_terms: int = 2
    tangential: bool = False
    square_pixels: bool = False
    bend: Bend = "judged"

    @classmethod
    def of(cls, settings: Any) -> "LensSettings":
        """What the panel says."""
        return cls(settings.distortion_terms, settings.tangential, settings.square_pixels, settings.bend)

    @property
    def arguments(self) -> dict[str, Any]:
        """As the library's keywords."""
        return asdict(self)


def calibrated(
    pictures: list[str],
    board: BoardSettings | CalibrateOptions,
    picture: str | None = None,
    lens: LensSettings | None = None,
) -> Work[str]:
    """Calibrate from image files, a folder of them or one video; the result is the text of a camera.json.

    It is also drawn into `picture`.
    """
    if not pictures:
        raise FacewrightError("choose pictures of the board, a folder of them, or a video")
    missing = [path for path in pictures if not Path(path).exists()]
    if missing:
        raise FacewrightError(f"{missing[0]} does not exist: choose the pictures again")
    if len(pictures) > 1 and any(video.is_video(path) for path in pictures):
        raise FacewrightError("choose either one video, or pictures without videos")
    return _calibrated(pictures, options_of(board, lens), picture)


def options_of(board: BoardSettings | CalibrateOptions, lens: LensSettings | None = None) -> CalibrateOptions:
    """The library's options of a board and a lens."""
    if isinstance(board, CalibrateOptions):
        return board
    return CalibrateOptions(**board.arguments, **(lens or LensSettings()).arguments)


def _calibrated(pictures: list[str], options: CalibrateOptions, picture: str | None) -> Work[str]:
    frames = video.Frames(pictures)
    if video.is_video(pictures[0]):
        frames = yield from video.opened(pictures[0], spread(pictures[0]))
    with frames:
        job = calibrate(frames.paths, numbers=frames.numbers, options=options, picture=picture)
        return (yield from frames.behind(watch(job))).to_json()


def spread(path: str) -> list[int]:
    """Frames of a video to look at: all of a short one, else evenly many."""
    count = video.frame_count(path)
    if count == 0:
        raise FacewrightError(f"{path} cannot be read as a video")
    return np.unique(np.linspace(0, count - 1, min(count, MAX_FRAMES)).round().astype(int)).tolist()


def read_camera(path: str) -> str:
    """The text of a camera file, checked."""
    return Camera.read(path).to_json()


def save_camera(path: str, text: str) -> None:
    """Write a camera.json, whole or not at all."""
    parse(text).write(path)


def save_picture(path: str, text: str) -> None:
    """Draw boards, corners, errors and numbers, as the SVG, PDF or PNG that the path's extension says."""
    save_calibration_picture(text, path)


def save_board(path: str, board: BoardSettings, page: Page) -> None:
    """Write a board to print, as the SVG, PDF or PNG that the path's extension says."""
    _save_board(path, page=page, **board.arguments)


def known(text: str) -> Camera | None:
    """The camera that a scene holds; None without one, or with text that is none."""
    try:
        return parse(text) if text else None
    except FacewrightError:
        return None


def summary(text: str) -> list[str]:
    """A camera in two lines; empty without one."""
    camera = known(text)
    if camera is None:
        return []
    lines = [f"{camera.width} × {camera.height}, focal {camera.fx:.1f} px"]
    if camera.rms_px is not None:
        images = camera.images
        found, used = sum(image.found for image in images), sum(image.used for image in images)
        some = f", {used} used" if used < found else ""
        lines.append(f"{found} of {len(images)} boards{some}, error {camera.rms_px:.3f} px")
    return lines


def numbers(text: str) -> list[Number]:
    """The camera's numbers with their standard deviations; empty without a camera."""
    camera = known(text)
    return shown_numbers(camera) if camera else []


def warnings(text: str) -> list[str]:
    """What to photograph next, and what to distrust."""
    camera = known(text)
    return camera.warnings if camera else []


def fill_table(settings: Any) -> None:
    """Make the table of pictures anew from the camera's text."""
    settings.pictures.clear()
    camera = known(settings.text)
    if camera is None:
        return
    for picture in pictures(camera):
        row, image = settings.pictures.add(), picture.image
        row.name, row.found, row.used = picture.name, image.found, image.used
        row.rms, row.worst, row.hold_out = image.rms_px or 0.0, image.worst_px or 0.0, image.hold_out_rms_px or 0.0
        row.bad, row.reason = picture.is_bad, image.reason or picture.complaint
    if settings.active >= len(settings.pictures):
        settings.active = 0


def set_camera(scene: Any, text: str) -> None:
    """Let a scene have this camera; boards that are shown follow."""
    scene.facewright_camera.text = text
    if scene_boards.collection(scene) is not None:
        show_boards(scene)


def show_boards(scene: Any) -> None:
    """Put the scene's camera and its boards into it, or bring them up to date."""
    camera = known(scene.facewright_camera.text)
    if camera is not None:
        scene_boards.place(scene, camera, scene.facewright_camera.wire)


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
