"""What work in progress has in the file, when undo or a file that was saved meanwhile brings it back: taken away."""

from typing import Any

import bpy

from .scene import sketch, video

HANDLERS = (bpy.app.handlers.undo_post, bpy.app.handlers.redo_post, bpy.app.handlers.load_post)


def register() -> None:
    for handlers in HANDLERS:
        handlers.append(_forget)


def unregister() -> None:
    for handlers in HANDLERS:
        handlers.remove(_forget)
    # The extension may be turned off under its work.
    sketch.forget()


@bpy.app.handlers.persistent
def _forget(*_given: Any) -> None:
    video.forget()
