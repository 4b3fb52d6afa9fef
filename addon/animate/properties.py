"""What the panels of expressions and keys are set to."""

import bpy

from .options import Blended


class FacewrightKeys(Blended, bpy.types.PropertyGroup):
    """How the buttons of expressions act, and which keys are shown; of the session, not of the file."""

    search: bpy.props.StringProperty(
        name="Search",
        description="Words, or parts of them, that the names of the keys or of their groups have",
        options={"SKIP_SAVE", "TEXTEDIT_UPDATE"},
    )
