"""Tracks of a movie clip <-> arrays; pixels are converted here only.

A marker's place is in parts of the picture from the outer corner of its lower left pixel; the library counts pixels
right and down from the centre of the upper left one.
"""

from dataclasses import dataclass
from zlib import crc32

import bpy
import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]
Frames = NDArray[np.int64]
Size = tuple[int, int]

# Where Blender's tracker looks for a pattern, in sides of the pattern; as its own default.
SEARCH = 3.4


@dataclass(frozen=True, eq=False)
class Markers:
    """Markers of a track: the clip's frames, ascending, and (n, 2) pixels; `keyed` were set and not tracked."""

    frames: Frames
    points: Points
    enabled: NDArray[np.bool_]
    keyed: NDArray[np.bool_]


@dataclass(frozen=True)
class Look:
    """How a track is shown and weighed: the frame that is keyed, the pattern's side in pixels."""

    key_frame: int
    pattern_px: float
    color: tuple[float, float, float]
    weight: float


def to_clip(points: Points, size: Size) -> Points:
    """(n, 2) pixels as places of markers."""
    u, v = points.T
    return np.stack([(u + 0.5) / size[0], 1.0 - (v + 0.5) / size[1]], axis=-1)


def to_pixels(places: NDArray[np.float32], size: Size) -> Points:
    """(n, 2) places of markers in pixels."""
    x, y = places.astype(np.float64).T
    return np.stack([x * size[0] - 0.5, (1.0 - y) * size[1] - 0.5], axis=-1)


def write(
    face: bpy.types.MovieTrackingObject, name: str, frames: Frames, points: Points, look: Look, size: Size, last: int
) -> bpy.types.MovieTrackingTrack:
    """A new track with markers in the frames given; disabled ones of the clip's frames 1 to `last` end each run."""
    numbers, places, mute = _with_ends(frames, to_clip(points, size), last)
    track = face.tracks.new(name=name, frame=int(numbers[0]))
    half = 0.5 * look.pattern_px / np.array(size)
    # Markers that are inserted take the pattern, but not the search area, of the first.
    track.markers[0].pattern_corners = half * [[-1, -1], [1, -1], [1, 1], [-1, 1]]
    insert = track.markers.insert_frame
    for number in numbers[1:].tolist():
        insert(number)
    keyed = mute | (numbers == look.key_frame)
    track.markers.foreach_set("co", places.astype(np.float32).ravel())
    track.markers.foreach_set("mute", mute)
    track.markers.foreach_set("is_keyed", keyed)
    search = np.tile((SEARCH * half).astype(np.float32), len(numbers))
    track.markers.foreach_set("search_min", -search)
    track.markers.foreach_set("search_max", search)
    track.use_custom_color, track.color = True, look.color
    track.weight = look.weight
    track.select = False
    return track


def _with_ends(frames: Frames, places: Points, last: int) -> tuple[Frames, Points, NDArray[np.bool_]]:
    """All markers: those of the frames, and disabled ones before and after each run, as Blender's tracker sets them."""
    begins = np.flatnonzero(np.diff(frames, prepend=frames[0] - 2) != 1)
    stops = np.append(begins[1:] - 1, len(frames) - 1)
    ends = np.concatenate([frames[begins] - 1, frames[stops] + 1])
    numbers = np.concatenate([frames, ends])
    # A gap of one frame needs one end only; outside the clip nothing is seen.
    numbers, kept = np.unique(numbers, return_index=True)
    inside = (kept < len(frames)) | ((numbers >= 1) & (numbers <= last))
    kept = kept[inside]
    return numbers[inside], np.concatenate([places, places[begins], places[stops]])[kept], kept >= len(frames)


def read(track: bpy.types.MovieTrackingTrack, size: Size) -> Markers:
    """All markers of a track, where its offset puts them."""
    frames, places, mute, keyed = _raw(track)
    points = to_pixels(places + np.array(track.offset, np.float32), size)
    return Markers(frames.astype(np.int64), points, ~mute, keyed)


def fingerprint(track: bpy.types.MovieTrackingTrack) -> int:
    """A number that changes when a marker, the weight or the offset does."""
    frames, places, mute, _ = _raw(track)
    settings = np.array([*track.offset, track.weight], np.float32)
    return crc32(b"".join(array.tobytes() for array in (frames, places, mute, settings)))


def copy(track: bpy.types.MovieTrackingTrack, face: bpy.types.MovieTrackingObject) -> bpy.types.MovieTrackingTrack:
    """The same track in another tracking object."""
    frames, places, mute, keyed = _raw(track)
    new = face.tracks.new(name=track.name, frame=int(frames[0]))
    for number in frames[1:].tolist():
        new.markers.insert_frame(number)
    copy_settings(track, new)
    for name, width in (("pattern_corners", 8), ("search_min", 2), ("search_max", 2)):
        values = np.empty(width * len(frames), np.float32)
        track.markers.foreach_get(name, values)
        new.markers.foreach_set(name, values)
    new.markers.foreach_set("co", places.ravel())
    new.markers.foreach_set("mute", mute)
    new.markers.foreach_set("is_keyed", keyed)
    return new


def copy_settings(old: bpy.types.bpy_struct, new: bpy.types.bpy_struct) -> None:
    """All that can be set of a track or a tracking object, but its name."""
    for setting in old.bl_rna.properties:
        if not setting.is_readonly and setting.identifier != "name":
            setattr(new, setting.identifier, getattr(old, setting.identifier))


def _raw(
    track: bpy.types.MovieTrackingTrack,
) -> tuple[NDArray[np.int32], NDArray[np.float32], NDArray[np.bool_], NDArray[np.bool_]]:
    count = len(track.markers)
    frames, places = np.empty(count, np.int32), np.empty(2 * count, np.float32)
    mute, keyed = np.empty(count, bool), np.empty(count, bool)
    for name, values in (("frame", frames), ("co", places), ("mute", mute), ("is_keyed", keyed)):
        track.markers.foreach_get(name, values)
    return frames, places.reshape(-1, 2), mute, keyed
