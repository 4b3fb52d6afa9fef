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
        return f"The camera cannot be used: {error}", True
    if camera is None:
        return "Not calibrated: the focal length is estimated", False
    complaint = scene_camera.complaint(camera, clip.name, footage.clip_size(clip))
    return complaint or f"Calibrated camera, focal {camera.fx:.1f} px", bool(complaint)


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
    parts = [f"{outcome.written} tracks in {used} of {len(tracks.frames)} frames", *_kept(outcome)]
    if outcome.doubled:
        parts.append(f"{outcome.doubled} new ones left out as duplicates")
    if outcome.aside:
        parts.append(f"{outcome.aside} stays for its plane tracks")
    return "; ".join(parts)


def _kept(outcome: Outcome) -> list[str]:
    kinds = ((outcome.own, "your own"), (outcome.locked, "locked"), (outcome.edited, "edited"))
    kept = [f"{count} {kind}" for count, kind in kinds if count]
    return [f"kept: {', '.join(kept)}"] if kept else []


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
    return "; ".join([f"{outcome.written} tracks removed", *_kept(outcome)])


def summary(clip: Any) -> list[str]:
    """The face's tracks of a clip in a line or two, for the panel; empty without any."""
    counted = face_tracks.counts(clip)
    if counted is None:
        return []
    ours, own, locked = counted
    more = [f"{count} {kind}" for count, kind in ((own, "of your own"), (locked, "locked")) if count]
    return [f"{ours} tracks of the face", *([", ".join(more)] if more else [])]


def save_text(path: str, tracks: Tracks) -> list[str]:
    """Write a tracks.json; gives what is to be said of it."""
    tracks.write(path)
    frames = tracks.frames
    used, seen = sum(frame.used for frame in frames), sum(frame.points for frame in frames)
    lines = [f"{len(tracks)} tracks of {seen / max(len(tracks), 1):.0f} frames in {used} of {len(frames)} frames"]
    return [*lines, *(f"{frame.name}: {frame.reason}" for frame in frames if not frame.used)]
