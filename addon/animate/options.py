"""What the expressions' buttons can be told, by their panel and by scripts."""

import bpy

from . import actions


class Blended:
    """Mix-in: how an expression goes onto the present pose."""

    # Blender gives unset properties their last values, but for SKIP_SAVE: a button means the same at every press.
    strength: bpy.props.FloatProperty(
        name="Strength",
        description="How much of the expression is taken",
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
