"""Clips that were looked at, kept in memory and in no file: what was found, and the frames of it that are shown."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, TypeVar

from ..engine import Survey, SurveyedFrame
from .source import Source
from .thumbnails import Fate, Thumbnails

# So many frames are shown of those that were looked at.
SHOWN = 15
# Clips that are kept, of those that were looked at last.
KEPT = 4

# A clip, by its absolute path and the pictures that were chosen of a folder.
Key = tuple[str, tuple[str, ...]]
T = TypeVar("T")


@dataclass
class Strip:
    """A clip that was looked at: its survey, and the frames of it that are shown."""

    survey: Survey
    # The clip's numbers of the frames that were looked at, where the survey counts others.
    numbers: list[int] | None = None
    thumbnails: Thumbnails = field(default_factory=Thumbnails)
    checked: dict[Any, Survey] = field(default_factory=dict)

    def __post_init__(self) -> None:
        # Each native look has its picture with it.
        self.looks = self.survey.looks

    def number(self, look: SurveyedFrame) -> int:
        """The clip's number of a frame that was looked at."""
        return self.numbers[look.number] if self.numbers is not None else look.number

    def shown(self) -> list[SurveyedFrame]:
        """Frames spread over those that were looked at, with the first and the last."""
        return spread(self.looks, SHOWN)

    def stretch(self, number: int) -> tuple[int, int]:
        """The frames that a shown one stands for: up to the middle between it and its neighbours."""
        shown = [self.number(look) for look in self.shown()]
        place = shown.index(number)
        before = shown[place - 1] if place > 0 else None
        after = shown[place + 1] if place + 1 < len(shown) else None
        first = number if before is None else (before + number) // 2 + 1
        last = number if after is None else (number + after) // 2
        return first, last

    def part(self, frames: Source) -> Survey:
        """What those of the frames show that are used."""
        key = (frames.span, frames.left_out)
        if key not in self.checked:
            wanted = {look.number for look in self.looks if frames.is_used(self.number(look))}
            self.checked = {key: self.survey.part(wanted)}
        return self.checked[key]


_strips: dict[Key, Strip] = {}


def of(key: Key) -> Strip | None:
    """A clip as it was looked at, if it was."""
    return _strips.get(key)


def keep(key: Key, strip: Strip) -> None:
    """Show what was found of a clip from now on."""
    forget([key])
    forget(list(_strips)[: max(len(_strips) + 1 - KEPT, 0)])
    _strips[key] = strip


def forget(keys: Iterable[Key] | None = None) -> None:
    """Let go of what was found; of all where none is named."""
    for key in list(_strips if keys is None else keys):
        if key in _strips:
            _strips.pop(key).thumbnails.close()


def spread(some: list[T], count: int) -> list[T]:
    """So many of some at most, with the first and the last."""
    count = min(count, len(some))
    return [some[round(k * (len(some) - 1) / max(count - 1, 1))] for k in range(count)]


def icon(strip: Strip, look: SurveyedFrame, fate: Fate) -> int:
    """The picture of a frame as an icon."""
    width, height = strip.survey.size
    left, top, wide, high = look.rectangle or (0, 0, width, height)
    middle = ((left + wide / 2) / width, (top + high / 2) / height)
    return strip.thumbnails.icon(strip.number(look), fate, lambda: look.thumbnail, middle)


def fate_of(frames: Source, strip: Strip, look: SurveyedFrame) -> Fate:
    """What becomes of a frame that was looked at."""
    if not frames.is_used(strip.number(look)):
        return Fate.LEFT_OUT
    return Fate.USED if look.usable else Fate.UNUSABLE
