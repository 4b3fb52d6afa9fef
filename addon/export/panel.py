"""Where *Export Head* is: the side bar, and File → Export."""

import bpy

from . import actions
from .operators import FACEWRIGHT_OT_export


class FACEWRIGHT_PT_export(bpy.types.Panel):
    bl_label = "Export"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Facewright"
    bl_order = 4

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return actions.head(context.scene, context.object) is not None

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.operator(FACEWRIGHT_OT_export.bl_idname, text="Export Head…", icon="EXPORT")


def draw_export_menu(self: bpy.types.Menu, _context: bpy.types.Context) -> None:
    """In File → Export."""
    self.layout.operator(FACEWRIGHT_OT_export.bl_idname, text="Facewright Head (.glb/.fbx/.usd/.abc)")
