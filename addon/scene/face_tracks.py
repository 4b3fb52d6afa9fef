"""The tracks of a face in a movie clip, written into a tracking object of their own.

What an artist does there is kept: his own tracks, and those of ours that he locked or edited. Blender's Python cannot
delete a track, so the tracking object is made anew with what is kept, under the same name.
"""

import json
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..engine import FacewrightError, Tracks
from ..engine.tracks import Track, TrackedFrame
from . import markers, track_record
from .footage import Footage, shows
from .track_record import Gap, Mark, Record

OBJECT = "Face"
PREFIX = "FW"
COLORS = {"skin": (1.0, 0.6, 0.2), "mouth": (1.0, 0.25, 0.4), "eyes": (0.25, 0.7, 1.0), "brows": (0.5, 0.9, 0.3)}
MIN_WEIGHT = 0.05
SIGMA_DECIMALS = 5

TrackingObject = bpy.types.MovieTrackingObject
ClipTrack = bpy.types.MovieTrackingTrack


@dataclass(frozen=True)
class Kept:
    """Tracks that stay where ours are replaced or removed."""

    own: list[ClipTrack]
    locked: list[ClipTrack]
    edited: list[ClipTrack]

    @property
    def tracks(self) -> list[ClipTrack]:
        return [*self.own, *self.locked, *self.edited]


@dataclass(frozen=True)
class Outcome:
    """What became of a clip's tracks; `doubled` were left out because a kept one is at the same place.

    `aside` is a former tracking object that was left as it is, because the artist has plane tracks on it.
    """

    written: int
    own: int
    locked: int
    edited: int
    doubled: int = 0
    aside: str = ""


def face_object(clip: bpy.types.MovieClip) -> TrackingObject | None:
    """The tracking object with the face's tracks, also when it was renamed; None without one."""
    record = track_record.load(clip)
    if record is None:
        return None
    objects = [face for face in clip.tracking.objects if not face.is_camera]
    objects.sort(key=lambda face: face.name != record.object)
    with_ours = (face for face in objects if any(track.name in record.marks for track in face.tracks))
    return next(with_ours, next((face for face in objects if face.name == record.object), None))


def counts(clip: bpy.types.MovieClip) -> tuple[int, int, int] | None:
    """How many tracks are ours, the artist's own, and locked; None where no face was tracked."""
    face, record = face_object(clip), track_record.load(clip)
    if face is None or record is None:
        return None
    ours = sum(track.name in record.marks for track in face.tracks)
    return ours, len(face.tracks) - ours, sum(track.lock for track in face.tracks)


def of_file(path: str) -> bpy.types.MovieClip | None:
    """The movie clip of a video, a folder or a sequence that has a face's tracks."""
    clips = (clip for clip in bpy.data.movieclips if track_record.RECORD in clip and shows(clip, path))
    return next((clip for clip in clips if face_object(clip) is not None), None)


def anywhere() -> bool:
    """Whether any movie clip has a face's tracks."""
    return any(face_object(clip) is not None for clip in bpy.data.movieclips)


def place(clip: bpy.types.MovieClip, tracks: Tracks, footage: Footage) -> Outcome:
    """Write tracks into a clip; those that an earlier run wrote are replaced."""
    check_local(clip)
    numbers = footage.clip_frames([frame.name for frame in tracks.frames], tracks.size, "the tracks")
    if (np.diff(numbers) <= 0).any():
        order = np.argsort(numbers)
        tracks, numbers = tracks.of_frames([tracks.frames[k].name for k in order]), numbers[order]
    old, record = face_object(clip), track_record.load(clip)
    kept = _kept(old, record) if old is not None and record is not None else Kept([], [], [])
    marks = {t.name: record.marks[t.name] for t in (*kept.locked, *kept.edited)} if record is not None else {}
    fresh = _without_doubles(tracks, numbers, [markers.read(track, tracks.size) for track in kept.tracks])
    fresh = _renumbered(fresh, {mark.id for mark in marks.values()}, {track.name for track in kept.tracks})
    face, aside = _rebuilt(clip, old, kept.tracks)
    for track, weight in zip(fresh, _weights(fresh)):
        written = _write(face, track, tracks, numbers, weight, clip.frame_duration)
        marks[written.name] = _mark(track, numbers, written)
    track_record.store(clip, _record(face.name, tracks, _rows(tracks, numbers, footage), marks))
    doubled = len(tracks) - len(fresh)
    return Outcome(len(fresh), len(kept.own), len(kept.locked), len(kept.edited), doubled, aside)


def check_local(clip: bpy.types.MovieClip) -> None:
    """Refuse a clip that cannot be changed."""
    if clip.library is not None:
        raise FacewrightError(f"{clip.name} is linked from another file: make it local first")


def _record(name: str, tracks: Tracks, rows: tuple[dict[str, Any], ...], marks: dict[str, Mark]) -> Record:
    return Record(
        object=name,
        version=tracks.version,
        method=tracks.method,
        camera=json.loads(tracks.camera.to_json()),
        window=tracks.window,
        frames=rows,
        marks=marks,
        interocular=tracks.interocular,
        warnings=tuple(tracks.warnings),
    )


def _rows(tracks: Tracks, numbers: NDArray[np.int64], footage: Footage) -> tuple[dict[str, Any], ...]:
    """The frames for the record, with the clip's own names."""
    names = {frame.clip_frame: frame.name for frame in footage.frames}
    pairs = zip(tracks.frames, numbers.tolist())
    return tuple(_row(frame) | {"name": names[number], "clip_frame": number} for frame, number in pairs)


def _row(frame: TrackedFrame) -> dict[str, Any]:
    pose, why = frame.cam_from_head, {"reason": frame.reason, "reason_kind": frame.reason_kind}
    return {"used": frame.used, **why, "cam_from_head": pose.tolist() if pose is not None else None}


def _kept(face: TrackingObject, record: Record) -> Kept:
    ours = [track for track in face.tracks if track.name in record.marks]
    free = [track for track in ours if not track.lock]
    return Kept(
        own=[track for track in face.tracks if track.name not in record.marks],
        locked=[track for track in ours if track.lock],
        edited=[t for t in free if markers.fingerprint(t) != record.marks[t.name].fingerprint],
    )


def _without_doubles(tracks: Tracks, numbers: NDArray[np.int64], kept: list[markers.Markers]) -> list[Track]:
    """Tracks that no kept one follows closely: within half a pattern in most of the frames that both have."""
    if not kept:
        return tracks.tracks
    index = {int(number): k for k, number in enumerate(numbers)}
    places = np.full((len(kept), len(numbers), 2), np.nan)
    for row, track in zip(places, kept):
        # Disabled ones too: a point that the artist has switched off is not to come back.
        known = [(index[n], point) for n, point in zip(track.frames.tolist(), track.points) if n in index]
        for k, point in known:
            row[k] = point
    return [track for track in tracks.tracks if not _is_double(track, places, tracks.window)]


def _is_double(track: Track, places: NDArray[np.float64], window: int) -> bool:
    squared = ((places[:, track.frames] - track.points) ** 2).sum(axis=2)
    common, near = np.isfinite(squared).sum(axis=1), (squared < (window / 2) ** 2).sum(axis=1)
    return bool((2 * near > common).any())


def _renumbered(tracks: list[Track], ids: set[int], names: set[str]) -> list[Track]:
    """Tracks whose numbers and names no kept one has."""
    following = 1 + max([track.id for track in tracks] + list(ids), default=-1)
    result = []
    for track in tracks:
        number = track.id
        while number in ids or name_of(track.region, number) in names:
            number, following = following, following + 1
        result.append(track.with_id(number))
    return result


def name_of(region: str, number: int) -> str:
    """What a track is called in the Clip editor."""
    return f"{PREFIX} {region} {number:04d}"


def _weights(tracks: list[Track]) -> NDArray[np.float64]:
    """For Blender's solver, which multiplies errors by them: 1 for the best quarter of the tracks."""
    sigmas = np.array([np.median(track.sigmas) for track in tracks])
    return np.clip(np.quantile(sigmas, 0.25) / sigmas, MIN_WEIGHT, 1.0) if len(sigmas) else sigmas


def _rebuilt(
    clip: bpy.types.MovieClip, old: TrackingObject | None, kept: Iterable[ClipTrack]
) -> tuple[TrackingObject, str]:
    """A tracking object with the kept tracks in the place of the old one; the name of an old one that stays."""
    objects = clip.tracking.objects
    # Whichever object is asked, Blender tells the active track of the one that is shown.
    active = old.tracks.active if old is not None and objects.active == old else None
    active_name = active.name if active is not None else ""
    face, aside = objects.new(OBJECT), ""
    if old is not None:
        markers.copy_settings(old, face)
        for track in kept:
            markers.copy(track, face)
        if len(old.plane_tracks) > 0:
            aside = old.name
        else:
            name = old.name
            objects.remove(old)
            face.name = name
    objects.active = face
    if active_name in face.tracks:
        # Only a track that is there: Blender crashes on None.
        face.tracks.active = face.tracks[active_name]
    return face, aside


def _write(
    face: TrackingObject, track: Track, tracks: Tracks, numbers: NDArray[np.int64], weight: float, last: int
) -> ClipTrack:
    look = markers.Look(int(numbers[track.reference]), tracks.window, COLORS[track.region], float(weight))
    name = name_of(track.region, track.id)
    return markers.write(face, name, numbers[track.frames], track.points, look, tracks.size, last)


def _mark(track: Track, numbers: NDArray[np.int64], written: ClipTrack) -> Mark:
    frames = numbers[track.frames]
    sigmas = np.zeros(frames[-1] - frames[0] + 1)
    sigmas[frames - frames[0]] = np.maximum(np.round(track.sigmas, SIGMA_DECIMALS), 10.0**-SIGMA_DECIMALS)
    gaps = tuple(Gap(int(numbers[first]), int(numbers[last]), reason) for first, last, reason in track.gaps)
    return Mark(
        id=track.id,
        reference=int(numbers[track.reference]),
        region=track.region,
        first=int(frames[0]),
        sigmas=tuple(sigmas.tolist()),
        gaps=gaps,
        weight=written.weight,
        fingerprint=markers.fingerprint(written),
        place=track.place,
    )


def remove(clip: bpy.types.MovieClip) -> Outcome:
    """Take our tracks out of a clip; the artist's own and those that he locked stay."""
    check_local(clip)
    face, record = face_object(clip), track_record.load(clip)
    if face is None or record is None:
        raise FacewrightError(f"{clip.name} has no tracks of a face")
    if len(face.plane_tracks) > 0:
        raise FacewrightError(f"{face.name} has plane tracks that need its tracks: delete those first")
    kept = _kept(face, record)
    removed = len(face.tracks) - len(kept.own) - len(kept.locked)
    stay = [*kept.own, *kept.locked]
    if not stay:
        clip.tracking.objects.remove(face)
        track_record.forget(clip)
        return Outcome(removed, 0, 0, 0)
    marks = {track.name: record.marks[track.name] for track in kept.locked}
    face, _ = _rebuilt(clip, face, stay)
    track_record.store(clip, replace(record, object=face.name, marks=marks))
    return Outcome(removed, len(kept.own), len(kept.locked), 0)
