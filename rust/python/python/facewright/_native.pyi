import pathlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any, Generic, Literal, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

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
    """The board that was filmed: a checkerboard of inner corners, or separate black squares.

    Keyword arguments, and attributes:

        gap_mm: White gap between two separate squares, millimetres (default: the side of a square)
        inner: Inner corners of a checkerboard, columns x rows; several if any of several boards may be shown:
            9x6,8x5
        square_mm: Side of a square, millimetres
        squares: Separate black squares instead of a checkerboard, columns x rows
    """

    inner: Grid | Sequence[Grid] = ((9, 6),)
    squares: Grid | None = None
    gap_mm: float | None = None
    square_mm: float = 25.5

@dataclass(frozen=True, kw_only=True)
class SheetOptions(BoardOptions):
    """What save_board prints, and on what.

    Keyword arguments, and attributes:

        dpi: Resolution of a PNG, dots per inch
        gap_mm: White gap between two separate squares, millimetres (default: the side of a square)
        inner: Inner corners of a checkerboard, columns x rows; several if any of several boards may be shown:
            9x6,8x5
        mark: False: Leave out the white disc that tells which way up the board is
        page: Paper
        square_mm: Side of a square, millimetres
        squares: Separate black squares instead of a checkerboard, columns x rows
    """

    page: Literal["A4", "A3", "Letter"] = "A4"
    mark: bool = True
    dpi: float = 300.0

@dataclass(frozen=True, kw_only=True)
class CalibrateOptions(BoardOptions):
    """The board that was filmed, and the model of the lens.

    Keyword arguments, and attributes:

        bend: When to solve for a board that is not flat; for a rig only with `always`
        distortion_terms: Radial distortion terms, 0 to 3
        gap_mm: White gap between two separate squares, millimetres (default: the side of a square)
        inner: Inner corners of a checkerboard, columns x rows; several if any of several boards may be shown:
            9x6,8x5
        square_mm: Side of a square, millimetres
        square_pixels: One focal length for both directions
        squares: Separate black squares instead of a checkerboard, columns x rows
        tangential: Also solve for tangential distortion
    """

    distortion_terms: int = 2
    tangential: bool = False
    square_pixels: bool = False
    bend: Literal["never", "judged", "always"] = "judged"

@dataclass(frozen=True, kw_only=True)
class UndistortOptions(_Options):
    """How undistort works.

    Keyword arguments, and attributes:

        keep: Which part of the picture is kept
    """

    keep: Literal["same-focal", "all-pixels", "no-empty-pixels"] = "same-focal"

@dataclass(frozen=True, kw_only=True)
class MatchOptions(_Options):
    """How match_pair works.

    Keyword arguments, and attributes:

        correct: False: Leave the matches as the tracker found them
        epipolar_px: Largest distance of a kept match from its epipolar line, pixels; only with the default method
        levels: Pyramid levels of the tracker (default: 4 for the paper's method, otherwise 2)
        method: Chain of steps
        points: Number of corners at most
        window: Window of the tracker, pixels, odd (default: 7 for the paper's method, otherwise in proportion to the
            face)
    """

    method: Method = "default"
    points: int = 66
    window: int | None = None
    levels: int | None = None
    correct: bool = True
    epipolar_px: float = 1.0

@dataclass(frozen=True, kw_only=True)
class TrackOptions(_Options):
    """How track works.

    Keyword arguments, and attributes:

        face: Of several faces the one nearest to this pixel where the clip begins, instead of the largest one that
            turns
        from_: Choose points only in this frame, given by its name without extension
        method: Chain of steps
        points: Number of points wanted in each reference frame, found again or new
        window: Window of the tracker, pixels, odd (default: 7 for the paper's method, otherwise in proportion to the
            face)
    """

    method: Method = "default"
    points: int = 200
    window: int | None = None
    from_: str | None = None
    face: tuple[float, float] | None = None

@dataclass(frozen=True, kw_only=True)
class MotionOptions(_Options):
    """How motion works.

    Keyword arguments, and attributes:

        interocular_mm: Interpupillary distance, millimetres, if it is known
        lengths: Length measured on the head between two tracks: their numbers and millimetres; overrides all else
            that is known of the head's size
    """

    interocular_mm: float | None = None
    lengths: Sequence[tuple[int, int, float]] = ()

@dataclass(frozen=True, kw_only=True)
class ReconstructOptions(MotionOptions):
    """How reconstruct works.

    Keyword arguments, and attributes:

        dense: False: Leave the skin as its points give it, without measuring it densely; only with the default
            method
        face: Of several faces the one nearest to this pixel where the clip begins, instead of the largest one that
            turns
        interocular_mm: Interpupillary distance, millimetres, if it is known
        lengths: Length measured on the head between two tracks: their numbers and millimetres; overrides all else
            that is known of the head's size
        method: Chain of steps
        texture_size: Width and height of the texture, pixels
    """

    method: Method = "default"
    texture_size: int = 2048
    dense: bool = True
    face: tuple[float, float] | None = None

class Assets:
    """The generic head and the landmark nets in a folder, read when a job first needs them and kept for later ones.

    Pass it as `assets=`, from any thread.
    """

    def __init__(self, folder: Path) -> None: ...
    @property
    def folder(self) -> str:
        """The folder of generic_head.safetensors.gz and nets/."""

class Command:
    """A command line that was parsed: the command's name, its files and options."""

    @property
    def name(self) -> str:
        """The command's name, like "track"."""
    @property
    def files(self) -> dict[str, Any]:
        """What it reads and writes, under the names in the help: paths as text, None where nothing was given."""
    @property
    def options(self) -> Any:
        """Its options, of the class that the function of the same name takes; None where it has none."""
    @property
    def assets(self) -> str | None:
        """Folder of the assets, if one was given."""
    @property
    def json(self) -> bool:
        """Whether to print the result as JSON."""

class Job(Generic[T]):
    """Work on a thread of its own, which never touches Python. Dropping the job cancels it."""

    def progress(self) -> tuple[str, float, float | None]:
        """Name of the present stage, the fraction of the whole work that is done, 0 to 1, and seconds left.

        The fraction never decreases; the seconds are None until they can be estimated.
        """

    def step(self) -> tuple[int, int] | None:
        """Number of the present step, counted from 1, and of all steps; None where the work has only one."""

    def sketch(self, after: int = 0) -> tuple[int, NDArray[np.float32]] | None:
        """What a reconstruction has of the head so far: its number, and (n, 3) vertices as a Reconstruction has them.

        None before the first, and while there is none after the one of the number `after`.
        """

    def finished(self) -> bool:
        """Whether result() returns immediately."""

    def cancel(self) -> None:
        """Ask the work to stop; it does within a fraction of a second."""

    def result(self) -> T:
        """Wait for the result. Raises FacewrightError, or Cancelled. Call once. An interrupt cancels the work."""

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
        """report.json as text; `parsed_report` is the same as a class."""
    @property
    def parsed_report(self) -> Report:
        """The same as `report`, read: frames, fit and texture as attributes."""
    def write(self, folder: str) -> None:
        """Write head.glb, texture.png, eyes.png and report.json into a folder, all or none; raises OutputError."""

class Camera:
    """A camera.json: a pinhole camera with a lens, and the pictures of a board that it was calibrated from.

    Pixels: x right, y down, centres at integers. A point (X, Y, Z) of the camera frame (x right, y down, z forward)
    with x = X/Z, y = Y/Z, r² = x² + y² is seen at u = fx (x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²))
    + cx, and v alike.
    """

    @staticmethod
    def parse(text: str) -> Camera:
        """Parse the text of a camera.json; raises FacewrightError with what is wrong."""
    @staticmethod
    def read(path: Path) -> Camera:
        """Read a camera.json; raises FacewrightError with what is wrong."""
    def write(self, path: Path) -> None:
        """Write a camera.json, whole or not at all."""
    def to_json(self) -> str:
        """The text of a camera.json, in one line."""
    @property
    def width(self) -> int:
        """Width of the pictures, pixels."""
    @property
    def height(self) -> int:
        """Height of the pictures, pixels."""
    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the pictures, pixels."""
    @property
    def fx(self) -> float:
        """Focal length along x, pixels."""
    @property
    def fy(self) -> float:
        """Focal length along y, pixels."""
    @property
    def cx(self) -> float:
        """Principal point, pixels from the centre of the top left pixel."""
    @property
    def cy(self) -> float:
        """Principal point, pixels from the centre of the top left pixel."""
    @property
    def k1(self) -> float:
        """First radial coefficient."""
    @property
    def k2(self) -> float:
        """Second radial coefficient."""
    @property
    def k3(self) -> float:
        """Third radial coefficient."""
    @property
    def p1(self) -> float:
        """First tangential coefficient."""
    @property
    def p2(self) -> float:
        """Second tangential coefficient."""
    @property
    def source(self) -> Literal["board", "exif", "estimated"]:
        """Where the numbers come from: `board`, `exif` or `estimated`."""
    @property
    def rms_px(self) -> float | None:
        """Root mean square reprojection error of all corners, pixels; None, as below, where the file lists no board."""
    @property
    def hold_out_rms_px(self) -> float | None:
        """The same for corners in held-out pictures."""
    @property
    def deviations(self) -> dict[str, float]:
        """Standard deviations of the numbers by their names; 0 where a number was fixed, empty where none are known."""
    @property
    def bend(self) -> BoardBend | None:
        """How far the board is from flat, if the pictures determine it."""
    @property
    def boards(self) -> list[Board]:
        """The boards looked for."""
    @property
    def images(self) -> list[BoardImage]:
        """What became of each picture."""
    @property
    def warnings(self) -> list[str]:
        """What to photograph next, and what to distrust."""

class BoardBend:
    """How far a board is from flat."""

    @property
    def bulge_mm(self) -> float:
        """Height difference of the highest and the lowest corner, millimetres."""
    @property
    def deviation_mm(self) -> float:
        """Its standard deviation."""

class Board:
    """A board of equal squares: x along the rows, y from row to row, z = 0, the origin in the first corner."""

    @property
    def columns(self) -> int:
        """Of a checkerboard the inner corners in a row, otherwise the black squares in a row."""
    @property
    def rows(self) -> int:
        """Rows of them."""
    @property
    def square(self) -> float:
        """Side of a square, metres."""
    @property
    def gap(self) -> float | None:
        """Between separate squares, in parts of a square's side; None for a checkerboard."""

class BoardImage:
    """What became of a picture of the board."""

    @property
    def name(self) -> str:
        """File name without extension."""
    @property
    def found(self) -> bool:
        """Whether the board was found."""
    @property
    def used(self) -> bool:
        """Whether the camera was calibrated from it."""
    @property
    def reason(self) -> str:
        """Why not; empty if it was."""
    @property
    def board(self) -> int | None:
        """Number of the board that it shows."""
    @property
    def rms_px(self) -> float | None:
        """Root mean square reprojection error of its corners, pixels."""
    @property
    def worst_px(self) -> float | None:
        """Largest error of a corner, pixels."""
    @property
    def hold_out_rms_px(self) -> float | None:
        """The same as `rms_px` with a camera calibrated without this picture."""
    @property
    def cam_from_board(self) -> NDArray[np.float64] | None:
        """(4, 4) pose of the board, metres; of a picture that was used."""
    @property
    def corner_indices(self) -> NDArray[np.int64]:
        """(n,) numbers of the corners that were seen, row by row of the board."""
    @property
    def corners(self) -> NDArray[np.float64]:
        """(n, 2) where they were seen, pixels."""
    @property
    def residuals(self) -> NDArray[np.float64]:
        """(n, 2) seen less projected, pixels."""

class Rig:
    """A rig.json: several cameras that were calibrated together, and their poses.

    The rig's frame is that of its first camera: x right, y down, z forward, metres.
    """

    @staticmethod
    def parse(text: str) -> Rig:
        """Parse the text of a rig.json; raises FacewrightError with what is wrong."""
    @staticmethod
    def read(path: Path) -> Rig:
        """Read a rig.json; raises FacewrightError with what is wrong."""
    def write(self, path: Path) -> None:
        """Write a rig.json, whole or not at all."""
    def to_json(self) -> str:
        """The text of a rig.json, in one line."""
    @property
    def cameras(self) -> list[MountedCamera]:
        """The cameras, in the order given."""
    @property
    def names(self) -> list[str]:
        """Their names."""
    def camera(self, name: str) -> Camera:
        """One of the cameras by its name, as a camera.json; raises CameraError where there is none."""
    @property
    def rms_px(self) -> float:
        """Root mean square reprojection error of all corners, pixels."""
    @property
    def hold_out_rms_px(self) -> float | None:
        """The hold-out error: of each moment, with a calibration without it."""
    @property
    def warnings(self) -> list[str]:
        """What to photograph next, and what to distrust."""
    def __len__(self) -> int: ...

class MountedCamera:
    """A camera of a rig, and its pose."""

    @property
    def name(self) -> str:
        """Its name."""
    @property
    def camera(self) -> Camera:
        """All of its camera.json."""
    @property
    def camera_from_rig(self) -> NDArray[np.float64]:
        """(4, 4) its pose, metres; the identity for the first one."""
    @property
    def rotation_deviations(self) -> NDArray[np.float64]:
        """(3,) standard deviations of small rotations about its axes, radians."""
    @property
    def translation_deviations(self) -> NDArray[np.float64]:
        """(3,) standard deviations of the translation along its axes, metres."""
    @property
    def covariance(self) -> NDArray[np.float64]:
        """(6, 6) covariance of both, in this order."""
    @property
    def baseline(self) -> float:
        """Distance of its centre from the first camera's, metres."""
    @property
    def baseline_deviation(self) -> float:
        """Standard deviation of that distance."""

Region = Literal["skin", "mouth", "eyes", "brows"]

class Tracks:
    """A tracks.json: the same points of a face in many frames."""

    @staticmethod
    def parse(text: str) -> Tracks:
        """Parse the text of a tracks.json; raises FacewrightError with what is wrong."""
    @staticmethod
    def read(path: Path) -> Tracks:
        """Read a tracks.json; raises FacewrightError with what is wrong."""
    def write(self, path: Path) -> None:
        """Write a tracks.json, whole or not at all."""
    def to_json(self) -> str:
        """The text of a tracks.json, in one line."""
    def with_tracks(self, tracks: Sequence[Track]) -> Tracks:
        """The same frames with other tracks, checked; the points of each frame are counted."""
    def with_disabled(self, disabled: Sequence[tuple[int, float, float]]) -> Tracks:
        """The same with other `disabled` places: frame and place (u, v) in pixels of each, near which nothing is
        measured.
        """
    def of_frames(self, names: Sequence[str]) -> Tracks:
        """As they concern other frames of the same clip, known by their names; some may not have been tracked."""
    @property
    def version(self) -> str:
        """Version of Facewright."""
    @property
    def method(self) -> Method:
        """How they were tracked: `default` or `paper`."""
    @property
    def camera(self) -> Camera:
        """The camera; its focal length is the landmarks' estimate unless it was calibrated."""
    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the pictures, pixels."""
    @property
    def interocular(self) -> float | None:
        """Interpupillary distance of the landmarks' head, whose poses the frames have, metres."""
    @property
    def window(self) -> int:
        """Side of the tracker's window in the first reference frame, pixels."""
    @property
    def frames(self) -> list[TrackedFrame]:
        """Every frame given."""
    @property
    def tracks(self) -> list[Track]:
        """The points."""
    @property
    def disabled(self) -> list[tuple[int, float, float]]:
        """Where an artist disabled points: index of the frame and place (u, v) in pixels of each."""
    @property
    def warnings(self) -> list[str]:
        """What the artist should know."""
    def __len__(self) -> int: ...

class TrackedFrame:
    """A frame of a sequence that was tracked."""

    @property
    def name(self) -> str:
        """File name without extension."""
    @property
    def used(self) -> bool:
        """Whether points were found in it."""
    @property
    def reason(self) -> str:
        """What it shows, or why nothing was found."""
    @property
    def reason_kind(self) -> str | None:
        """The same as a word for programs, like `blurred`; None in files that do not tell."""
    @property
    def cam_from_head(self) -> NDArray[np.float64] | None:
        """(4, 4) pose of the head by its landmarks, metres; None where no face was found."""
    @property
    def points(self) -> int:
        """Points found."""

class Track:
    """A point of the face in the frames in which it was found.

    Made of its number, the indices `frames` in which it was found, ascending, the `reference` among them in which it
    was chosen, `points` (n, 2) pixels with standard deviations `sigmas` (n,), and the `region`: skin, mouth, eyes or
    brows. `missing` gives a reason for frames in which it was not found. What contradicts itself is refused when the
    track comes into a Tracks.
    """

    def __new__(
        cls,
        id: int,
        *,
        reference: int,
        region: str,
        frames: Sequence[int] | NDArray[np.int64],
        points: ArrayLike,
        sigmas: ArrayLike,
        missing: Mapping[int, str] = ...,
        place: Sequence[float] | None = None,
    ) -> Track: ...
    def with_id(self, id: int) -> Track:
        """The same with another number."""
    @property
    def id(self) -> int:
        """Its number, unique among the tracks."""
    @property
    def reference(self) -> int:
        """Index of the frame in which it was chosen."""
    @property
    def region(self) -> Region:
        """What it belongs to: `skin`, `mouth`, `eyes` or `brows`."""
    @property
    def frames(self) -> NDArray[np.int64]:
        """(n,) indices of the frames in which it was found, ascending."""
    @property
    def points(self) -> NDArray[np.float64]:
        """(n, 2) where it was found, pixels of the picture as filmed: x right, y down, centres at integers."""
    @property
    def sigmas(self) -> NDArray[np.float64]:
        """(n,) one standard deviation along each axis, pixels."""
    @property
    def gaps(self) -> list[tuple[int, int, str]]:
        """First and last index of the frames in which it was not found, and why."""
    @property
    def place(self) -> tuple[float, float, float] | None:
        """Where it is on the landmarks' head at rest, head frame, metres; the artist's own points have no place."""

class Survey:
    """What a clip shows, by some of its frames: whether a head can be made of it, and what is missing."""

    @property
    def version(self) -> str:
        """Version of Facewright."""
    @property
    def frames(self) -> int:
        """How many frames the clip has, or those of its numbers that were given."""
    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the pictures, pixels."""
    @property
    def looks(self) -> list[SurveyedFrame]:
        """The frames that were looked at, in order."""
    @property
    def summary(self) -> list[str]:
        """How far the head turns, and how many of the frames that were looked at can be used, in words."""
    @property
    def findings(self) -> list[tuple[str, str]]:
        """What speaks against a reconstruction, as (word, sentence); empty for a good clip."""
    def part(self, numbers: set[int]) -> Survey:
        """The same of the frames with some numbers alone; nothing is looked at again."""
    def to_json(self) -> str:
        """All but the thumbnails as JSON, in one line."""

class SurveyedFrame:
    """A frame that was looked at."""

    @property
    def number(self) -> int:
        """Its number in the clip, counted from 0."""
    @property
    def name(self) -> str:
        """File name without extension."""
    @property
    def usable(self) -> bool:
        """Whether shape and texture could be taken from it."""
    @property
    def reason(self) -> str:
        """How far the head is turned, or why the frame is of no use."""
    @property
    def reason_kind(self) -> str:
        """The same as a word, like `blurred`."""
    @property
    def rectangle(self) -> list[int] | None:
        """The rectangle around the face: left, top, width, height, pixels; None without one."""
    @property
    def turn_deg(self) -> tuple[float, float, float] | None:
        """Yaw, pitch and roll of the head, degrees: positive where the nose points to the right of the picture, where
        it looks up, and where the crown leans to the right. None without a face.
        """
    @property
    def eye_distance_px(self) -> float | None:
        """Distance between the eyes, pixels; None without a face."""
    @property
    def sharpness(self) -> float | None:
        """Sharpness of the face: compare within a clip. None without one."""
    @property
    def thumbnail(self) -> NDArray[np.uint8]:
        """(height, width, 3) sRGB of the whole picture, 96 pixels wide or high, top row first."""

class Matches:
    """A matches.json: corners of the face matched between two frames."""

    @staticmethod
    def parse(text: str) -> Matches:
        """Parse the text of a matches.json; raises FacewrightError with what is wrong."""
    @staticmethod
    def read(path: Path) -> Matches:
        """Read a matches.json; raises FacewrightError with what is wrong."""
    def write(self, path: Path) -> None:
        """Write a matches.json, whole or not at all."""
    def to_json(self) -> str:
        """The text of a matches.json, in one line."""
    @property
    def pairs(self) -> list[MatchedPair]:
        """The pairs of frames."""
    def __len__(self) -> int: ...

class MatchedPair:
    """The matches of two frames as arrays of one length."""

    @property
    def a(self) -> str:
        """Name of the first frame, without extension."""
    @property
    def b(self) -> str:
        """Name of the second frame, without extension."""
    @property
    def points_a(self) -> NDArray[np.float64]:
        """(n, 2) where they are in the first frame, pixels as filmed: x right, y down, centres at integers."""
    @property
    def points_b(self) -> NDArray[np.float64]:
        """(n, 2) where they are in the second frame; one that is not kept, where it was last believed to be."""
    @property
    def kept(self) -> NDArray[np.bool_]:
        """(n,) whether each is believed."""
    @property
    def tracked(self) -> NDArray[np.float64]:
        """(n, 2) where the tracker put them in the second frame before the correction; NaN where it gave up."""
    @property
    def outcomes(self) -> list[str]:
        """What became of each: kept, or moved or rejected with why."""
    @property
    def violations_before(self) -> int:
        """Cross matches (method paper) or flipped triangles (default) before the correction."""
    @property
    def violations_after(self) -> int:
        """The same after it."""
    def __len__(self) -> int: ...

class Faces:
    """A faces.json: what the nets saw in the frames of a clip that they ran on."""

    @staticmethod
    def parse(text: str) -> Faces:
        """Parse the text of a faces.json; raises FacewrightError with what is wrong."""
    @staticmethod
    def read(path: Path) -> Faces:
        """Read a faces.json; raises FacewrightError with what is wrong."""
    def write(self, path: Path) -> None:
        """Write a faces.json, whole or not at all."""
    def to_json(self) -> str:
        """The text of a faces.json, in one line."""
    @property
    def version(self) -> str:
        """Version of Facewright."""
    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the pictures, pixels."""
    @property
    def names(self) -> list[str]:
        """Names of all frames."""
    @property
    def looked(self) -> list[int]:
        """Indices of the frames that the nets ran on."""
    @property
    def seen(self) -> list[int]:
        """Indices of the frames in which the face was seen, ascending."""
    @property
    def landmarks(self) -> NDArray[np.float64]:
        """(n, 468, 3) landmarks in the seen frames: u, v pixels, and depth in the same scale, growing away from the
        camera.
        """
    def irises(self, side: int) -> NDArray[np.float64]:
        """(n, 2) centres of an iris in the seen frames, pixels; `side` 0 is the subject's left."""
    @property
    def sharpness(self) -> NDArray[np.float64]:
        """(n,) sharpness of the face in the looked frames: compare within a clip."""
    @property
    def warnings(self) -> list[str]:
        """What the artist should know."""

class Motion:
    """A motion.json: the pose of the head in every frame, and a metric cloud of its points."""

    @staticmethod
    def parse(text: str) -> Motion:
        """Parse the text of a motion.json; raises FacewrightError with what is wrong."""
    @staticmethod
    def read(path: Path) -> Motion:
        """Read a motion.json; raises FacewrightError with what is wrong."""
    def write(self, path: Path) -> None:
        """Write a motion.json, whole or not at all."""
    def to_json(self) -> str:
        """The text of a motion.json, in one line."""
    @property
    def version(self) -> str:
        """Version of Facewright."""
    @property
    def method(self) -> Method:
        """How it was solved: `default` or `paper`."""
    @property
    def camera(self) -> Camera:
        """The camera, its focal length refined unless it was calibrated."""
    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the pictures, pixels."""
    @property
    def focal_sigma_px(self) -> float | None:
        """Standard deviation of a refined focal length, pixels; None where it was given."""
    @property
    def frames(self) -> list[MotionFrame]:
        """Every frame of the tracks."""
    @property
    def poses(self) -> NDArray[np.float64]:
        """(n, 4, 4) cam_from_head of every frame, metres; NaN where there is no pose."""
    @property
    def posed(self) -> list[int]:
        """Indices of the frames that have a pose."""
    @property
    def points(self) -> MotionPoints:
        """Every point that has a position."""
    @property
    def scale(self) -> Scale:
        """What the size rests on."""
    @property
    def reprojection_rms_px(self) -> float:
        """Root mean square distance of points from where they are seen, pixels, over all that agree."""
    @property
    def roughness(self) -> Roughness:
        """How unsteady it is."""
    @property
    def timings_s(self) -> dict[str, float]:
        """Seconds per stage."""
    @property
    def warnings(self) -> list[str]:
        """What the artist should know."""

class MotionFrame:
    """A frame of a motion."""

    @property
    def name(self) -> str:
        """File name without extension."""
    @property
    def used(self) -> bool:
        """Whether the head could be placed in it."""
    @property
    def reason(self) -> str:
        """What it rests on, or why there is no pose."""
    @property
    def reason_kind(self) -> str | None:
        """The same as a word for programs, like `blurred`; None in files that do not tell."""
    @property
    def cam_from_head(self) -> NDArray[np.float64] | None:
        """(4, 4) pose of the head, metres; None where it was left out."""
    @property
    def rotation_sigma_deg(self) -> float | None:
        """Standard deviation of the rotation, degrees, root of the sum over the axes."""
    @property
    def translation_sigma_mm(self) -> float | None:
        """Standard deviation of the position at the head's centre, millimetres, root of the sum over the axes."""
    @property
    def reprojection_rms_px(self) -> float | None:
        """Root mean square distance of its points from where they are seen, pixels."""
    @property
    def points(self) -> int:
        """Points that agree with the pose."""

class MotionPoints:
    """The points of a motion as arrays of one length."""

    @property
    def ids(self) -> NDArray[np.int64]:
        """(n,) numbers of their tracks."""
    @property
    def positions(self) -> NDArray[np.float64]:
        """(n, 3) head frame, metres."""
    @property
    def sigmas_mm(self) -> NDArray[np.float64]:
        """(n,) standard deviations, millimetres, root mean square over the axes."""
    @property
    def frames(self) -> NDArray[np.int64]:
        """(n,) number of frames that agree with each."""
    @property
    def reprojection_rms_px(self) -> NDArray[np.float64]:
        """(n,) root mean square distances from where they are seen in those, pixels."""
    @property
    def regions(self) -> list[Region]:
        """What each belongs to: `skin`, `mouth`, `eyes` or `brows`."""
    @property
    def moves(self) -> NDArray[np.bool_]:
        """(n,) whether each moves relative to the head, and was left out of the motion."""
    def __len__(self) -> int: ...

class Roughness:
    """How unsteady a motion is: median second differences over neighbouring frames."""

    @property
    def rotation_deg(self) -> float:
        """Of the rotation, degrees."""
    @property
    def translation_mm(self) -> float:
        """Of the points' centre, millimetres."""

class Report:
    """A report.json: what was done for a head, and how well."""

    @staticmethod
    def parse(text: str) -> Report:
        """Parse the text of a report.json; raises FacewrightError with what is wrong."""
    @staticmethod
    def read(path: Path) -> Report:
        """Read a report.json; raises FacewrightError with what is wrong."""
    def write(self, path: Path) -> None:
        """Write a report.json, whole or not at all."""
    def to_json(self) -> str:
        """The text of a report.json, in one line."""
    @property
    def version(self) -> str:
        """Version of Facewright."""
    @property
    def method(self) -> Method:
        """Chain of steps: `default` or `paper`."""
    @property
    def camera(self) -> Camera:
        """The camera."""
    @property
    def frames(self) -> list[ReportFrame]:
        """Every frame given."""
    @property
    def left_out(self) -> list[tuple[int, str]]:
        """How many frames were left out for each reason, in a few words each."""
    @property
    def points(self) -> int:
        """Number of measured 3D points."""
    @property
    def landmarks68(self) -> NDArray[np.float64]:
        """(68, 3) iBUG landmarks on the result, head frame, metres."""
    @property
    def scale(self) -> Scale:
        """What the size rests on."""
    @property
    def fit(self) -> FitReport:
        """How well the head fits what was seen."""
    @property
    def dense(self) -> DenseReport | None:
        """How the skin was measured densely; None where it was not, and in older files."""
    @property
    def texture(self) -> TextureReport:
        """How the texture was made."""
    @property
    def quality(self) -> Quality | None:
        """How good the head is; None in older files."""
    @property
    def timings_s(self) -> dict[str, float]:
        """Seconds per stage."""
    @property
    def warnings(self) -> list[str]:
        """What the artist should know."""

class ReportFrame:
    """What became of a frame."""

    @property
    def name(self) -> str:
        """File name without extension."""
    @property
    def used(self) -> bool:
        """Whether shape and texture were taken from it."""
    @property
    def reason(self) -> str:
        """Why, or why not."""
    @property
    def reason_kind(self) -> str | None:
        """The same as a word for programs, like `blurred`; None in files that do not tell."""
    @property
    def cam_from_head(self) -> NDArray[np.float64] | None:
        """(4, 4) pose of the head, metres; None where no face was found."""
    @property
    def reprojection_rms_px(self) -> float | None:
        """Root mean square distance of its observations from the model, pixels."""

class Scale:
    """The size of a head and what it rests on."""

    @property
    def source(self) -> str:
        """What fixed the size."""
    @property
    def relative_sigma(self) -> float:
        """Standard deviation of the size, as part of it; 0 in files that do not tell."""

class DenseReport:
    """How the skin was measured densely."""

    @property
    def measured(self) -> int:
        """Places on the skin that were measured."""
    @property
    def places(self) -> int:
        """Places on the face."""
    @property
    def sigma_mm(self) -> float | None:
        """Median standard deviation of the vertices that were measured, millimetres."""
    @property
    def moved_mm(self) -> float | None:
        """Median way that they went along their normals, millimetres."""
    @property
    def displacement_m(self) -> float | None:
        """Heights in displacement.png from black to white, metres; None where there is no such file."""
    @property
    def untouched(self) -> str | None:
        """Why the skin was left as its points give it; None where it was not."""

class FitReport:
    """How well a head fits what was seen."""

    @property
    def components(self) -> int:
        """Components of the face class that were used."""
    @property
    def coefficient_rms(self) -> float:
        """Root mean square of the class's coefficients, in its standard deviations."""
    @property
    def rigid_agreement(self) -> float:
        """Fraction of the points' observations that a single motion of the head explains, 0 to 1."""
    @property
    def points_median_mm(self) -> float:
        """Median distance of the measured points from the head's surface, millimetres."""
    @property
    def landmarks_median_px(self) -> float:
        """Median distance of the landmarks from their anchors, pixels."""
    @property
    def interocular_mm(self) -> float:
        """Distance between the eyeballs' centres, millimetres."""

class TextureReport:
    """How a texture was made."""

    @property
    def size(self) -> int:
        """Width and height, pixels."""
    @property
    def seen(self) -> float:
        """Fraction of the skin's texels that some frame saw, 0 to 1."""
    @property
    def gains(self) -> dict[str, tuple[float, float, float]]:
        """Gain of each used frame: red, green, blue."""

class Quality:
    """How good a head is."""

    @property
    def verdict(self) -> Literal["good", "warned"]:
        """`good`, or `warned` where a measure is not as over good films."""
    @property
    def measures(self) -> list[Measure]:
        """Every measure that was taken."""
    @property
    def unusual(self) -> list[Measure]:
        """The measures that good films do not have."""

class Measure:
    """One measure of a head or its film."""

    @property
    def name(self) -> str:
        """What is measured, a word."""
    @property
    def value(self) -> float:
        """How much it is."""
    @property
    def unit(self) -> str:
        """Unit of the value and of both ranges."""
    @property
    def usual(self) -> tuple[float | None, float | None]:
        """Where good films have it: low and high, None where there is no end."""
    @property
    def possible(self) -> tuple[float | None, float | None]:
        """Where a person's head can have it: low and high, None where there is no end."""
    @property
    def sentence(self) -> str:
        """What was measured, and what helps where that is unusual."""

def version() -> str:
    """Version of the library."""

def pictures_in(folder: Path) -> list[pathlib.Path]:
    """The pictures of a folder, in the order in which they are taken for frames; hidden files are none."""

def video_size(video: Path) -> tuple[int, int]:
    """Width and height of a video's frames, upright and of square pixels, as they are decoded here.

    Raises InputError where it cannot be, and SetupError where there is no ffmpeg. An interrupt is not heard: it
    takes a moment.
    """

def check_folder(folder: Path) -> None:
    """Raise OutputError when a result folder cannot be written; nothing is left behind."""

def save_board(path: Path, *, options: SheetOptions | None = None, **fields: Any) -> None:
    """Write a board to print as the SVG, PDF or PNG that the path's extension says, exact at 100 % print scale.

    `options` or further keywords are those of SheetOptions: the board, the page, the mark. Raises OptionError for a
    board that cannot be or does not fit on the page, OutputError where the file cannot be written.
    """

def calibrate(
    pictures: Sequence[Path],
    *,
    numbers: Sequence[int] | None = None,
    picture: Path | None = None,
    options: CalibrateOptions | None = None,
    **fields: Any,
) -> Job[Camera]:
    """Calibrate a camera from image files, folders or videos of a board; the job's result is a Camera.

    `numbers` are those that are used of one video or folder, ascending and counted from 0, as Blender counts them.
    `options` or further keywords are those of CalibrateOptions. The result is also drawn into `picture`, as by
    save_calibration_picture.

    Raises OptionError and OutputError at once. The job raises InputError for pictures that cannot be read,
    CameraError where the board is found in too few of them, or they do not tell the camera.
    """

def calibrate_rig(
    cameras: Sequence[tuple[str, Sequence[Path]]],
    *,
    picture: Path | None = None,
    options: CalibrateOptions | None = None,
    **fields: Any,
) -> Job[Rig]:
    """Calibrate cameras that saw one board at the same moments, and find their poses; the job's result is a Rig.

    `cameras` are (name, pictures), two or more. Pictures with the same number at the end of their names belong to
    one moment; without numbers, the k-th ones of all cameras do. `options`, `picture` and errors are those of
    calibrate; CameraError also where pictures of the cameras do not belong together.
    """

def save_calibration_picture(calibration: Camera | Rig | str, path: Path) -> None:
    """Draw a Camera or a Rig, or the text of either's file, into the SVG, PDF or PNG that the path's extension says.

    Raises OutputError where the file cannot be written, FacewrightError for a camera that does not tell of the
    boards it was calibrated from.
    """

def undistort(
    pictures: Sequence[Path],
    folder: Path,
    *,
    camera: Camera | str,
    numbers: Sequence[int] | None = None,
    options: UndistortOptions | None = None,
    **fields: Any,
) -> Job[Camera]:
    """Write image files, folders of them or videos without lens distortion into a folder, as PNG under their names.

    `camera` is a Camera, or the text of its file. The job's result is the Camera of the new pictures, which is also
    left as camera.json among them. `numbers` are those that are used of one video or folder, ascending and counted
    from 0, as Blender counts them. `options` or further keywords are those of UndistortOptions.

    Raises OutputError at once where the folder cannot be written. The job raises InputError for pictures that cannot
    be read, CameraError for the camera of another size.
    """

def match_pair(
    a: Path,
    b: Path,
    *,
    assets: Assets | Path,
    camera: Camera | str | None = None,
    picture: Path | None = None,
    options: MatchOptions | None = None,
    **fields: Any,
) -> Job[str]:
    """Match corners of the face between two frames; the job's result is the text of a matches.json, which Matches.parse
    reads.

    `a` and `b` are image files. `camera` is a Camera, or the text of its file; without it the focal length is
    estimated. Both frames with their matches are also drawn into `picture`: SVG, PDF or PNG. `options` or further
    keywords are those of MatchOptions.

    Raises OptionError, and OutputError for another kind of picture, at once. The job raises InputError for frames
    that cannot be read, SetupError without assets, CameraError for the camera of another size, FilmError where a
    face is missing or hardly a match is right.
    """

def find_faces(
    frames: Sequence[Path],
    *,
    assets: Assets | Path,
    numbers: Sequence[int] | None = None,
    camera: Camera | str | None = None,
    face: tuple[float, float] | None = None,
) -> Job[Faces]:
    """Find the face in image files, folders or videos; the job's result is Faces.

    `frames` are in the order of time, `numbers` those that are used of one video or folder, ascending and counted
    from 0, as Blender counts them. `camera` is a Camera, or the text of its file; without it the focal length is
    estimated. Of several faces, `face` is a pixel of the one to follow where the clip begins.

    The job raises InputError for frames that cannot be read, CameraError for the camera of another size, FilmError
    where no frame shows a face.
    """

def survey(
    frames: Sequence[Path],
    *,
    assets: Assets | Path,
    numbers: Sequence[int] | None = None,
    camera: Camera | str | None = None,
    face: tuple[float, float] | None = None,
) -> Job[Survey]:
    """Look at some frames of a clip, and say whether a head can be made of it; the job's result is a Survey.

    `frames`, `numbers`, `camera` and `face` are as for find_faces, but of one video, one folder, or pictures. A clip
    without a face is no error: the survey says so.

    The job raises InputError for frames that cannot be read, CameraError for the camera of another size.
    """

def check_face(pictures: Sequence[Path], *, assets: Assets | Path, frames: int) -> Job[None]:
    """Look for a face in image files, no further than the first that shows one; the job's result is None.

    `frames` is how many frames the clip has of which these pictures are some, which the error says.

    The job raises InputError for pictures that cannot be read, FilmError where none shows a face.
    """

def track(
    frames: Sequence[Path],
    *,
    assets: Assets | Path,
    numbers: Sequence[int] | None = None,
    camera: Camera | str | None = None,
    faces: Faces | str | None = None,
    options: TrackOptions | None = None,
    **fields: Any,
) -> Job[Tracks]:
    """Track points of the face through image files, folders or videos; the job's result is Tracks.

    `frames` are in the order of time, two or more, `numbers` those that are used of one video or folder, ascending
    and counted from 0, as Blender counts them. `camera` is a Camera, `faces` are those found in the same frames
    before, or the texts of their files; without a camera the focal length is estimated. `options` or further
    keywords are those of TrackOptions. Places are pixels of the picture as filmed: x right, y down, centres at
    integers.

    Raises OptionError at once. The job raises InputError for frames that cannot be read, CameraError for the camera
    of another size, TracksError for the faces of another clip, FilmError where no frame shows a face.
    """

def motion(
    tracks: Tracks | str,
    *,
    camera: Camera | str | None = None,
    options: MotionOptions | None = None,
    **fields: Any,
) -> Job[Motion]:
    """Solve for the head's pose in every frame and the positions of its points; the job's result is a Motion.

    `tracks` are Tracks, `camera` a Camera to take instead of theirs, or the texts of their files. `options` or
    further keywords are those of MotionOptions; `lengths` are (number of a track, number of another, millimetres
    between them) as measured on the head. Poses are (4, 4) cam_from_head, places are in the head frame, both in
    metres.

    Raises OptionError at once. The job raises CameraError for the camera of another size, TracksError for tracks
    that do not tell what is needed, FilmError where the head does not turn, or no motion explains its points.
    """

def motion_on_rig(films: Sequence[tuple[str, Tracks | str]], rig: Rig | str) -> Job[Motion]:
    """Solve for the motion that the first film shows; the places of the rig's cameras give its size. The job's result
    is a Motion.

    `films` are (name of a camera of the rig, Tracks of the film that it took at the same moments), two or more,
    `rig` is a Rig; the texts of their files will do.

    The job raises CameraError for a camera that the rig has not, and for films that do not show the same moments;
    else as motion does.
    """

def reconstruct(
    frames: Sequence[Path],
    *,
    assets: Assets | Path,
    numbers: Sequence[int] | None = None,
    camera: Camera | str | None = None,
    faces: Faces | str | None = None,
    tracks: Tracks | str | None = None,
    motion: Motion | str | None = None,
    options: ReconstructOptions | None = None,
    **fields: Any,
) -> Job[Reconstruction]:
    """Reconstruct the head in image files, folders or videos; the job's result is a Reconstruction.

    `frames` are in the order of time, two or more, `numbers` those that are used of one video or folder, ascending
    and counted from 0, as Blender counts them. `camera`, `faces`, `tracks` and `motion` of the same frames, or the
    texts of their files: what is given is not found anew. `options` or further keywords are those of
    ReconstructOptions. Nothing is written: Reconstruction.write does.

    Raises OptionError at once. The job raises InputError for frames that cannot be read, CameraError for the camera
    of another size, TracksError for what belongs to another clip, FilmError where the head does not turn or hardly a
    frame is sharp, uncovered and quiet.
    """

def reconstruct_on_rig(
    films: Sequence[tuple[str, Sequence[Path]]],
    rig: Rig | str,
    *,
    assets: Assets | Path,
    options: ReconstructOptions | None = None,
    **fields: Any,
) -> Job[Reconstruction]:
    """Reconstruct the head that a rig's cameras filmed at the same moments, or took one photograph each of; the job's
    result is a Reconstruction in true size.

    `films` are (name of a camera of the rig, its image files, folders or videos), two or more with as many frames
    each; `rig` is a Rig, or the text of its file. `options` or further keywords are those of ReconstructOptions,
    whose method and size are the rig's own here.

    Raises OptionError at once. The job raises CameraError for a camera that the rig has not, for films of different
    lengths and for cameras that see the head from one direction; else as reconstruct does.
    """

def overlay(result: Path, frames: Sequence[Path], folder: Path) -> Job[list[str]]:
    """Draw the head of a result folder over its frames, into PNG of the frames' names; the job's result is the names of
    the frames drawn.

    `result` is a folder that Reconstruction.write has left, `frames` are the image files, folders or videos that it
    was made from, `folder` is where the pictures go.

    Raises OutputError at once where that cannot be written. The job raises InputError where `result` holds no
    result.
    """

def overlay_on_rig(result: Path, films: Sequence[tuple[str, Sequence[Path]]], folder: Path) -> Job[list[str]]:
    """Draw the head that a rig filmed over the frames of its cameras, into PNG of the report's names, like left_0012;
    the job's result is those names.

    `films` are given as for reconstruct_on_rig, `result` and `folder` as for overlay, whose errors these are;
    CameraError for a camera that the result does not know.
    """

def generic_head(assets: Assets | Path) -> Reconstruction:
    """The generic head itself, with its own keys and a plain texture; its report is empty.

    `assets` is a folder, or a handle; the nets are not needed. Raises SetupError where the head is missing.
    """

def parse_command(arguments: Sequence[str], *, program: str = "facewright") -> Command:
    """Parse a command line of the `facewright` program, without its name, and run nothing.

    `program` is its name in help and errors. Raises UsageError if it cannot be parsed, or if help is asked for.
    """

def run(arguments: Sequence[str], *, program: str = "facewright") -> int:
    """Run a command line of the `facewright` program, print what it prints, and return the exit code.

    `program` is its name in help and errors. An interrupt cancels the work.
    """
