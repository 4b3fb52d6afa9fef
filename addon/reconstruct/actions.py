"""What the reconstruction's buttons do."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..engine import FacewrightError, Method, Reconstruction, ReconstructOptions, check_folder, reconstruct
from ..engine.tracks import parse, to_text
from ..jobs import Work, watch
from ..scene import face_tracks, motion_rig, track_reading, video
from ..scene import head as scene_head
from ..scene.footage import PICTURES

NO_MARKERS = "no movie clip of this file has the face's tracks: track the face in the Clip editor"


@dataclass(frozen=True)
class Source:
    """The frames of a clip: an absolute path, and the first and last frame to use (None: all)."""

    path: str
    span: tuple[int, int] | None = None


@dataclass(frozen=True)
class Settings:
    """How to reconstruct; texts of a camera.json, a tracks.json and a motion.json; `output` will hold the files."""

    camera: str | None = None
    output: str | None = None
    tracks: str | None = None
    motion: str | None = None
    options: ReconstructOptions = field(default_factory=ReconstructOptions)


def options_of(clip: Any) -> ReconstructOptions:
    """What the panel says: its properties that are called as the library's options, unless their `use_…` is off."""
    names = [name for name in dir(ReconstructOptions()) if name in clip.bl_rna.properties]
    values: dict[str, Any] = {
        name: getattr(clip, name) for name in names if getattr(clip, f"use_{name.removesuffix('_mm')}", True)
    }
    # The items of a choice are texts, of numbers too.
    values |= {name: int(value) for name, value in values.items() if isinstance(value, str) and value.isdigit()}
    return ReconstructOptions(**values)


def reconstructed(source: Source, settings: Settings) -> Work[Reconstruction]:
    """Decode the clip if it is a video, then reconstruct."""
    check(source)
    if settings.output:
        check_folder(settings.output)
    return _reconstructed(source, settings)


def check(source: Source) -> None:
    """Refuse what cannot be a clip before anything begins."""
    if not source.path:
        raise FacewrightError("choose a clip first: a video, a folder of frames or an image")
    if not Path(source.path).exists():
        raise FacewrightError(f"{source.path} does not exist: choose the clip again")
    if source.span is not None and source.span[1] <= source.span[0]:
        raise FacewrightError("the last frame must come after the first")


def _reconstructed(source: Source, settings: Settings) -> Work[Reconstruction]:
    folder = None
    try:
        if video.is_video(source.path):
            numbers = _numbers(source)
            folder = yield from video.decode(source.path, numbers)
            frames, names = [folder.name], [video.frame_name(number) for number in numbers]
        else:
            frames = _images(source)
            names = [Path(frame).stem for frame in frames]
        job = reconstruct(
            frames,
            camera=settings.camera,
            tracks=_tracks(settings.tracks, names) if settings.tracks else None,
            motion=settings.motion,
            options=settings.options,
        )
        return (yield from watch(job))
    finally:
        if folder is not None:
            folder.cleanup()


def _tracks(text: str, names: list[str]) -> str:
    """Tracks as they concern the frames that are used."""
    tracks = parse(text).of_frames(names)
    if not tracks.tracks:
        raise FacewrightError("the markers are in none of these frames: use other frames, or turn Use Markers off")
    return to_text(tracks)


def _numbers(source: Source) -> range:
    count = video.frame_count(source.path)
    if count == 0:
        raise FacewrightError(f"{source.path} cannot be read as a video")
    first, last = source.span or (0, count - 1)
    if first >= count:
        raise FacewrightError(f"the clip has {count} frames, counted from 0: frame {first} is beyond its end")
    return range(first, min(last, count - 1) + 1)


def _images(source: Source) -> list[str]:
    path = Path(source.path)
    folder = path if path.is_dir() else path.parent
    images = sorted(str(p) for p in folder.iterdir() if p.suffix.lower() in PICTURES)
    if not images:
        raise FacewrightError(f"{folder} holds no frames: PNG, JPEG, TIFF, BMP or WebP")
    if source.span is not None:
        images = images[source.span[0] : source.span[1] + 1]
    return images


def place(scene: Any, result: Reconstruction, collection: Any = None) -> Any:
    """Show a head in a collection of a scene (None: its own), moved by the motion that the scene has; gives `Face`."""
    before = scene_head.face(scene)
    face = scene_head.place(scene, result, collection)
    motion_rig.meet_face(scene, face != before, scene.facewright_motion.follow)
    return face


def markers_complaint(path: str, method: Method) -> str:
    """Why the markers of a clip cannot be used; empty if they can."""
    if method != "default":
        return "the method Paper tracks in its own way: choose Default to use markers"
    return "" if path and face_tracks.of_file(path) is not None else NO_MARKERS


def any_markers() -> bool:
    """Whether any movie clip has a face's tracks."""
    return face_tracks.anywhere()


def markers(path: str) -> str:
    """The text of a tracks.json of the markers of a clip, as they are now."""
    clip = face_tracks.of_file(path)
    if clip is None:
        raise FacewrightError(f"{NO_MARKERS}, or turn Use Markers off")
    return to_text(track_reading.collect(clip))


def report_lines(text: str) -> list[str]:
    """A report in a few lines for the panel."""
    report: dict[str, Any] = json.loads(text)
    frames = report["frames"]
    used = [frame for frame in frames if frame["used"]]
    reasons: dict[str, int] = {}
    for frame in frames:
        if not frame["used"]:
            reason = frame["reason"].split(":")[0].split("(")[0].strip()
            reasons[reason] = reasons.get(reason, 0) + 1
    lines = [f"{len(used)} of {len(frames)} frames, {report['points']} points"] if frames else []
    lines += [f"{count} × {reason}" for reason, count in reasons.items()]
    if frames:
        lines.append(
            f"Fit {report['fit']['points_median_mm']:.2f} mm, texture {100 * report['texture']['seen']:.0f} % seen"
        )
    return lines


def warnings(text: str) -> list[str]:
    """What the artist should know of a result."""
    return json.loads(text)["warnings"]
