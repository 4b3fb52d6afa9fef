"""The list of a scene's heads."""

from typing import ClassVar

import bpy

from ..running import draw_text
from ..words import say
from . import actions
from .operators import (
    FACEWRIGHT_OT_choose_head,
    FACEWRIGHT_OT_duplicate_head,
    FACEWRIGHT_OT_mark_head,
    FACEWRIGHT_OT_remove_head,
)

# With its handle, the list is as high as the three buttons beside it; it grows with the heads.
ROWS, MOST_ROWS = 2, 5


class FACEWRIGHT_UL_heads(bpy.types.UIList):
    """Those of a scene's objects that stand for heads."""

    # While the panel is drawn, and no longer: looking for heads at every row would take long in a large scene.
    rows: ClassVar[dict[bpy.types.Object, actions.Row]] = {}

    def draw_item(
        self,
        _context: bpy.types.Context,
        layout: bpy.types.UILayout,
        _data: bpy.types.Scene,
        item: bpy.types.Object,
        _icon: int,
        _active_data: bpy.types.PropertyGroup,
        _active_name: str,
    ) -> None:
        row = FACEWRIGHT_UL_heads.rows[item]
        preview = row.home.preview if row.home is not None else None
        if preview is not None and preview.icon_size[0] > 0:
            layout.label(text="", icon_value=preview.icon_id)
        else:
            layout.label(text="", icon="USER")
        if row.complaint:
            layout.label(text=item.name)
            layout.label(text="", icon="LINKED")
        else:
            layout.prop(item, "facewright_title", text="", emboss=False)
        if row.is_asset:
            layout.label(text="", icon="ASSET_MANAGER")
        if row.is_next:
            layout.label(text="", icon="FILE_REFRESH")

    def filter_items(
        self, _context: bpy.types.Context, data: bpy.types.Scene, name: str
    ) -> tuple[list[int], list[int]]:
        shown = FACEWRIGHT_UL_heads.rows
        return [self.bitflag_filter_item if obj in shown else 0 for obj in getattr(data, name)], []

    def draw_filter(self, _context: bpy.types.Context, _layout: bpy.types.UILayout) -> None:
        """Without Blender's: there are never many heads."""


class FACEWRIGHT_PT_heads(bpy.types.Panel):
    bl_label = "Heads"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Facewright"
    bl_order = -1

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        found = actions.listed(context.scene)
        return bool(found.rows or found.left)

    def draw(self, context: bpy.types.Context) -> None:
        layout, scene = self.layout, context.scene
        found = actions.listed(scene)
        current = found.current(context.object, scene.facewright_clip.wanted)
        row = layout.row()
        listed = row.column()
        # Blender keeps an object in Edit Mode active.
        listed.enabled = context.mode == "OBJECT"
        FACEWRIGHT_UL_heads.rows = {row.obj: row for row in found.rows}
        listed.template_list(
            "FACEWRIGHT_UL_heads", "", scene, "objects", scene.facewright_heads, "index", rows=ROWS, maxrows=MOST_ROWS
        )
        FACEWRIGHT_UL_heads.rows = {}
        column = row.column(align=True)
        is_new = actions.is_new_next(scene)
        column.operator(FACEWRIGHT_OT_choose_head.bl_idname, text="", icon="ADD", depress=is_new)
        column.operator(FACEWRIGHT_OT_duplicate_head.bl_idname, text="", icon="DUPLICATE")
        column.operator(FACEWRIGHT_OT_remove_head.bl_idname, text="", icon="REMOVE")
        for head in found.left:
            line = layout.row()
            line.label(text=say("{head}: no skin", head=head.name), icon="USER")
            line.operator(FACEWRIGHT_OT_choose_head.bl_idname, text="Make Anew").head = head.key
        if current is None:
            return
        if current.complaint:
            draw_text(layout, context, current.complaint, icon="LINKED")
        elif current.is_asset:
            layout.operator(FACEWRIGHT_OT_mark_head.bl_idname, text="Clear Asset", icon="ASSET_MANAGER").clear = True
        else:
            layout.operator(FACEWRIGHT_OT_mark_head.bl_idname, icon="ASSET_MANAGER")
