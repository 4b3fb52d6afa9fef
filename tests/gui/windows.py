"""Runs inside the window's Blender: what the driver orders to be done with windows; a mouse reaches one at a time.

Without a window manager new windows lie above each other.
"""

from pathlib import Path

import bpy


def obey(order: Path, done: int) -> int:
    """Do what a file orders, if its number is not that of the last one; gives the number."""
    number, _, what = (order.read_text() if order.exists() else f"{done} ").partition(" ")
    if int(number) != done:
        ORDERS[what]()
    return int(number)


def open_another() -> None:
    """A main window with a new scene, which it alone shows."""
    known = set(bpy.context.window_manager.windows)
    with bpy.context.temp_override(window=_first()):
        bpy.ops.wm.window_new_main()
    (fresh,) = set(bpy.context.window_manager.windows) - known
    fresh.scene = bpy.data.scenes.new("Other")


def close_first() -> None:
    with bpy.context.temp_override(window=_first()):
        bpy.ops.wm.window_close()


def show_first_scene() -> None:
    _first().scene = bpy.data.scenes["Scene"]


def _first() -> bpy.types.Window:
    return bpy.context.window_manager.windows[0]


ORDERS = {
    "another window with another scene": open_another,
    "close the first window": close_first,
    "show the first scene": show_first_scene,
}
