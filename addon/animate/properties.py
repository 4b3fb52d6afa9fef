"""What the panels of expressions and keys are set to."""

import bpy

from . import actions


class FacewrightKeys(bpy.types.PropertyGroup):
    """How the buttons of expressions act, and which keys are shown; of the session, not of the file."""

    strength: bpy.props.FloatProperty(
        name="Strength",
        description="How much of an expression its button takes",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        options={"SKIP_SAVE"},
    )
    blend: bpy.props.EnumProperty(
        name="Blend",
        description="How the expression goes onto the present pose",
        items=actions.BLENDS,
        default=actions.REPLACE,
        options={"SKIP_SAVE"},
    )
    search: bpy.props.StringProperty(
        name="Search",
        description="Words, or parts of them, that the names of the keys or of their groups have",
        options={"SKIP_SAVE", "TEXTEDIT_UPDATE"},
    )
