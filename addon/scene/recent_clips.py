"""The clips that were chosen last, in the user's own folder of the extension and in no file of Blender's."""

import json
from pathlib import Path
from typing import Any

import bpy

MOST = 10


def recent() -> list[tuple[str, tuple[str, ...]]]:
    """Absolute paths that are still there, each with the names of the pictures that were chosen of a folder."""
    return [(path, names) for path, names in _read() if Path(path).exists()]


def remember(path: str, names: tuple[str, ...] = ()) -> None:
    """Put a clip before the others. A folder that cannot be written to is no reason to stop."""
    clips = [(path, names), *(clip for clip in recent() if clip != (path, names))][:MOST]
    try:
        kept = json.dumps([{"path": path, "pictures": names} for path, names in clips])
        _file(create=True).write_text(kept, encoding="utf-8")
    except OSError:
        return


def _read() -> list[tuple[str, tuple[str, ...]]]:
    try:
        found = json.loads(_file().read_text(encoding="utf-8"))
        return [(str(clip["path"]), tuple(map(str, clip["pictures"]))) for clip in found]
    # Whatever somebody else wrote there.
    except (OSError, ValueError, TypeError, KeyError):
        return []


def _file(**how: Any) -> Path:
    package = __name__.rsplit(".", 2)[0]
    return Path(bpy.utils.extension_path_user(package, **how)) / "recent_clips.json"
