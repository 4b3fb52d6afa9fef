"""The tracks of a face, read back from a movie clip as an artist left them."""

import bpy
import numpy as np

from ..engine import FacewrightError, Tracks
from ..engine.tracks import REGIONS, Track
from . import markers, track_record
from .face_tracks import MIN_WEIGHT, ClipTrack, face_object
from .track_record import Mark

# Of a marker that was set by hand, pixels.
HAND_SIGMA_PX = 0.5
# What single precision keeps of a pixel.
DECIMALS = 5
BY_HAND = "disabled by hand"


def collect(clip: bpy.types.MovieClip) -> Tracks:
    """The tracks as they are in the clip now: edited, disabled, or added by the artist."""
    return collect_named(clip)[0]


def collect_named(clip: bpy.types.MovieClip) -> tuple[Tracks, dict[str, int]]:
    """The tracks as they are in the clip now, and their numbers by their names in the Clip editor."""
    face, record = face_object(clip), track_record.load(clip)
    if face is None or record is None:
        raise FacewrightError(f"{clip.name} has no tracks of a face: track the face first")
    tracks = record.tracks
    index = {row["clip_frame"]: k for k, row in enumerate(record.frames)}
    following = 1 + max((mark.id for mark in record.marks.values()), default=-1)
    found, named, disabled = [], {}, []
    for track in face.tracks:
        mark = record.marks.get(track.name)
        disabled += _disabled(track, mark, tracks.size, index) if mark is not None else []
        read = _read(track, mark or _own(track, following), tracks.size, index)
        if read is not None:
            found.append(read)
            named[track.name] = read.id
            following += mark is None
    if not found:
        raise FacewrightError(f"all markers of {face.name} in {clip.name} are disabled: track the face again")
    read_back = tracks.with_tracks(sorted(found, key=lambda track: track.id))
    return read_back.with_disabled(sorted(disabled)), named


def _own(track: ClipTrack, number: int) -> Mark:
    """A track that the artist added: skin, unless its name tells another region; its first key is the reference."""
    region = next((region for region in REGIONS if region in track.name.lower()), "skin")
    keyed = (marker.frame for marker in track.markers if marker.is_keyed and not marker.mute)
    return Mark(number, next(keyed, -1), region, 0, (), (), 1.0, 0)


def _read(track: ClipTrack, mark: Mark, size: tuple[int, int], index: dict[int, int]) -> Track | None:
    """A track as the library has it; None if it has no enabled marker in the frames, or no weight."""
    read = markers.read(track, size)
    known = read.enabled & np.isin(read.frames, list(index))
    if not known.any() or track.weight <= 0.0:
        return None
    numbers = read.frames[known]
    edited = markers.fingerprint(track) != mark.fingerprint
    moved = read.keyed[known] & (numbers != mark.reference) & edited
    sigmas = np.array([0.0 if hand else mark.sigma(n) for n, hand in zip(numbers.tolist(), moved)])
    sigmas = np.where(sigmas > 0.0, sigmas, HAND_SIGMA_PX) * _trust(mark, track)
    frames = np.array([index[n] for n in numbers.tolist()], np.int64)
    wanted = index.get(mark.reference, int(frames[0]))
    reference = int(frames[np.abs(frames - wanted).argmin()])
    return Track(
        mark.id,
        reference=reference,
        region=mark.region,
        frames=frames.tolist(),
        points=np.round(read.points[known], DECIMALS),
        sigmas=np.maximum(np.round(sigmas, DECIMALS), 10.0**-DECIMALS),
        missing=_missing(mark, set(numbers.tolist()), index),
        place=None if edited else mark.place,
    )


def _disabled(
    track: ClipTrack, mark: Mark, size: tuple[int, int], index: dict[int, int]
) -> list[tuple[int, float, float]]:
    """Frame and pixels of the markers that the library set and the artist disabled, or gave no weight."""
    read = markers.read(track, size)
    off = ~read.enabled | (track.weight <= 0.0)
    places = zip(read.frames[off].tolist(), np.round(read.points[off], DECIMALS).tolist(), strict=True)
    # A disabled marker where nothing was found only ends a run.
    return [(index[n], u, v) for n, (u, v) in places if n in index and mark.sigma(n) > 0.0]


def _trust(mark: Mark, track: ClipTrack) -> float:
    """By how much sigma grows when the artist lowers a track's weight."""
    return 1.0 if track.weight == mark.weight else max(mark.weight, MIN_WEIGHT) / max(track.weight, MIN_WEIGHT)


def _missing(mark: Mark, seen: set[int], index: dict[int, int]) -> dict[int, str]:
    """Frames without a marker for which a reason is known."""
    reasons = {n: gap.reason for gap in mark.gaps for n in range(gap.first, gap.last + 1)}
    reasons |= {mark.first + k: BY_HAND for k, sigma in enumerate(mark.sigmas) if sigma > 0.0}
    return {index[n]: reason for n, reason in reasons.items() if n in index and n not in seen}
