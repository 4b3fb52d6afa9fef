from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any, Generic, Literal, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

T = TypeVar("T")
Path = str | PathLike[str]
Method = Literal["default", "paper"]
Grid = tuple[int, int]

# Options are no dataclasses, but are made, read and compared like frozen ones. Each has `replace(**fields)`.

class _Options:
    def replace(self, **fields: Any) -> Self:
        """The same options with these replaced."""

@dataclass(frozen=True, kw_only=True)
class BoardOptions(_Options):
    """A board that is filmed: a checkerboard of inner corners (columns, rows), or separate black squares."""

    inner: Grid | Sequence[Grid] = ((9, 6),)
    squares: Grid | None = None
    gap_mm: float | None = None
    square_mm: float = 25.5

@dataclass(frozen=True, kw_only=True)
class SheetOptions(BoardOptions):
    """What :func:`save_board` prints, and on what."""

    page: Literal["A4", "A3", "Letter"] = "A4"
    mark: bool = True
    dpi: float = 300.0

@dataclass(frozen=True, kw_only=True)
class CalibrateOptions(BoardOptions):
    """The board that was filmed, and the model of the lens."""

    distortion_terms: int = 2
    tangential: bool = False
    square_pixels: bool = False
    bend: Literal["never", "judged", "always"] = "judged"

@dataclass(frozen=True, kw_only=True)
class UndistortOptions(_Options):
    """How :func:`undistort` works."""

    keep: Literal["same-focal", "all-pixels", "no-empty-pixels"] = "same-focal"

@dataclass(frozen=True, kw_only=True)
class MatchOptions(_Options):
    """How :func:`match_pair` works."""

    method: Method = "default"
    points: int = 66
    window: int | None = None
    levels: int | None = None
    correct: bool = True
    epipolar_px: float = 1.0

@dataclass(frozen=True, kw_only=True)
class TrackOptions(_Options):
    """How :func:`track` works."""

    method: Method = "default"
    points: int = 200
    window: int | None = None
    from_: str | None = None

@dataclass(frozen=True, kw_only=True)
class MotionOptions(_Options):
    """How :func:`motion` works."""

    interocular_mm: float | None = None
    lengths: Sequence[tuple[int, int, float]] = ()

@dataclass(frozen=True, kw_only=True)
class ReconstructOptions(MotionOptions):
    """How :func:`reconstruct` works."""

    method: Method = "default"
    texture_size: int = 2048

class Assets:
    """The generic head and the landmark nets of a folder, read when a job first needs them and kept for all others.

    It is taken wherever `assets=` is, from any thread.
    """

    def __init__(self, folder: Path) -> None: ...
    @property
    def folder(self) -> str:
        """The folder of generic_head.safetensors.gz and nets/."""

class Command:
    """A command line that was read: the command's word, its files and options."""

    @property
    def name(self) -> str:
        """The command's word, like "track"."""
    @property
    def files(self) -> dict[str, Any]:
        """What it reads and writes, by the names that the help has: paths as text, None where nothing was given."""
    @property
    def options(self) -> Any:
        """Its options, of the class that the function of the same name takes; None where it has none."""
    @property
    def assets(self) -> str | None:
        """Folder of the assets, where one was given."""
    @property
    def json(self) -> bool:
        """Whether the result shall be printed as JSON."""

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
        """Wait for the result. Raises `FacewrightError`, or `Cancelled`. Call once."""

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

def check_folder(folder: Path) -> None:
    """Raise `OutputError` when a result folder cannot be written; nothing is left behind."""

def save_board(path: Path, *, options: SheetOptions | None = None, **fields: Any) -> None:
    """Write a board to print as the SVG, PDF or PNG that the path's extension says, exact at 100 % print scale.

    `options` or further keywords are those of :class:`SheetOptions`: the board, the page, the mark.
    """

def calibrate(
    pictures: Sequence[Path],
    *,
    picture: Path | None = None,
    options: CalibrateOptions | None = None,
    **fields: Any,
) -> Job[str]:
    """Calibrate a camera from image files, folders or videos of a board; the job's result is camera.json as text.

    `options` or further keywords are those of :class:`CalibrateOptions`. The result is also drawn into `picture`, as by
    :func:`save_calibration_picture`.
    """

def calibrate_rig(
    cameras: Sequence[tuple[str, Sequence[Path]]],
    *,
    picture: Path | None = None,
    options: CalibrateOptions | None = None,
    **fields: Any,
) -> Job[str]:
    """Calibrate cameras that saw one board at the same moments, and where they stand; the result is rig.json as text.

    `cameras` are (name, pictures). Pictures with the same number at the end of their names belong to one moment;
    without numbers, the k-th ones of all cameras do. `options` or further keywords are those of
    :class:`CalibrateOptions`.
    """

def save_calibration_picture(text: str, path: Path) -> None:
    """Draw a camera.json or rig.json, given as text, into the SVG, PDF or PNG that the path's extension says."""

def undistort(
    pictures: Sequence[Path],
    folder: Path,
    *,
    camera: str,
    options: UndistortOptions | None = None,
    **fields: Any,
) -> Job[str]:
    """Write pictures without lens distortion into a folder, as PNG under their names.

    `camera` is camera.json as text. The job's result is the camera of the new pictures as text, which is also left as
    camera.json among them. `options` or further keywords are those of :class:`UndistortOptions`.
    """

def match_pair(
    a: Path,
    b: Path,
    *,
    assets: Assets | Path,
    camera: str | None = None,
    picture: Path | None = None,
    options: MatchOptions | None = None,
    **fields: Any,
) -> Job[str]:
    """Match corners of the face between two frames; the job's result is matches.json as text.

    `camera` is camera.json as text. Both frames with their matches are also drawn into `picture`: SVG, PDF or PNG.
    `options` or further keywords are those of :class:`MatchOptions`.
    """

def track(
    frames: Sequence[Path],
    *,
    assets: Assets | Path,
    camera: str | None = None,
    options: TrackOptions | None = None,
    **fields: Any,
) -> Job[str]:
    """Track points of the face through image files, folders or videos; the job's result is tracks.json as text.

    `camera` is camera.json as text; without it the focal length is estimated. `options` or further keywords are those
    of :class:`TrackOptions`.
    """

def motion(
    tracks: str,
    *,
    camera: str | None = None,
    options: MotionOptions | None = None,
    **fields: Any,
) -> Job[str]:
    """Solve for the head's pose in every frame and the places of its points; the job's result is motion.json as text.

    `tracks` is tracks.json as text, `camera` camera.json as text, instead of the camera of the tracks. `options` or
    further keywords are those of :class:`MotionOptions`; `lengths` are (number of a track, number of another,
    millimetres between them) as measured on the head.
    """

def motion_on_rig(films: Sequence[tuple[str, str]], rig: str) -> Job[str]:
    """Solve for the motion that the first film shows; the places of the rig's cameras give its size.

    `films` are names of the rig's cameras with the tracks.json, as text, of the film each took at the same moments;
    `rig` is rig.json as text. The job's result is motion.json as text.
    """

def reconstruct(
    frames: Sequence[Path],
    *,
    assets: Assets | Path,
    camera: str | None = None,
    tracks: str | None = None,
    motion: str | None = None,
    options: ReconstructOptions | None = None,
    **fields: Any,
) -> Job[Reconstruction]:
    """Reconstruct the head in image files, folders or videos.

    `camera`, `tracks` and `motion` are camera.json, tracks.json and motion.json of the same frames as text: what is
    given is not found anew. `options` or further keywords are those of :class:`ReconstructOptions`.
    """

def overlay(result: Path, frames: Sequence[Path], folder: Path) -> Job[list[str]]:
    """Draw the head of a result folder over its frames, into PNG of the frames' names, which the result lists."""

def generic_head(assets: Assets | Path) -> Reconstruction:
    """The generic head itself, with its own keys and a plain texture."""

def parse_command(arguments: Sequence[str], *, program: str = "facewright") -> Command:
    """Read a command line of the `facewright` program, without its name, and do nothing yet.

    `program` is what the help and errors call it. Raises `UsageError` where it cannot be read, and where help is asked
    for.
    """

def run(arguments: Sequence[str], *, program: str = "facewright") -> int:
    """Do what a command line of the `facewright` program asks for and print what it prints; the exit code.

    `program` is what the help and errors call it. An interrupt cancels the work.
    """
