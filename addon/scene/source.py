"""What a head is made from: a clip, the part of it that is used, and what the artist left out."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import bpy

from ..engine import FacewrightError, pictures_in
from . import video

T = TypeVar("T")
# First and last frame of a stretch.
Span = tuple[int, int]


@dataclass(frozen=True)
class Source:
    """The frames of a clip: an absolute path, and the first and last frame to use (None: all).

    Of a folder the `pictures` with these names, if any are named, and no others. Frames of `left_out` stretches are not
    used. Frames are counted from 0.
    """

    path: str
    span: Span | None = None
    pictures: tuple[str, ...] = ()
    left_out: tuple[Span, ...] = ()

    def is_used(self, number: int) -> bool:
        """Whether a frame of the clip is used."""
        first, last = self.span or (0, number)
        return first <= number <= last and not within(number, self.left_out)


def source_of(settings: Any) -> Source:
    """The frames that the panel says."""
    span = (settings.first, settings.last) if settings.use_range else None
    names = tuple(picture.name for picture in settings.pictures)
    return Source(bpy.path.abspath(settings.path), span, names, spans(settings.left_out))


def within(number: int, spans: Iterable[Span]) -> bool:
    """Whether a frame lies in one of some stretches."""
    return any(first <= number <= last for first, last in spans)


def numbers(source: Source) -> list[int]:
    """The numbers of a video's frames that are used."""
    count = video.frame_count(source.path)
    if count == 0:
        raise FacewrightError(f"{source.path} cannot be read as a video")
    if source.span is not None and source.span[0] >= count:
        first = source.span[0]
        raise FacewrightError(f"the clip has {count} frames, counted from 0: frame {first} is beyond its end")
    return _some([number for number in range(count) if source.is_used(number)])


def images(source: Source) -> list[str]:
    """The files of a folder's pictures that are used."""
    return _some([picture for number, picture in enumerate(pictures(source)) if source.is_used(number)])


def pictures(source: Source) -> list[str]:
    """All pictures of a clip that is no video, used or not."""
    path = Path(source.path)
    folder = path if path.is_dir() else path.parent
    if source.pictures:
        return [str(folder / name) for name in source.pictures]
    found = [str(picture) for picture in pictures_in(folder)]
    if not found:
        raise FacewrightError(f"{folder} holds no frames: PNG, JPEG, TIFF, BMP or WebP")
    return found


def length(source: Source) -> int:
    """Number of a clip's frames, used or not; 0 for what is none."""
    if not source.path or not Path(source.path).exists():
        return 0
    if video.is_video(source.path):
        return video.frame_count(source.path)
    try:
        return len(pictures(source))
    except FacewrightError:
        return 0


def spans(text: str) -> tuple[Span, ...]:
    """Stretches as a scene stores them: `12-40,77`."""
    found = []
    for part in filter(None, text.replace(" ", "").split(",")):
        first, _, last = part.partition("-")
        if not (first.isdigit() and (last or first).isdigit()):
            raise FacewrightError(f"frames left out are numbers and stretches like 12-40,77, not {part}")
        found.append((int(first), int(last or first)))
    return tuple(found)


def overlap(left_out: Iterable[Span], first: int, last: int) -> set[int]:
    """The frames of some stretches that lie between two others."""
    return {n for begin, end in left_out for n in range(max(begin, first), min(end, last) + 1)}


def text_of(left_out: Iterable[int]) -> str:
    """Frames as such a text."""
    found: list[list[int]] = []
    for number in sorted(left_out):
        if found and number == found[-1][1] + 1:
            found[-1][1] = number
        else:
            found.append([number, number])
    return ",".join(f"{first}-{last}" if last > first else str(first) for first, last in found)


def _some(frames: list[T]) -> list[T]:
    if not frames:
        raise FacewrightError("every frame is left out: take some of them in again")
    return frames
