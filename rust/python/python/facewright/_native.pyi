from collections.abc import Sequence
from typing import Generic, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

T = TypeVar("T")

class FacewrightError(Exception):
    """A sentence that says what is wrong and what to do. Nothing was written or changed."""

class Cancelled(FacewrightError):
    """The job was cancelled."""

class Job(Generic[T]):
    """Work on a thread of its own. Dropping the job cancels it."""

    def progress(self) -> tuple[str, float, float | None]:
        """Name of the present stage, the part of the whole work that is done, 0 to 1, and seconds left.

        The part never falls; the seconds are None as long as the work so far tells nothing of them.
        """

    def finished(self) -> bool:
        """Whether :meth:`result` returns at once."""

    def cancel(self) -> None:
        """Ask the work to stop; it does within a fraction of a second."""

    def result(self) -> T:
        """Wait for the result. Raises :class:`FacewrightError`, or :class:`Cancelled`. Call once."""

class Reconstruction:
    """A head on the generic head's topology; head frame (x the subject's left, y up, z out of the face), metres."""

    @property
    def positions(self) -> NDArray[np.float32]:
        """(n, 3) the person at rest."""
    @property
    def generic_positions(self) -> NDArray[np.float32]:
        """(n, 3) the generic head's own vertices."""
    @property
    def quads(self) -> NDArray[np.uint32]:
        """(m, 4) vertex indices, counter-clockwise from outside."""
    @property
    def uvs(self) -> NDArray[np.float32]:
        """(m, 4, 2) texture coordinates of each quad's corners, v up."""
    @property
    def parts(self) -> list[tuple[str, tuple[int, int], tuple[int, int]]]:
        """(name, (first vertex, end), (first quad, end)): skin first."""
    @property
    def keys(self) -> list[tuple[str, NDArray[np.uint32], NDArray[np.float32]]]:
        """(name, moved vertices (k,), their offsets (k, 3)): 52 ARKit keys, then 15 visemes."""
    @property
    def expressions(self) -> list[tuple[str, list[tuple[str, float]]]]:
        """Named poses: (name, [(ARKit key, value)])."""
    @property
    def texture(self) -> NDArray[np.uint8]:
        """(size, size, 4) sRGB of the skin, top row first; alpha below 255 where no frame looked."""
    @property
    def eyes(self) -> NDArray[np.uint8]:
        """(size, size, 4) sRGB of the eyes, top row first."""
    @property
    def report(self) -> str:
        """report.json as text."""
    def write(self, folder: str) -> None:
        """Write head.glb, texture.png, eyes.png and report.json, all or none."""

def version() -> str:
    """Version of the library."""

def save_board(
    path: str,
    *,
    inner: tuple[int, int] = (9, 6),
    squares: tuple[int, int] | None = None,
    gap_mm: float | None = None,
    square_mm: float = 25.5,
    page: Literal["A4", "A3", "Letter"] = "A4",
    mark: bool = True,
    dpi: float = 300.0,
) -> None:
    """Write a board to print as the SVG, PDF or PNG that the path's extension says, exact at 100 % print scale.

    It is a checkerboard of `inner` corners (columns, rows), or black `squares` with `gap_mm` (default: their side)
    between them. `mark` puts a white disc into the first black square, which tells which way up the board is.
    """

def check_folder(folder: str) -> None:
    """Raise :class:`FacewrightError` when a result folder cannot be written; nothing is left behind."""

def calibrate(
    pictures: Sequence[str],
    *,
    inner: tuple[int, int] = (9, 6),
    squares: tuple[int, int] | None = None,
    gap_mm: float | None = None,
    square_mm: float = 25.5,
    picture: str | None = None,
) -> Job[str]:
    """Calibrate a camera from image files, folders or videos of a board; the result is camera.json as text.

    The board is described as for :func:`save_board`. The result is also drawn into `picture`, as by
    :func:`save_calibration_picture`.
    """

def calibrate_rig(
    cameras: Sequence[tuple[str, Sequence[str]]],
    *,
    inner: tuple[int, int] = (9, 6),
    squares: tuple[int, int] | None = None,
    gap_mm: float | None = None,
    square_mm: float = 25.5,
    picture: str | None = None,
) -> Job[str]:
    """Calibrate cameras that saw one board at the same moments, and where they stand; the result is rig.json as text.

    `cameras` are (name, pictures). Pictures with the same number at the end of their names belong to one moment;
    without numbers, the k-th ones of all cameras do.
    """

def save_calibration_picture(text: str, path: str) -> None:
    """Draw a camera.json or rig.json, given as text, into the SVG, PDF or PNG that the path's extension says."""

def track(
    frames: Sequence[str],
    *,
    assets: str,
    camera: str | None = None,
    method: Literal["default", "paper"] = "default",
    points: int = 200,
    window: int | None = None,
) -> Job[str]:
    """Track points of the face through image files, folders or videos; the result is tracks.json as text.

    `camera` is camera.json as text. `points` are wanted in each frame in which points are chosen; `window` is the side
    of the tracker's window in pixels, odd.
    """

def motion(
    tracks: str,
    *,
    camera: str | None = None,
    interocular_mm: float | None = None,
    lengths: Sequence[tuple[int, int, float]] = (),
) -> Job[str]:
    """Solve for the head's pose in every frame and the places of its points; the result is motion.json as text.

    `tracks` is tracks.json as text, `camera` camera.json as text, instead of the camera of the tracks. `lengths` are
    (number of a track, number of another, millimetres between them) as measured on the head.
    """

def motion_on_rig(films: Sequence[tuple[str, str]], rig: str) -> Job[str]:
    """Solve for the motion that the first film shows; the places of the rig's cameras give its size.

    `films` are names of the rig's cameras with the tracks.json, as text, of the film each took at the same moments;
    `rig` is rig.json as text. The result is motion.json as text.
    """

def reconstruct(
    frames: Sequence[str],
    *,
    assets: str,
    camera: str | None = None,
    method: Literal["default", "paper"] = "default",
    texture_size: int = 2048,
    interocular_mm: float | None = None,
    tracks: str | None = None,
) -> Job[Reconstruction]:
    """Reconstruct the head in image files, folders or videos; `camera` is camera.json as text.

    `tracks` is tracks.json of the same frames as text, to use instead of tracking; only with the method `default`.
    """

def generic_head(assets: str) -> Reconstruction:
    """The generic head itself, with its own keys and a plain texture."""
