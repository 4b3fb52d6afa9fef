"""The choice of a head in the list, and its name there."""

from typing import Any

import bpy

from . import actions


class FacewrightHeads(bpy.types.PropertyGroup):
    """The list of a scene's heads."""

    index: bpy.props.IntProperty(
        name="Head",
        description="Row of the head that buttons act on: the active object's. Choosing one makes it active, and the "
        "next run updates it",
        get=lambda self: actions.number(self.id_data, _layer(self.id_data).objects.active),
        set=lambda self, number: actions.choose(self.id_data, _layer(self.id_data), number),
        options=set(),
    )


def title() -> Any:
    """The name of a head, of its skin: another one is given to its collection, parts, materials and pictures too."""
    return bpy.props.StringProperty(
        name="Name",
        description="Name of the head: of its objects and collection, and of the materials and pictures named after it",
        get=lambda self: self.name,
        set=lambda self, text: actions.rename(bpy.context.scene, self, text),
        options=set(),
    )


def _layer(scene: bpy.types.Scene) -> bpy.types.ViewLayer:
    """The view layer that the window shows of a scene, or its first."""
    return bpy.context.view_layer if bpy.context.scene == scene else scene.view_layers[0]
