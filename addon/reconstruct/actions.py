"""What the reconstruction's buttons do."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .. import preferred
from ..engine import (
    FacewrightError,
    Method,
    Reconstruction,
    ReconstructOptions,
    Tracks,
    check_folder,
    reconstruct,
)
from ..engine.report import parse as parse_report
from ..engine.report import summary as report_summary
from ..jobs import Work, watch
from ..scene import controls, face_tracks, heads, motion_rig, portrait, track_reading, video, view
from ..scene import head as scene_head
from ..scene.heads import NEW, Head
from ..scene.source import Source, images, length, numbers, overlap, spans
from ..words import say, sentence

# Choices of the texture's width and height, pixels.
TEXTURE_SIZES = (1024, 2048, 4096)
NO_MARKERS = "no movie clip of this file has the face's tracks: track the face in the Clip editor"


@dataclass(frozen=True)
class Settings:
    """How to reconstruct; texts of a camera.json, a tracks.json and a motion.json; `output` will hold the files."""

    camera: str | None = None
    output: str | None = None
    faces: str | None = None
    tracks: Tracks | None = None
    motion: str | None = None
    options: ReconstructOptions = field(default_factory=ReconstructOptions)


def options_of(*groups: Any) -> ReconstructOptions:
    """What panels say: their properties that are called as the library's options, unless their `use_…` is off."""
    values: dict[str, Any] = {}
    for group in groups:
        names = [name for name in dir(ReconstructOptions()) if name in group.bl_rna.properties]
        used = [name for name in names if getattr(group, f"use_{name.removesuffix('_mm')}", True)]
        values |= {name: getattr(group, name) for name in used}
    # The items of a choice are texts, of numbers too.
    values |= {name: int(value) for name, value in values.items() if isinstance(value, str) and value.isdigit()}
    values |= {name: tuple(values[name]) for name in values if name == "face"}
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
    if video.is_video(source.path):
        wanted = numbers(source)
        frames = yield from video.opened(source.path, wanted, of_face=not settings.faces)
        names = [video.frame_name(number) for number in wanted]
    else:
        frames = video.Frames(images(source))
        names = [Path(frame).stem for frame in frames.paths]
    with frames:
        job = reconstruct(
            frames.paths,
            numbers=frames.numbers,
            camera=settings.camera,
            faces=settings.faces,
            tracks=_tracks(settings.tracks, names) if settings.tracks else None,
            motion=settings.motion,
            options=settings.options,
        )
        return (yield from frames.behind(watch(job)))


def _tracks(tracks: Tracks, names: list[str]) -> Tracks:
    """Tracks as they concern the frames that are used."""
    tracks = tracks.of_frames(names)
    if not len(tracks):
        raise FacewrightError("the markers are in none of these frames: use other frames, or turn Use Markers off")
    return tracks


def wanted(scene: Any) -> str:
    """What a run that begins now is to make, whatever is chosen or copied later; empty for an older version's head."""
    settings = scene.facewright_clip
    head = heads.to_update(_local(scene), settings.path, settings.wanted)
    return NEW if head is None else head.key


def lost(scene: Any, wanted: str) -> list[str]:
    """What is to be said if the head that a run was to make is not there any more."""
    is_lost = wanted not in ("", NEW) and heads.of_key(_local(scene), wanted) is None
    return [say("the head that this was for is gone: it is a new one")] if is_lost else []


def write(result: Reconstruction, folder: str) -> str:
    """Write the files of a result; gives what is wrong, as the head must not be lost over that."""
    try:
        result.write(folder)
    except FacewrightError as error:
        return say("The files of the result are not written: {why}", why=error)
    return ""


def place(
    scene: Any, result: Reconstruction, clip: str, wanted: str = "", collection: Any = None, is_chosen: bool = True
) -> Any:
    """Show what was made from a clip as the wanted head, moved by the motion that the scene has; gives `Face`.

    A new one gets a collection of its own within another (None: the scene's own). The panel goes on with it, unless
    the artist has chosen something else meanwhile. A head that is gone is made as a new one: no other is touched.
    """
    found = _local(scene)
    head = heads.made_of(found, clip) if not wanted else heads.of_key(found, wanted) if wanted != NEW else None
    face = scene_head.place(scene, result, clip, head, collection)
    if is_chosen:
        scene.facewright_clip.wanted = heads.key_of(face)
    portrait.portray(scene, face)
    is_new = head is None or face != head.skin
    controls.update(next(found for found in heads.heads(scene) if found.skin == face))
    motion_rig.meet_face(scene, face, is_new, scene.facewright_motion.follow)
    return face


def show(layer: Any, face: Any) -> None:
    """Select a head alone and make it active; one in a collection that the view layer leaves out cannot be."""
    view.select(layer, face)


def present(window: Any, face: Any, glance: view.Glance) -> None:
    """Frame a new head, which is selected, in a window: its front, with its texture."""
    glance.face(window, face.matrix_world.to_quaternion())
    view.present(window)


def next_step(is_new: bool) -> list[str]:
    """What to do next, where a head is new."""
    if not is_new:
        return []
    return [say("next: try an expression in the panel; Material Preview (Z) shows skin and eyes in light")]


def choices(scene: Any) -> list[tuple[str, str, str]]:
    """What a run can make, each with its name, label and description: a new head, or one of the scene's anew."""
    new = (NEW.upper(), say("New Head"), say("Make a new head, in a collection of its own"))
    return [new, *(_choice(head) for head in _local(scene))]


def chosen(scene: Any) -> int:
    """The number of what the next run will make."""
    settings, found = scene.facewright_clip, _local(scene)
    head = heads.to_update(found, settings.path, settings.wanted)
    return 0 if head is None else found.index(head) + 1


def choose(scene: Any, number: int) -> None:
    """Let the next run make the choice of a number."""
    scene.facewright_clip.wanted = heads.own_key(scene, _local(scene)[number - 1]) if number else NEW


def texture_choice(settings: Any) -> int:
    """The number of the size of a scene's texture: what was chosen there, or what the user prefers."""
    return TEXTURE_SIZES.index(settings.texture_px or preferred.texture_px)


def choose_texture(settings: Any, number: int) -> None:
    """Let a scene have a size of its own."""
    settings.texture_px = TEXTURE_SIZES[number]


def meet_clip(scene: Any, path: str) -> None:
    """Count the frames of a clip that was chosen, by its absolute path, and choose its head.

    No frame of it is left out, and of a folder all pictures are used. The part that is used begins as all of it, unless
    the artist has set another. Another clip may show another person: choose anew, unless it is the one that the chosen
    head was made from.
    """
    settings = scene.facewright_clip
    usual = settings.bl_rna.properties
    untouched = {(usual["first"].default, usual["last"].default), (0, settings.frames - 1)}
    settings.pictures.clear()
    settings.left_out = ""
    settings.frames = length(Source(path))
    if settings.frames and not settings.use_range and (settings.first, settings.last) in untouched:
        settings.first, settings.last = 0, settings.frames - 1
    head = heads.of_key(_local(scene), settings.wanted)
    if head is None or head.clip is None or not heads.same_clip(head.clip, settings.path):
        settings.wanted = ""


def length_line(settings: Any) -> tuple[str, bool] | None:
    """How long a clip is, and how much of it is used; and whether that can be. None where it was not counted."""
    count = settings.frames
    if count < 0 or not settings.path:
        return None
    if count == 0:
        return sentence("no frames there: choose a video, or a folder of pictures"), False
    first, last = (settings.first, min(settings.last, count - 1)) if settings.use_range else (0, count - 1)
    if settings.use_range and last - first < 1:
        return say("The clip has {count} frames, 0 to {last}", count=count, last=count - 1), False
    try:
        used = last - first + 1 - len(overlap(spans(settings.left_out), first, last))
    except FacewrightError as error:
        return sentence(str(error)), False
    if used < 1:
        return sentence("every frame is left out: take some of them in again"), False
    if used < count:
        text = "{used} of {count} pictures" if settings.pictures else "{used} of {count} frames"
    else:
        text = "{count} pictures" if settings.pictures else "{count} frames"
    return say(text, used=used, count=count), True


def _choice(head: Head) -> tuple[str, str, str]:
    if head.skin is None:
        return head.name, say("{head} Anew", head=head.name), say("Make this head again: its skin was deleted")
    about = say("Update this head: its shape keys keep their values and animation, its materials their nodes")
    return head.name, say("Update {head}", head=head.title), about


def _local(scene: Any) -> list[Head]:
    """The heads that a run may change."""
    return [head for head in heads.heads(scene) if head.is_local]


def report(scene: Any, active: Any) -> tuple[str, str] | None:
    """The report of the active object's head, or of the last one made, after the head's name; that is empty for one."""
    shown = heads.current(scene, active, scene.facewright_clip.wanted)
    if shown is None:
        return None
    head, name = shown
    return (name, head.skin[scene_head.REPORT]) if head.skin is not None and scene_head.REPORT in head.skin else None


def markers_complaint(path: str, method: Method) -> str:
    """Why the markers of a clip cannot be used; empty if they can."""
    if method != "default":
        return say("the method Paper does its own tracking: choose Default to use markers")
    return "" if path and face_tracks.of_file(path) is not None else say(NO_MARKERS)


def any_markers() -> bool:
    """Whether any movie clip has a face's tracks."""
    return face_tracks.anywhere()


def markers(path: str) -> Tracks:
    """The markers of a clip, as they are now."""
    clip = face_tracks.of_file(path)
    if clip is None:
        raise FacewrightError(f"{NO_MARKERS}, or turn Use Markers off")
    return track_reading.collect(clip)


def report_lines(text: str) -> list[str]:
    """A report in a few lines for the panel."""
    return report_summary(parse_report(text), say)


def quality(text: str) -> tuple[str, str] | None:
    """How good a head is, in one line, with an icon of the line's colour; None in older reports."""
    found = parse_report(text).quality
    if found is None:
        return None
    if found.verdict == "good":
        return say("Good: every measure is as usual"), "COLORSET_03_VEC"
    names = ", ".join(measure.name.replace("_", " ") for measure in found.unusual)
    return say("Look at it: {measures}", measures=names), "COLORSET_09_VEC"


def kept(face: Any) -> list[str]:
    """What of an artist's the last run on a head kept, as one sentence; none where that is nothing."""
    found = scene_head.kept(face)
    return [say("kept: {things}", things=", ".join(found))] if found else []


def shown_kept(scene: Any, active: Any) -> list[str]:
    """The same of the head whose report is shown."""
    shown = heads.current(scene, active, scene.facewright_clip.wanted)
    return kept(shown[0].skin) if shown is not None else []


def warnings(text: str) -> list[str]:
    """What the artist should know of a result."""
    return parse_report(text).warnings
