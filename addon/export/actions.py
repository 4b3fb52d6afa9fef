"""What *Export Head* does."""

from pathlib import Path
from typing import Any

from ..engine import FacewrightError
from ..scene import export_copy, export_sample, export_write, heads

ANIMATION, SCENE, CUSTOM = "ANIMATION", "SCENE", "CUSTOM"


def head(scene: Any, active: Any) -> Any:
    """The head that is exported: of the active object, or the last one made; None without."""
    shown = heads.current(scene, active, scene.facewright_clip.wanted)
    return shown[0] if shown is not None else None


def proposed(found: Any, suffix: str) -> str:
    """A file name for a head."""
    return export_copy.identifier(found.name) + suffix


def is_known(path: str) -> bool:
    """Whether the ending of a path is a format's."""
    return Path(path).suffix.lower() in export_write.FORMATS


def with_suffix(path: str, suffix: str) -> str:
    """A path with a format's ending instead of another format's."""
    return str(Path(path).with_suffix(suffix)) if is_known(path) else path + suffix


def export(context: Any, path: str, wanted: Any) -> str:
    """Write a head to a file; gives the message. `wanted` has the operator's options."""
    file = checked(path)
    found = head(context.scene, context.object)
    if found is None:
        raise FacewrightError("Reconstruct a face first")
    kind = export_write.FORMATS[file.suffix.lower()]
    export_write.check_exporter(kind)
    frames = span(context.scene, found, wanted) if wanted.animation else None
    evaluated, scale = kind in export_write.EVALUATED, export_write.SCALES.get(kind, 1.0)
    options = export_copy.Wanted(frames, wanted.joined, evaluated, scale)
    with export_copy.copied(context, found, options) as copy:
        export_write.write(file, copy, frames is not None)
        return message(file, copy, frames, wanted.animation)


def checked(path: str) -> Path:
    """The file, if one of a known format can be there."""
    file = Path(path)
    if not is_known(path):
        endings = ", ".join(export_write.FORMATS)
        raise FacewrightError(f"{file.name or path} has no ending that says its format: choose one of {endings}")
    if not file.parent.is_dir():
        raise FacewrightError(f"{file.parent} is not a folder: choose another place")
    if file.is_dir():
        raise FacewrightError(f"{file} is a folder: choose another name")
    return file


def span(scene: Any, found: Any, wanted: Any) -> tuple[int, int] | None:
    """First and last frame of what is exported; None where the head does not move by itself."""
    if wanted.range == SCENE:
        return scene.frame_start, scene.frame_end
    if wanted.range == ANIMATION:
        return export_sample.animated_range(found)
    if wanted.last < wanted.first:
        raise FacewrightError(f"the last frame, {wanted.last}, is before the first, {wanted.first}")
    return wanted.first, wanted.last


def message(file: Path, copy: Any, frames: tuple[int, int] | None, asked: bool) -> str:
    """What was written, in a line."""
    still = "nothing of it is animated" if asked else "without animation"
    moving = f"frames {frames[0]}–{frames[1]}" if frames else still
    count = len(copy.objects)
    lost = sorted(set(copy.left_out))
    rest = f"; left out, as only Alembic takes them: modifiers {', '.join(lost)}" if lost else ""
    return f"{file} written: {count} {'mesh' if count == 1 else 'meshes'}, {moving}{rest}"
