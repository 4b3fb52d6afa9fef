"""What the motion's buttons do."""

from dataclasses import dataclass
from typing import Any

from ..engine import FacewrightError, Motion, Tracks, solve_motion
from ..engine.calibration import parse as parse_camera
from ..engine.motion import MotionFrame, parse
from ..jobs import Work, watch
from ..scene import camera as scene_camera
from ..scene import face_tracks, footage, motion_cloud, motion_lens, motion_record, motion_rig, track_reading
from ..scene.motion_record import Shown

# So many frames are told of in the panel; and a frame is told of that fits so many times worse than all do.
TOLD, WORSE = 3, 1.5


@dataclass(frozen=True)
class Settings:
    """How to find the motion: the text of a camera.json, and what was measured of the head, millimetres."""

    camera: str | None = None
    interocular_mm: float | None = None
    # Names of two tracks and their distance.
    length: tuple[str, str, float] | None = None

    @classmethod
    def of(cls, scene: Any) -> "Settings":
        """What the panels say."""
        settings = scene.facewright_motion
        return cls(
            scene.facewright_camera.text or None,
            scene.facewright_person.pupils_mm,
            (settings.length_from, settings.length_to, settings.length_mm) if settings.use_length else None,
        )


def solved(clip: Any, settings: Settings) -> Work[Motion]:
    """Find the motion from a clip's tracks as they are now."""
    if settings.camera:
        complaint = scene_camera.complaint(parse_camera(settings.camera), clip.name, footage.clip_size(clip))
        if complaint:
            raise FacewrightError(complaint)
    check(clip)
    tracks, named = track_reading.collect_named(clip)
    lengths = [_length(settings.length, named, clip)] if settings.length else []
    return solved_text(tracks, settings, lengths)


def check(clip: Any) -> None:
    """Refuse a clip that a motion could not be shown with, before anything begins."""
    face_tracks.check_local(clip)
    footage.of_clip(clip)


def solved_text(tracks: Tracks, settings: Settings, lengths: list[tuple[int, int, float]]) -> Work[Motion]:
    """The same from tracks; `lengths` name them by their numbers."""
    job = solve_motion(tracks, camera=settings.camera, interocular_mm=settings.interocular_mm, lengths=lengths)
    return watch(job)


def _length(length: tuple[str, str, float], named: dict[str, int], clip: Any) -> tuple[int, int, float]:
    first, second, length_mm = length
    if not (first and second) or first == second:
        raise FacewrightError("choose the two tracks of the measured length, or turn Measured Length off")
    for name in (first, second):
        if name not in named:
            raise FacewrightError(
                f"{name} is not a track of the face in {clip.name} with an enabled marker: choose another"
            )
    return named[first], named[second], length_mm


def selected_length(clip: Any, settings: Any) -> str:
    """Let the measured length go between the two selected tracks; gives the message."""
    face = face_tracks.face_object(clip)
    names = [track.name for track in face.tracks if track.select] if face is not None else []
    if len(names) != 2:
        raise FacewrightError(f"{len(names)} tracks of the face are selected: select the two that were measured")
    settings.use_length, settings.length_from, settings.length_to = True, names[0], names[1]
    return f"The length goes from {names[0]} to {names[1]}"


def place(scene: Any, clip: Any, motion: Motion) -> str:
    """Show a motion of a clip as objects; the message says what is there."""
    source = footage.of_clip(clip)
    numbers = source.clip_frames([frame.name for frame in motion.frames], motion.size, "the poses")
    face_tracks.check_local(clip)
    home = motion_record.ensured(scene)
    motion_record.store(home, motion.to_json(), clip, numbers)
    head = motion_rig.place(scene, home, motion, shown(scene))
    motion_cloud.place(scene, home, motion.points, head)
    motion_rig.set_scene(scene, home)
    scene.facewright_motion.clip = clip
    return "; ".join([headline(motion), *motion.warnings, *_undistortion(motion)])


def shown(scene: Any) -> Shown:
    """How the panel wants the motion shown."""
    settings = scene.facewright_motion
    return Shown(settings.kind, settings.key_turn, settings.follow)


def refresh(scene: Any) -> None:
    """Show the motion that a scene has as the panel says now."""
    home, motion = motion_record.collection(scene), known(scene)
    if home is None or motion is None:
        return
    head = motion_rig.place(scene, home, motion, shown(scene))
    motion_cloud.hang(scene, head)
    motion_rig.set_scene(scene, home)


def known(scene: Any) -> Motion | None:
    """The motion that a scene has; None without one, or with text that is none."""
    try:
        text = motion_record.text(scene)
        return parse(text) if text else None
    except FacewrightError:
        return None


def save(path: str, scene: Any) -> str:
    """Write the motion.json of a scene; gives the message."""
    motion = parse(motion_record.text(scene))
    motion.write(path)
    return f"{path} saved with {len(motion.posed)} poses"


def open_file(path: str, scene: Any, clip: Any) -> str:
    """Show the motion of a file; gives the message."""
    return place(scene, clip, Motion.read(path))


def remove(scene: Any) -> None:
    """Take cameras, head, points and what is remembered out of a scene; what else is in the collection stays."""
    motion_rig.remove(scene)
    motion_cloud.remove(scene)
    motion_record.forget(scene)


def look_through(scene: Any) -> str:
    """Make the camera of the present frame the scene's, and the render the clip's size; gives its name."""
    eye, motion = motion_rig.camera_at(scene, scene.frame_current), known(scene)
    if eye is None or motion is None:
        raise FacewrightError("the motion no longer has a camera: solve it again")
    scene.camera = eye
    scene_camera.set_render(scene.render, motion.camera)
    return eye.name


def headline(motion: Motion) -> str:
    """A motion in a line."""
    return (
        f"{len(motion.posed)} of {len(motion.frames)} frames, {len(motion.points)} points, "
        f"error {motion.reprojection_rms_px:.2f} px"
    )


def summary(motion: Motion) -> list[str]:
    """A motion in a few lines: how many frames, how well, which focal length, whose scale, how smooth."""
    moving = int(motion.points.moves.sum())
    still = f"{len(motion.points) - moving} points" + (f", {moving} that move" if moving else "")
    sigma = motion.focal_sigma_px
    focal = f" ± {sigma:.1f} px" if sigma is not None else " px, as given"
    return [
        f"{len(motion.posed)} of {len(motion.frames)} frames posed",
        f"{still}, error {motion.reprojection_rms_px:.2f} px",
        f"Focal {motion.camera.fx:.1f}{focal}",
        f"Scale: {motion.scale.source} ± {100.0 * motion.scale.relative_sigma:.1f} %",
        f"Shake {motion.roughness.rotation_deg:.2f}°, {motion.roughness.translation_mm:.2f} mm",
    ]


def complaints(motion: Motion) -> list[str]:
    """Frames without a pose and why, and those that fit worst; only some of many."""
    frames = motion.frames
    missing = [f"{frame.name}: {frame.reason or 'no pose'}" for frame in frames if frame.cam_from_head is None]
    bad = [frame for frame in frames if _rms(frame) > WORSE * motion.reprojection_rms_px]
    worst = sorted(bad, key=_rms, reverse=True)
    return [*_some(missing), *_some([f"{f.name}: error {_rms(f):.2f} px" + _why(f) for f in worst])]


def _rms(frame: MotionFrame) -> float:
    rms = frame.reprojection_rms_px
    return rms if rms is not None and frame.cam_from_head is not None else 0.0


def _why(frame: MotionFrame) -> str:
    return f", {frame.reason}" if frame.reason else ""


def _some(lines: list[str]) -> list[str]:
    return [*lines[:TOLD], *([f"and {len(lines) - TOLD} more"] if len(lines) > TOLD else [])]


def _undistortion(motion: Motion) -> list[str]:
    if not motion_lens.is_distorted(motion.camera) or scene_camera.has_square_pixels(motion.camera):
        return []
    return ["its pixels are not square, but Blender undistorts the clip as if they were"]


def save_text(path: str, motion: Motion) -> list[str]:
    """Write a motion.json; gives what is to be said of it."""
    motion.write(path)
    return [*summary(motion), *complaints(motion), *motion.warnings]
