"""What tracking's buttons do."""

from dataclasses import dataclass, field
from typing import Any

from ..engine import FacewrightError, TrackOptions, Tracks, track
from ..engine.calibration import parse as parse_camera
from ..jobs import Work, watch
from ..scene import camera as scene_camera
from ..scene import face_tracks, footage, track_reading, video
from ..scene.face_tracks import Outcome
from ..scene.footage import Footage
from ..words import say


@dataclass(frozen=True)
class Settings:
    """How to track; texts of a camera.json and a faces.json."""

    camera: str | None = None
    faces: str | None = None
    options: TrackOptions = field(default_factory=TrackOptions)

    @classmethod
    def of(cls, settings: Any, camera: str) -> "Settings":
        """What the panel says."""
        window = settings.window | 1 if settings.use_window else None
        return cls(camera or None, options=TrackOptions(method=settings.method, points=settings.points, window=window))


def shown(clip: Any, scene: Any) -> Footage:
    """The frames of a clip that the panel asks for."""
    face_tracks.check_local(clip)
    settings, whole = scene.facewright_track, footage.of_clip(clip)
    if settings.span == "CLIP":
        return whole
    first, last = settings.first, settings.last
    if settings.span == "SCENE":
        preview = scene.use_preview_range
        first = scene.frame_preview_start if preview else scene.frame_start
        last = scene.frame_preview_end if preview else scene.frame_end
    return whole.part(footage.clip_frame(clip, first), footage.clip_frame(clip, last))


def tracked(source: Footage, settings: Settings) -> Work[Tracks]:
    """Decode the clip if it is a video, then track."""
    if settings.camera:
        complaint = scene_camera.complaint(parse_camera(settings.camera), source.clip, source.size)
        if complaint:
            raise FacewrightError(complaint)
    if len(source.frames) < 2:
        raise FacewrightError(f"{source.clip} has only one frame: tracking needs two or more")
    return _tracked(source, settings)


def camera_line(text: str, clip: Any) -> tuple[str, bool]:
    """Which camera is used, for the panel, and whether it does not fit."""
    try:
        camera = parse_camera(text) if text else None
    except FacewrightError as error:
        return say("The camera cannot be used: {why}", why=error), True
    if camera is None:
        return say("Not calibrated: the focal length is estimated"), False
    complaint = scene_camera.complaint(camera, clip.name, footage.clip_size(clip))
    return complaint or say("Calibrated camera, focal {focal} px", focal=f"{camera.fx:.1f}"), bool(complaint)


def _tracked(source: Footage, settings: Settings) -> Work[Tracks]:
    indices = [frame.index for frame in source.frames]
    if source.images is None:
        frames = yield from video.opened(source.path, indices, of_face=not settings.faces)
    else:
        frames = video.Frames([source.images[index] for index in indices])
    with frames:
        given = {"camera": settings.camera, "faces": settings.faces, "options": settings.options}
        return (yield from frames.behind(watch(track(frames.paths, numbers=frames.numbers, **given))))


def place(clip: Any, tracks: Tracks) -> str:
    """Write tracks into a clip as markers; the message says what became of all of them."""
    whole = footage.of_clip(clip)
    outcome = face_tracks.place(clip, tracks, whole)
    used = sum(frame.used for frame in tracks.frames)
    count, frames = outcome.written, len(tracks.frames)
    said = say("{count} tracks in {used} of {frames} frames", count=count, used=used, frames=frames)
    parts = [said, *_kept(outcome)]
    if outcome.doubled:
        parts.append(say("{count} new ones left out as duplicates", count=outcome.doubled))
    if outcome.aside:
        parts.append(say("{name} stays for its plane tracks", name=outcome.aside))
    return "; ".join(parts)


def _kept(outcome: Outcome) -> list[str]:
    kinds = (
        (outcome.own, say("{count} your own")),
        (outcome.locked, say("{count} locked")),
        (outcome.edited, say("{count} edited")),
    )
    kept = [kind.format(count=count) for count, kind in kinds if count]
    return [say("kept: {things}", things=", ".join(kept))] if kept else []


def read(clip: Any) -> Tracks:
    """The markers as they are in the clip now."""
    return track_reading.collect(clip)


def save(path: str, clip: Any) -> str:
    """Write a tracks.json of the markers as they are now; gives the message."""
    tracks = track_reading.collect(clip)
    tracks.write(path)
    return f"{path} saved with {len(tracks)} tracks"


def open_file(path: str, clip: Any) -> str:
    """Write the tracks of a file into a clip; gives the message."""
    return place(clip, Tracks.read(path))


def remove(clip: Any) -> str:
    """Take our tracks out of a clip; gives the message."""
    outcome = face_tracks.remove(clip)
    return "; ".join([say("{count} tracks removed", count=outcome.written), *_kept(outcome)])


def summary(clip: Any) -> list[str]:
    """The face's tracks of a clip in a line or two, for the panel; empty without any."""
    counted = face_tracks.counts(clip)
    if counted is None:
        return []
    ours, own, locked = counted
    kinds = ((own, say("{count} of your own")), (locked, say("{count} locked")))
    more = [kind.format(count=count) for count, kind in kinds if count]
    return [say("{count} tracks of the face", count=ours), *([", ".join(more)] if more else [])]


def save_text(path: str, tracks: Tracks) -> list[str]:
    """Write a tracks.json; gives what is to be said of it."""
    tracks.write(path)
    frames = tracks.frames
    used, seen = sum(frame.used for frame in frames), sum(frame.points for frame in frames)
    lines = [f"{len(tracks)} tracks of {seen / max(len(tracks), 1):.0f} frames in {used} of {len(frames)} frames"]
    return [*lines, *(f"{frame.name}: {frame.reason}" for frame in frames if not frame.used)]
