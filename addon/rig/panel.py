"""The rig's panel, below the camera's."""

import bpy

from ..running import Running, draw_progress, draw_said, draw_text
from . import actions
from .operators import (
    FACEWRIGHT_OT_add_rig_folder,
    FACEWRIGHT_OT_calibrate_rig,
    FACEWRIGHT_OT_choose_rig_camera,
    FACEWRIGHT_OT_forget_rig,
    FACEWRIGHT_OT_open_rig,
    FACEWRIGHT_OT_remove_rig_folder,
    FACEWRIGHT_OT_save_rig,
)


class FACEWRIGHT_PT_rig(bpy.types.Panel):
    bl_label = "Several Cameras"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Facewright"
    bl_parent_id = "FACEWRIGHT_PT_camera"
    bl_options = {"DEFAULT_CLOSED"}
    bl_order = 4

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.layout, context.scene.facewright_rig
        column = layout.column(align=True)
        for index, folder in enumerate(settings.folders):
            row = column.row(align=True)
            row.prop(folder, "name", text="")
            row.prop(folder, "path", text="")
            row.operator(FACEWRIGHT_OT_remove_rig_folder.bl_idname, text="", icon="X").index = index
        column.operator(FACEWRIGHT_OT_add_rig_folder.bl_idname, icon="ADD")
        # The bar takes the button's place: a button under a resting mouse would stay grey after the work.
        if Running.operator is FACEWRIGHT_OT_calibrate_rig:
            draw_progress(layout)
            return
        layout.operator(FACEWRIGHT_OT_calibrate_rig.bl_idname, icon="CAMERA_STEREO")
        draw_said(layout, context, FACEWRIGHT_OT_calibrate_rig)
        row = layout.row(align=True)
        row.operator(FACEWRIGHT_OT_open_rig.bl_idname, text="Open…")
        row.operator(FACEWRIGHT_OT_save_rig.bl_idname, text="Save…")
        if settings.text:
            row.operator(FACEWRIGHT_OT_forget_rig.bl_idname, text="", icon="X")
        draw_rig(layout, context)


def draw_rig(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """What was calibrated, and the camera that filmed the clip."""
    text = context.scene.facewright_rig.text
    lines = layout.column(align=True)
    for line in actions.summary(text):
        draw_text(lines, context, line)
    for warning in actions.warnings(text):
        draw_text(layout, context, warning[:1].upper() + warning[1:], icon="ERROR")
    names = actions.names(text)
    if not names:
        return
    column, used = layout.column(align=True), actions.chosen(context.scene)
    column.label(text="The clip was filmed with")
    for name in names:
        button = column.operator(FACEWRIGHT_OT_choose_rig_camera.bl_idname, text=name, depress=name == used)
        button.name = name
