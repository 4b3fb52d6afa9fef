"""What a beginner does next, and where the manual is."""

import bpy

from ..running import Running, draw_text
from . import actions
from .operators import FACEWRIGHT_OT_manual


class Side:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Facewright"


class FACEWRIGHT_PT_first_steps(Side, bpy.types.Panel):
    bl_label = "First Steps"
    # As the panel of the clip, and registered after it: below that one.
    bl_order = 0

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return not Running.active and bool(actions.next_step(context.scene))

    def draw(self, context: bpy.types.Context) -> None:
        for sentence in actions.next_step(context.scene):
            draw_text(self.layout, context, sentence, icon="DOT")
        button = self.layout.operator(FACEWRIGHT_OT_manual.bl_idname, icon="HELP")
        button.page = actions.chapter(context.scene)


class FACEWRIGHT_PT_help(Side, bpy.types.Panel):
    bl_label = "Help"
    bl_options = {"DEFAULT_CLOSED"}
    bl_order = 9

    def draw(self, _context: bpy.types.Context) -> None:
        self.layout.operator(FACEWRIGHT_OT_manual.bl_idname, icon="HELP")
