"""Frames of a video: the library decodes them with an `ffmpeg`, or else Blender's own sequencer does.

Either way they have the names of `frame_name` and are the same pictures. The artist's scene is not touched.
"""

import ctypes
import math
import mmap
import os
import struct
import sys
import tempfile
import time
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import bpy

from ..engine import FacewrightError, Job, Progress, check_face, video_size

# Of a scene: that it is there for decoding only.
DECODES = "facewright_decodes"
# Part of a bar that decoding here takes, before the library's work on the frames.
DECODING = 0.15
# Time that decoding here takes before others have their turn: Esc must not wait longer.
STEP_SECONDS = 0.05
# As the library does it, a face is sought in so many frames at least, and at least in every so many …
LOOKS, FARTHEST = 64, 12
# … of which so many are looked at together.
TOGETHER = 16
# The number of a process's standard output.
OUTPUT = 1
# Videos made of boxes, which tell the shape of a pixel.
BOXED = {".mp4", ".mov", ".m4v", ".3gp"}
VIDEOS = {
    *{".mp4", ".mov", ".avi", ".mkv", ".webm", ".m4v", ".mpg", ".mpeg"},
    *{".ogv", ".mts", ".m2ts", ".ts", ".wmv", ".3gp", ".flv", ".gif"},
}


def is_video(path: str) -> bool:
    """Whether a path is a video by its extension: a folder of such a name is a folder."""
    return Path(path).suffix.lower() in VIDEOS and not Path(path).is_dir()


def frame_count(path: str) -> int:
    """Number of frames of a video; 0 when it cannot be read."""
    clip = bpy.data.movieclips.load(path)
    try:
        return clip.frame_duration if clip.size[0] > 0 else 0
    finally:
        bpy.data.movieclips.remove(clip)


def square_size(path: str, size: tuple[int, int]) -> tuple[int, int]:
    """The size of a video's frames once their pixels are square."""
    return round(size[0] * pixel_aspect(path)), size[1]


def pixel_aspect(path: str) -> float:
    """Width of a video's pixels against their height, as MP4 and MOV tell it; Blender does not ask."""
    if Path(path).suffix.lower() not in BOXED or Path(path).stat().st_size == 0:
        return 1.0
    with open(path, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        # The box `pasp`: its length, its name, horizontal and vertical spacing.
        at = content.find(b"\0\0\0\x10pasp")
        wide, high = struct.unpack(">II", content[at + 8 : at + 16]) if 0 <= at <= len(content) - 16 else (1, 1)
    return wide / high if wide and high else 1.0


def frame_name(number: int) -> str:
    """Name of a frame by its number in the clip, counted from 0."""
    return f"frame_{number:06d}"


T = TypeVar("T")


@dataclass(frozen=True)
class Frames:
    """Frames as the library takes them: the numbers of those of a video, or files, which are gone when it is closed."""

    paths: list[str]
    numbers: list[int] | None = None
    folder: tempfile.TemporaryDirectory[str] | None = None

    def __enter__(self) -> "Frames":
        return self

    def __exit__(self, *_error: object) -> None:
        if self.folder is not None:
            self.folder.cleanup()

    def behind(self, work: Generator[Progress, None, T]) -> Generator[Progress, None, T]:
        """The library's work on the frames, in what decoding them here has left of the bar."""
        begin = 0.0 if self.folder is None else DECODING
        try:
            while True:
                progress = next(work)
                yield progress._replace(fraction=begin + (1.0 - begin) * progress.fraction)
        except StopIteration as end:
            return end.value
        finally:
            work.close()


def opened(path: str, numbers: Iterable[int], of_face: bool = False) -> Generator[Progress, None, Frames]:
    """Frames of a video for the library, which decodes them itself where it can; else they are decoded here.

    Those that are to show a face are refused, as soon as it is known, where none does.
    """
    if is_decoded_by_library(path):
        return Frames([path], list(numbers))
    folder = yield from decode(path, numbers, of_face)
    return Frames([str(file) for file in sorted(Path(folder.name).iterdir())], folder=folder)


def is_decoded_by_library(path: str) -> bool:
    """Whether there is an ffmpeg that shows a video as Blender does: turned alike, its pixels of the same shape."""
    clip = bpy.data.movieclips.load(path)
    try:
        return video_size(path) == square_size(path, (clip.size[0], clip.size[1]))
    except FacewrightError:
        return False
    finally:
        bpy.data.movieclips.remove(clip)


def decode(
    path: str, numbers: Iterable[int], of_face: bool = False
) -> Generator[Progress, None, tempfile.TemporaryDirectory[str]]:
    """Write frames of a video as pictures into a temporary folder; each step of the generator takes a moment."""
    folder = tempfile.TemporaryDirectory(prefix="facewright-")
    try:
        wanted, until = list(numbers), 0.0
        done = 0
        for number in _order(wanted, Path(folder.name), of_face):
            if number is None or time.monotonic() >= until:
                yield Progress("decode", DECODING * done / len(wanted))
                until = time.monotonic() + STEP_SECONDS
            if number is not None:
                # An artist who undoes something meanwhile undoes the scene too.
                scene = next(iter(_scenes()), None) or _set_up(path)
                with _quiet():
                    _write(scene, number, Path(folder.name))
                done += 1
        return folder
    except BaseException:
        folder.cleanup()
        raise
    finally:
        forget()


def forget() -> None:
    """Remove the scenes that videos are decoded in: of work that ends, or as undo or a saved file brought them back."""
    for scene in _scenes():
        # Blender keeps the last one.
        if len(bpy.data.scenes) > 1:
            bpy.data.scenes.remove(scene)


def _scenes() -> list[bpy.types.Scene]:
    return [scene for scene in bpy.data.scenes if scene.get(DECODES) and scene.library is None]


def _order(wanted: list[int], folder: Path, of_face: bool) -> Iterator[int | None]:
    """The order in which frames are decoded: those in which a face is sought first. None while there is a wait."""
    if of_face:
        yield from _sought(wanted, folder)
    yield from (number for number in wanted if not _picture(folder, number).exists())


def _sought(wanted: list[int], folder: Path) -> Iterator[int | None]:
    """Frames as far as to the first that shows a face; the library looks at some while the next ones are decoded."""
    between = min(math.ceil(len(wanted) / LOOKS), FARTHEST)
    some, looking = wanted[:: math.ceil(between / 2)], None
    for begin in range(0, len(some), TOGETHER):
        together = some[begin : begin + TOGETHER]
        yield from together
        if looking is not None and (yield from _shows_face(looking)):
            return
        looking = check_face([str(_picture(folder, number)) for number in together], len(wanted))
    if looking is not None:
        yield from _shows_face(looking, is_last=True)


def _shows_face(looking: Job[None], is_last: bool = False) -> Generator[None, None, bool]:
    """What came of a look, once it has ended; the last one without a face is the end of the work."""
    while not looking.finished():
        yield None
    try:
        looking.result()
    except FacewrightError as error:
        if is_last or error.kind != "no_face":
            raise
        return False
    return True


def _picture(folder: Path, number: int) -> Path:
    return folder / f"{frame_name(number)}.bmp"


def _write(scene: bpy.types.Scene, number: int, folder: Path) -> None:
    """Render one frame. As an animation of one frame: a still of a scene that is in no window shows a stale frame."""
    scene.frame_start = scene.frame_end = number + 1
    scene.render.filepath = str(folder / "scene_######")
    bpy.ops.render.render(animation=True, scene=scene.name)
    (folder / f"scene_{number + 1:06d}.bmp").rename(_picture(folder, number))


@contextmanager
def _quiet() -> Iterator[None]:
    """Nothing is printed: Blender tells of every file that it renders, on the process's own output."""
    try:
        kept = os.dup(OUTPUT)
    except OSError:
        # A Blender that was started without a console has none.
        yield
        return
    _flush()
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, OUTPUT)
        yield
    finally:
        _flush()
        os.dup2(kept, OUTPUT)
        os.close(nowhere)
        os.close(kept)


def _flush() -> None:
    """Write what Python and C have kept back until now."""
    print(end="", flush=True)
    ctypes.CDLL("ucrtbase" if sys.platform == "win32" else None).fflush(None)


def _set_up(path: str) -> bpy.types.Scene:
    """A scene that shows a video."""
    scene = bpy.data.scenes.new("Facewright decoding")
    scene[DECODES] = True
    editor = scene.sequence_editor_create()
    # Blender 5.0 renamed the collection; an empty one is falsy, so it must not be asked for its truth.
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences
    strip = strips.new_movie("clip", path, 1, 1)
    element = strip.elements[0]
    render = scene.render
    size = (element.orig_width, element.orig_height)
    render.resolution_x, render.resolution_y = square_size(path, size)
    strip.transform.scale_x *= render.resolution_x / size[0]
    render.resolution_percentage = 100
    render.use_sequencer, render.use_compositing = True, False
    # What takes least time to write.
    render.image_settings.file_format = "BMP"
    render.image_settings.color_mode = "RGB"
    scene.view_settings.view_transform = "Standard"
    scene.sequencer_colorspace_settings.name = "sRGB"
    return scene
