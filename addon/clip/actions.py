"""What the buttons around the choice of a clip do."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bpy

from ..engine import FacewrightError, pictures_in, survey
from ..jobs import POLL_SECONDS, Work, watch
from ..scene import footage, recent_clips, source, strips, video, view
from ..scene.source import Source, source_of
from ..scene.strips import Key, Strip
from ..words import say

# So many frames are looked at where Blender itself decodes them, which takes a second.
DECODED_HERE = 16
NOT_SHOWN = "this frame is not shown: look at the clip again"
# The clip that is being looked at unasked.
_looking: list[Key] = []


def readable(settings: Any) -> bool:
    """Whether what a scene says of the frames left out can be read; where not, the clip's length line says so."""
    try:
        source_of(settings)
    except FacewrightError:
        return False
    return True


def strip_of(settings: Any) -> Strip | None:
    """The chosen clip as it was looked at, if it was."""
    return strips.of(_key(settings))


def is_looking(settings: Any) -> bool:
    """Whether the chosen clip is being looked at unasked."""
    return _key(settings) in _looking


def _key(settings: Any) -> Key:
    return bpy.path.abspath(settings.path), tuple(picture.name for picture in settings.pictures)


def surveyed(frames: Source, camera: str | None) -> Work[Strip]:
    """Look at frames spread over a clip, or over its part alone where that is given."""
    if source.length(frames) == 0:
        raise FacewrightError("no frames there: choose a video, or a folder of pictures")
    return _surveyed(frames, camera)


def _surveyed(frames: Source, camera: str | None) -> Work[Strip]:
    if not video.is_video(frames.path):
        numbers = [number for number in range(source.length(frames)) if frames.is_used(number)]
        return Strip((yield from watch(survey(source.images(frames), camera=camera))), numbers)
    numbers = source.numbers(frames)
    if video.is_decoded_by_library(frames.path):
        return Strip((yield from watch(survey([frames.path], numbers=numbers, camera=camera))))
    some = strips.spread(numbers, DECODED_HERE)
    with (yield from video.opened(frames.path, some)) as decoded:
        return Strip((yield from decoded.behind(watch(survey(decoded.paths, camera=camera)))), some)


def keep(frames: Source, strip: Strip) -> None:
    """Show what was found of a clip from now on."""
    strips.keep((frames.path, frames.pictures), strip)


def look_soon(settings: Any) -> None:
    """Look at the chosen clip while the artist does other things, where the library alone can, and nobody did before.

    Nothing is changed but what the panels show; what cannot be looked at is left to the button, which says why.
    """
    frames = Source(bpy.path.abspath(settings.path), None, tuple(picture.name for picture in settings.pictures))
    key = (frames.path, frames.pictures)
    if bpy.app.background or settings.frames < 1 or strips.of(key) is not None:
        return
    is_film = video.is_video(frames.path)
    if is_film and not video.is_decoded_by_library(frames.path):
        return
    _looking[:] = [key]
    camera = settings.id_data.facewright_camera.text or None
    steps = _looks(frames, camera, key)
    bpy.app.timers.register(lambda: next(steps, None), first_interval=0.0, persistent=True)


def _looks(frames: Source, camera: str | None, key: Key) -> Iterator[float]:
    """Work that goes on as long as its clip is the one that was chosen last; yields how long it may wait."""
    work = _surveyed(frames, camera)
    try:
        while _looking == [key]:
            next(work)
            yield POLL_SECONDS
    except StopIteration as end:
        keep(frames, end.value)
    except FacewrightError:
        # Nobody has asked: the button that asks says what is wrong.
        pass
    finally:
        work.close()
        if _looking == [key]:
            _looking.clear()
        view.redraw()


def stop_looking() -> None:
    """End what goes on unasked, and let go of all that was found."""
    _looking.clear()
    strips.forget()


def about(settings: Any, number: int) -> str:
    """What is known of a frame that is shown, in a sentence."""
    strip = strip_of(settings)
    look = next((look for look in strip.looks if strip.number(look) == number), None) if strip else None
    if strip is None or look is None:
        return ""
    left_out = not source_of(settings).is_used(number)
    text = "Frame {number}: {what}, left out" if left_out else "Frame {number}: {what}"
    return say(text, number=shown_number(settings, number), what=look.reason)


def movie_clip(settings: Any) -> bpy.types.MovieClip | None:
    """The movie clip that shows the chosen file, which has its own place in the timeline; none of chosen pictures."""
    if settings.pictures:
        return None
    path = bpy.path.abspath(settings.path)
    return next((clip for clip in bpy.data.movieclips if path and footage.shows(clip, path)), None)


def shown_number(settings: Any, number: int) -> int:
    """A frame as it is counted for the artist: by the timeline where a movie clip has the file, else from 0."""
    clip = movie_clip(settings)
    return number if clip is None else footage.scene_frame(clip, number - clip.frame_offset + 1)


def number_at(settings: Any, timeline: int) -> int:
    """The clip's frame at a frame of the timeline, within the clip."""
    clip = movie_clip(settings)
    number = timeline if clip is None else footage.clip_frame(clip, timeline) + clip.frame_offset - 1
    return min(max(number, 0), last_of(settings))


def last_of(settings: Any) -> int:
    """The number of the clip's last frame."""
    # Files of older versions did not count.
    count = settings.frames if settings.frames >= 0 else source.length(source_of(settings))
    return max(count - 1, 0)


def set_ends(settings: Any, first: int | None = None, last: int | None = None) -> str:
    """Use a part of the clip from a frame, or up to one; the other end gives way. Gives the message."""
    if not settings.use_range:
        settings.first, settings.last, settings.use_range = 0, last_of(settings), True
    if first is not None:
        settings.first = first
        settings.last = max(settings.last, last if last is not None else first)
    if last is not None:
        settings.last = last
        settings.first = min(settings.first, last)
    ends = [shown_number(settings, number) for number in (settings.first, settings.last)]
    return say("frames {first} to {last}", first=ends[0], last=ends[1])


def set_shown(settings: Any, **ends: int) -> None:
    """The same with ends as the artist counts."""
    set_ends(settings, **{name: number_at(settings, number) for name, number in ends.items()})


def from_timeline(scene: Any, which: str) -> str:
    """Take the present frame as first or last one, or both ends of the preview range, else of the scene's."""
    settings = scene.facewright_clip
    if which == "FIRST":
        return set_ends(settings, first=number_at(settings, scene.frame_current))
    if which == "LAST":
        return set_ends(settings, last=number_at(settings, scene.frame_current))
    preview = scene.use_preview_range
    first = scene.frame_preview_start if preview else scene.frame_start
    last = scene.frame_preview_end if preview else scene.frame_end
    first, last = (number_at(settings, frame) for frame in (first, last))
    if first >= last:
        raise FacewrightError("the timeline shows no two frames of the clip")
    return set_ends(settings, first, last)


def pick(settings: Any, number: int) -> str:
    """Do with a frame what a click is set to do; gives the message."""
    if number > last_of(settings):
        # Frames that are shown may have been deleted since.
        raise FacewrightError(NOT_SHOWN)
    if settings.click == "OUT":
        return toggle(settings, number)
    return set_ends(settings, **{settings.click.lower(): number})


def toggle(settings: Any, number: int) -> str:
    """Leave out the stretch that a shown frame stands for, or take it in again; gives the message."""
    strip = strip_of(settings)
    if strip is None or number not in [strip.number(look) for look in strip.shown()]:
        raise FacewrightError(NOT_SHOWN)
    first, last = strip.stretch(number)
    return leave_out(settings, first, last, not source.within(number, source.spans(settings.left_out)))


def leave_out(settings: Any, first: int, last: int, is_out: bool = True) -> str:
    """Leave out a stretch of frames, or take it in again; gives the message."""
    before = source.overlap(source.spans(settings.left_out), 0, last_of(settings))
    stretch = set(range(first, last + 1))
    settings.left_out = source.text_of(before | stretch if is_out else before - stretch)
    ends = sorted({shown_number(settings, number) for number in (first, last)})
    if len(ends) > 1:
        text = "frames {first} to {last} left out" if is_out else "frames {first} to {last} used again"
    else:
        text = "frame {first} left out" if is_out else "frame {first} used again"
    return say(text, first=ends[0], last=ends[-1])


def choose(settings: Any, folder: str, names: list[str], is_relative: bool = False) -> str:
    """Choose a video, a picture with the others of its folder, or some pictures and no others; gives the message."""
    films = [name for name in names if video.is_video(str(Path(folder) / name))]
    if films and len(names) > 1:
        raise FacewrightError("choose one video, or pictures of one folder")
    pictures = {Path(picture).name for picture in pictures_in(folder)}
    if others := sorted(set(names) - pictures - set(films)):
        raise FacewrightError(f"{others[0]} is no video and no picture: PNG, JPEG, TIFF, BMP or WebP")
    names = sorted(names)
    path = str(Path(folder) / names[0]) if names else folder
    settings.path = bpy.path.relpath(path) if is_relative and bpy.data.filepath else path
    if len(names) > 1:
        choose_pictures(settings, names)
    recent_clips.remember(path, tuple(names) if len(names) > 1 else ())
    return say("{clip}: {count} frames", clip=Path(path).name, count=settings.frames)


def choose_pictures(settings: Any, names: list[str]) -> None:
    """Use these pictures of the clip's folder, in the order in which the folder has them, and no others."""
    frames = Source(bpy.path.abspath(settings.path))
    order = [name for name in (Path(picture).name for picture in source.pictures(frames)) if name in names]
    settings.pictures.clear()
    for name in order:
        settings.pictures.add().name = name
    settings.frames = len(order)
    settings.first, settings.last = 0, max(len(order) - 1, 0)
    look_soon(settings)


def choose_recent(settings: Any, number: int) -> str:
    """Choose one of the clips that were chosen last."""
    clips = recent_clips.recent()
    if number >= len(clips):
        raise FacewrightError("this clip is no longer there")
    path, names = clips[number]
    place = Path(path)
    if place.is_dir():
        return choose(settings, path, [])
    return choose(settings, str(place.parent), list(names) or [place.name])


def recent() -> list[str]:
    """Labels of the clips that were chosen last."""
    return [_label(Path(path), names) for path, names in recent_clips.recent()]


def _label(path: Path, names: tuple[str, ...]) -> str:
    clip = f"{path.parent.name}/{path.name}"
    return say("{clip} and {count} more", clip=clip, count=len(names) - 1) if names else clip
