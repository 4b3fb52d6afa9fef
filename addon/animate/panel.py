"""The expressions' panel."""

import bpy

from . import actions
from .operators import FACEWRIGHT_OT_expression


class FACEWRIGHT_PT_expressions(bpy.types.Panel):
    bl_label = "Expressions"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Facewright"
    bl_order = 3

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return actions.face(context.scene, context.object) is not None

    def draw(self, context: bpy.types.Context) -> None:
        face, head = actions.named_face(context.scene, context.object)
        if head:
            self.layout.label(text=head, icon="USER")
        grid = self.layout.grid_flow(columns=2, align=True)
        for name in actions.names(face):
            grid.operator(FACEWRIGHT_OT_expression.bl_idname, text=name.capitalize()).name = name
