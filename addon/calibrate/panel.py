"""The camera's panel."""

import bpy

from ..modal import draw_text
from . import actions
from .operators import (
    FACEWRIGHT_OT_calibrate,
    FACEWRIGHT_OT_forget_camera,
    FACEWRIGHT_OT_open_camera,
    FACEWRIGHT_OT_save_board,
)


class FACEWRIGHT_PT_camera(bpy.types.Panel):
    bl_label = "Camera"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Facewright"
    bl_order = 1
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.layout, context.scene.facewright_camera
        lines = layout.column(align=True)
        for line in actions.summary(settings.text) or ["Not calibrated: the focal length is estimated"]:
            draw_text(lines, context, line)
        row = layout.row(align=True)
        row.operator(FACEWRIGHT_OT_calibrate.bl_idname)
        row.operator(FACEWRIGHT_OT_open_camera.bl_idname, text="Open")
        if settings.text:
            row.operator(FACEWRIGHT_OT_forget_camera.bl_idname, text="", icon="X")
        column = layout.column(align=True)
        column.use_property_split, column.use_property_decorate = True, False
        column.prop(settings, "columns", text="Inner Corners")
        column.prop(settings, "rows", text=" ")
        column.prop(settings, "square_mm", text="Square (mm)")
        column.prop(settings, "page")
        layout.operator(FACEWRIGHT_OT_save_board.bl_idname)
