"""Frames of a video by Blender's own sequencer, without touching the artist's scene.

Frames have the names of `frame_name`.
"""

import mmap
import struct
import tempfile
from collections.abc import Generator, Iterable
from pathlib import Path

import bpy

# Part of a bar that decoding takes, before the library's work on the frames.
DECODING = 0.1
# Videos made of boxes, which tell the shape of a pixel.
BOXED = {".mp4", ".mov", ".m4v", ".3gp"}
VIDEOS = {
    *{".mp4", ".mov", ".avi", ".mkv", ".webm", ".m4v", ".mpg", ".mpeg"},
    *{".ogv", ".mts", ".m2ts", ".ts", ".wmv", ".3gp", ".flv", ".gif"},
}


def is_video(path: str) -> bool:
    """Whether a path is a video by its extension: a folder of such a name is a folder."""
    return Path(path).suffix.lower() in VIDEOS and not Path(path).is_dir()


def frame_count(path: str) -> int:
    """Number of frames of a video; 0 when it cannot be read."""
    clip = bpy.data.movieclips.load(path)
    try:
        return clip.frame_duration if clip.size[0] > 0 else 0
    finally:
        bpy.data.movieclips.remove(clip)


def square_size(path: str, size: tuple[int, int]) -> tuple[int, int]:
    """The size of a video's frames once their pixels are square."""
    return round(size[0] * pixel_aspect(path)), size[1]


def pixel_aspect(path: str) -> float:
    """Width of a video's pixels against their height, as MP4 and MOV tell it; Blender does not ask."""
    if Path(path).suffix.lower() not in BOXED or Path(path).stat().st_size == 0:
        return 1.0
    with open(path, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        # The box `pasp`: its length, its name, horizontal and vertical spacing.
        at = content.find(b"\0\0\0\x10pasp")
        wide, high = struct.unpack(">II", content[at + 8 : at + 16]) if 0 <= at <= len(content) - 16 else (1, 1)
    return wide / high if wide and high else 1.0


def frame_name(number: int) -> str:
    """Name of a frame by its number in the clip, counted from 0."""
    return f"frame_{number:06d}"


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
    size = (element.orig_width, element.orig_height)
    render.resolution_x, render.resolution_y = square_size(path, size)
    strip.transform.scale_x *= render.resolution_x / size[0]
    render.resolution_percentage = 100
    render.use_sequencer, render.use_compositing = True, False
    render.image_settings.file_format = "PNG"
    render.image_settings.color_mode = "RGB"
    render.image_settings.compression = 0
    scene.view_settings.view_transform = "Standard"
    scene.sequencer_colorspace_settings.name = "sRGB"
