"""The table's row follows the board that an artist makes active in the scene, as the board follows the row."""

import bpy

from . import actions

_owner = object()


def register() -> None:
    _subscribe()
    bpy.app.handlers.load_post.append(_subscribe_again)


def unregister() -> None:
    bpy.app.handlers.load_post.remove(_subscribe_again)
    bpy.msgbus.clear_by_owner(_owner)


@bpy.app.handlers.persistent
def _subscribe_again(_path: str) -> None:
    """Blender forgets subscriptions when it loads a file."""
    _subscribe()


def _subscribe() -> None:
    bpy.msgbus.clear_by_owner(_owner)
    bpy.msgbus.subscribe_rna(key=(bpy.types.LayerObjects, "active"), owner=_owner, args=(), notify=_follow)


def _follow() -> None:
    actions.follow_board(bpy.context.scene, bpy.context.view_layer.objects.active)
