"""Frames of a movie clip: what they are called in a tracks.json, and how the clip's markers count them.

A clip's own frames count from 1 and show the file from its frame offset on; the timeline is `frame_start` − 1 ahead.
"""

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..engine import FacewrightError, pictures_in
from . import video

PICTURES = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp"}
NUMBERED = re.compile(r"^(.*?)(\d+)(\D*)$")


@dataclass(frozen=True)
class Shown:
    """A frame: its name, its number in the clip, and in the file or the sequence, counted from 0."""

    name: str
    clip_frame: int
    index: int


@dataclass(frozen=True)
class Footage:
    """What a movie clip shows, its size in square pixels.

    `images` are the files of a sequence by the index, None for a video.
    """

    clip: str
    path: str
    size: tuple[int, int]
    frames: tuple[Shown, ...]
    images: dict[int, str] | None

    def part(self, first: int, last: int) -> "Footage":
        """Only the clip's frames from the first to the last."""
        if last < first:
            raise FacewrightError("the last frame must come after the first")
        frames = tuple(frame for frame in self.frames if first <= frame.clip_frame <= last)
        if not frames:
            raise FacewrightError(f"{self.clip} has no frames from {first} to {last}")
        return replace(self, frames=frames)

    def clip_frames(self, names: Sequence[str], size: tuple[int, int], what: str) -> NDArray[np.int64]:
        """The clip's numbers of named frames; of other names, by order. `what` has them: a plural, for complaints."""
        if size != self.size:
            (width, height), (w, h) = size, self.size
            raise FacewrightError(
                f"{what} were made at {width} × {height}, but {self.clip} is {w} × {h}: they are of another clip"
            )
        known = {frame.name: frame.clip_frame for frame in self.frames}
        if all(name in known for name in names):
            return np.array([known[name] for name in names], np.int64)
        if len(names) != len(self.frames):
            counted = f"{what} have {len(names)} frames, {self.clip} has {len(self.frames)}"
            raise FacewrightError(f"{counted} with other names: they are of another clip")
        return np.array([frame.clip_frame for frame in self.frames], np.int64)


def of_clip(clip: bpy.types.MovieClip) -> Footage:
    """The frames of a clip, whose file must be there."""
    path = Path(bpy.path.abspath(clip.filepath))
    if not path.exists():
        raise FacewrightError(f"the file of {clip.name} does not exist: choose it again in the Clip editor")
    width, height = clip.size
    if width == 0 or clip.frame_duration == 0:
        raise FacewrightError(f"{clip.name} cannot be read as a video or a picture")
    if clip.source == "SEQUENCE":
        images = {index: file for index, file in _images(path).items() if index >= clip.frame_offset}
        names = {index: Path(file).stem for index, file in images.items()}
    else:
        images = None
        indices = range(clip.frame_offset, clip.frame_offset + clip.frame_duration)
        names = {index: video.frame_name(index) for index in indices if 0 <= index < clip.frame_duration}
    frames = (Shown(name, index - clip.frame_offset + 1, index) for index, name in names.items())
    return Footage(clip.name, str(path), clip_size(clip), tuple(frames), images)


def _images(path: Path) -> dict[int, str]:
    """The pictures of a clip that shows a first one, by their index in it.

    Blender counts a sequence's pictures up to its first gap; here all that are numbered alike count, gaps left out. A
    picture without such others begins its whole folder, in natural order.
    """
    pictures = pictures_in(path.parent)
    if path not in pictures:
        return {0: str(path)}
    first = NUMBERED.match(path.stem)
    numbered = [(digits, file) for file in pictures if (digits := NUMBERED.match(Path(file).stem))]
    alike = [
        (int(digits[2]) - int(first[2]), str(file))
        for digits, file in numbered
        if first and (digits[1], digits[3]) == (first[1], first[3])
    ]
    images = dict(alike)
    if len(alike) < 2 or len(images) < len(alike):
        return {index: str(file) for index, file in enumerate(pictures)}
    return images


def clip_size(clip: bpy.types.MovieClip) -> tuple[int, int]:
    """Width and height of a clip in square pixels."""
    size = (clip.size[0], clip.size[1])
    path = bpy.path.abspath(clip.filepath)
    return size if clip.source == "SEQUENCE" or not Path(path).exists() else video.square_size(path, size)


def clip_files(clip: bpy.types.MovieClip) -> list[str]:
    """A movie clip's video, or the images of its sequence, as absolute paths."""
    first = Path(bpy.path.abspath(clip.filepath))
    return list(_images(first).values()) if clip.source == "SEQUENCE" and first.exists() else [str(first)]


def load(path: str) -> bpy.types.MovieClip:
    """A new clip of a video, a folder of frames, or a frame of an image sequence."""
    place = Path(path)
    if not place.exists():
        raise FacewrightError(f"{path} does not exist: choose the clip again")
    if place.is_dir():
        images = pictures_in(place)
        if not images:
            raise FacewrightError(f"{path} holds no frames: PNG, JPEG, TIFF, BMP or WebP")
        place = images[0]
    return bpy.data.movieclips.load(str(place))


def shows(clip: bpy.types.MovieClip, path: str) -> bool:
    """Whether a clip shows a video, a folder of frames, or the sequence that an image belongs to."""
    mine, other = (Path(os.path.normpath(place)) for place in (bpy.path.abspath(clip.filepath), path))
    if clip.source == "SEQUENCE" and not video.is_video(path):
        return mine.parent == (other if other.is_dir() else other.parent)
    return mine == other


def clip_frame(clip: bpy.types.MovieClip, scene_frame: int) -> int:
    """The clip's frame that the timeline shows."""
    return scene_frame - clip.frame_start + 1


def scene_frame(clip: bpy.types.MovieClip | None, clip_frame: int) -> int:
    """The frame of the timeline that shows a frame of the clip."""
    return clip_frame + (clip.frame_start if clip is not None else 1) - 1
