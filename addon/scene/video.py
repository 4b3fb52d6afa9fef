"""Frames of a video by Blender's own sequencer, without touching the artist's scene.

Frames have the names of `frame_name`.
"""

import re
import tempfile
from collections.abc import Generator, Iterable
from pathlib import Path

import bpy

# Part of a bar that decoding takes, before the library's work on the frames.
DECODING = 0.1
VIDEOS = {
    *{".mp4", ".mov", ".avi", ".mkv", ".webm", ".m4v", ".mpg", ".mpeg"},
    *{".ogv", ".mts", ".m2ts", ".wmv", ".3gp", ".flv", ".gif"},
}


def is_video(path: str) -> bool:
    """Whether a path is a video by its extension."""
    return Path(path).suffix.lower() in VIDEOS


def frame_count(path: str) -> int:
    """Number of frames of a video; 0 when it cannot be read."""
    clip = bpy.data.movieclips.load(path)
    try:
        return clip.frame_duration if clip.size[0] > 0 else 0
    finally:
        bpy.data.movieclips.remove(clip)


def frame_name(number: int) -> str:
    """Name of a frame by its number in the clip, counted from 0."""
    return f"frame_{number:06d}"


def clip_files(clip: bpy.types.MovieClip) -> list[str]:
    """A movie clip's video, or the images of its sequence, as absolute paths."""
    first = Path(bpy.path.abspath(clip.filepath))
    if clip.source != "SEQUENCE":
        return [str(first)]
    digits = re.search(r"\d+$", first.stem)
    if digits is None:
        return [str(first)]
    stem, number, width = first.stem[: digits.start()], int(digits[0]), len(digits[0])
    names = (f"{stem}{number + k:0{width}}{first.suffix}" for k in range(clip.frame_duration))
    return [str(path) for name in names if (path := first.with_name(name)).exists()]


Decoding = Generator[tuple[str, float, None], None, tempfile.TemporaryDirectory[str]]


def decode(path: str, numbers: Iterable[int]) -> Decoding:
    """Write frames of a video as PNG into a temporary folder, one for each step of the generator."""
    folder = tempfile.TemporaryDirectory(prefix="facewright-")
    scene = bpy.data.scenes.new("Facewright decoding")
    try:
        _set_up(scene, path)
        wanted = list(numbers)
        for done, number in enumerate(wanted):
            yield "decode", DECODING * done / len(wanted), None
            _write(scene, number, Path(folder.name))
        return folder
    except (GeneratorExit, RuntimeError):
        folder.cleanup()
        raise
    finally:
        bpy.data.scenes.remove(scene)


def _write(scene: bpy.types.Scene, number: int, folder: Path) -> None:
    """Render one frame. As an animation of one frame: a still of a scene that is in no window shows a stale frame."""
    scene.frame_start = scene.frame_end = number + 1
    scene.render.filepath = str(folder / "scene_######")
    bpy.ops.render.render(animation=True, scene=scene.name)
    (folder / f"scene_{number + 1:06d}.png").rename(folder / f"{frame_name(number)}.png")


def _set_up(scene: bpy.types.Scene, path: str) -> None:
    editor = scene.sequence_editor_create()
    # Blender 5.0 renamed the collection; an empty one is falsy, so it must not be asked for its truth.
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences
    strip = strips.new_movie("clip", path, 1, 1)
    element = strip.elements[0]
    render = scene.render
    render.resolution_x, render.resolution_y = element.orig_width, element.orig_height
    render.resolution_percentage = 100
    render.use_sequencer, render.use_compositing = True, False
    render.image_settings.file_format = "PNG"
    render.image_settings.color_mode = "RGB"
    render.image_settings.compression = 0
    scene.view_settings.view_transform = "Standard"
    scene.sequencer_colorspace_settings.name = "sRGB"
