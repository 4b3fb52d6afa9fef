"""Blender's Online Manual, by F1 or the right mouse button, finds our pages: files of the extension, no network."""

import bpy

from . import actions


def register() -> None:
    bpy.utils.register_manual_map(actions.links)


def unregister() -> None:
    bpy.utils.unregister_manual_map(actions.links)
