"""The panel of controls."""

import bpy

from . import actions
from .operators import FACEWRIGHT_OT_add_controls, FACEWRIGHT_OT_pose_controls, FACEWRIGHT_OT_remove_controls


class FACEWRIGHT_PT_controls(bpy.types.Panel):
    bl_label = "Controls"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Facewright"
    bl_order = 3

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return actions.head(context.scene, context.object) is not None

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        made = actions.armature(context.scene, context.object)
        if made is None:
            layout.operator(FACEWRIGHT_OT_add_controls.bl_idname, icon="ARMATURE_DATA")
            if not actions.removing_complaint(context.scene, context.object):
                layout.operator(FACEWRIGHT_OT_remove_controls.bl_idname, text="Remove What Is Left", icon="X")
            return
        posed = context.mode == "POSE"
        layout.operator(
            FACEWRIGHT_OT_pose_controls.bl_idname,
            text="Leave Pose Mode" if posed else "Pose",
            icon="POSE_HLT",
            depress=posed,
        )
        if (target := actions.target(made)) is not None:
            layout.prop(target, f'["{actions.FOLLOW}"]', text="Gaze Follows Target", slider=True)
        draw_groups(layout.row(align=True), made)
        row = layout.row(align=True)
        row.operator(FACEWRIGHT_OT_add_controls.bl_idname, text="Update", icon="FILE_REFRESH")
        row.operator(FACEWRIGHT_OT_remove_controls.bl_idname, text="Remove", icon="X")


def draw_groups(row: bpy.types.UILayout, made: bpy.types.Object) -> None:
    """What of the bones is shown."""
    for group in actions.groups(made):
        row.prop(group, "is_visible", text=group.name, toggle=True)
