"""The panels of expressions and keys."""

import bpy

from ..options import OURS
from ..running import draw_text
from ..words import say, sentence
from . import actions
from .operators import (
    FACEWRIGHT_OT_clear_keyframes,
    FACEWRIGHT_OT_expression,
    FACEWRIGHT_OT_insert_keyframes,
    FACEWRIGHT_OT_mirror_keys,
    FACEWRIGHT_OT_reset_keys,
)


class Side:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Facewright"


class FACEWRIGHT_PT_expressions(Side, bpy.types.Panel):
    bl_label = "Expressions"
    bl_order = 3

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return actions.face(context.scene, context.object) is not None

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.layout, context.window_manager.facewright_keys
        face, head = actions.named_face(context.scene, context.object)
        if head:
            layout.label(text=head, icon="USER")
        if complaint := actions.complaint(face):
            draw_text(layout, context, sentence(complaint), icon="INFO")
        grid = layout.grid_flow(columns=2, align=True)
        for name in actions.names(face):
            button = grid.operator(FACEWRIGHT_OT_expression.bl_idname, text=name.capitalize())
            button.name = name
            # What is as usual is left out, so that the button stays one that a script, or a shortcut, can name.
            for option in actions.changed(settings):
                setattr(button, option, getattr(settings, option))
        column = layout.column(align=True)
        column.prop(settings, "strength", slider=True)
        column.row(align=True).prop(settings, "blend", expand=True)
        row = layout.row(align=True)
        row.operator(FACEWRIGHT_OT_insert_keyframes.bl_idname, icon="KEY_HLT")
        row.operator(FACEWRIGHT_OT_clear_keyframes.bl_idname, text="Clear", icon="KEY_DEHLT")


class FACEWRIGHT_PT_keys(Side, bpy.types.Panel):
    bl_label = "Keys"
    bl_translation_context = OURS
    bl_parent_id = "FACEWRIGHT_PT_expressions"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.layout, context.window_manager.facewright_keys
        face = actions.face(context.scene, context.object)
        if face.data.shape_keys is None:
            return
        column = layout.column(align=True)
        column.operator(FACEWRIGHT_OT_reset_keys.bl_idname, icon="LOOP_BACK")
        draw_mirror(column.row(align=True), "", "Mirror")
        layout.prop(settings, "search", text="", icon="VIEWZOOM")
        led = actions.led(face)
        if led:
            layout.label(text="Handles set the grey ones", icon="ARMATURE_DATA")
        if settings.search.strip():
            draw_found(layout, face, settings.search, led)
            return
        paired = actions.paired(face)
        for group, blocks in actions.groups(face).items():
            header, body = layout.panel(f"facewright_keys_{group}", default_closed=True)
            moved = sum(block.value != 0.0 for block in blocks)
            header.label(text=group_text(group, moved, len(blocks)))
            if body is not None:
                draw_group(body, group, blocks, led, any(block.name in paired for block in blocks))


def group_text(group: str, moved: int, count: int) -> str:
    """A group's name, with how many of its keys are not 0."""
    name = say(group)
    return say("{group} ({moved} of {count})", group=name, moved=moved, count=count) if moved else name


def draw_found(layout: bpy.types.UILayout, face: bpy.types.Object, text: str, led: set[str]) -> None:
    """The keys that a search finds, whatever their groups."""
    blocks = actions.found(face, text)
    if not blocks:
        layout.label(text="No key has these words", icon="INFO")
    draw_sliders(layout, blocks, led)


def draw_group(
    layout: bpy.types.UILayout, group: str, blocks: list[bpy.types.ShapeKey], led: set[str], has_sides: bool
) -> None:
    """A group's buttons and sliders."""
    row = layout.row(align=True)
    row.operator(FACEWRIGHT_OT_reset_keys.bl_idname, text="Reset", icon="LOOP_BACK").group = group
    if has_sides:
        draw_mirror(row, group, "")
    draw_sliders(layout, blocks, led)


def draw_mirror(row: bpy.types.UILayout, group: str, title: str) -> None:
    """Exchange sides, left to right, right to left."""
    ways = [
        (actions.SWAP, title, "MOD_MIRROR"),
        (actions.TO_RIGHT, "L → R", "NONE"),
        (actions.TO_LEFT, "R → L", "NONE"),
    ]
    for direction, text, icon in ways:
        button = row.operator(FACEWRIGHT_OT_mirror_keys.bl_idname, text=text, icon=icon)
        button.direction, button.group = direction, group


def draw_sliders(layout: bpy.types.UILayout, blocks: list[bpy.types.ShapeKey], led: set[str]) -> None:
    """A slider for each key, with the diamond of its keyframes; grey where handles lead it, or another file has it."""
    column = layout.column(align=True)
    for block in blocks:
        row = column.row(align=True)
        row.enabled = block.id_data.is_editable and block.name not in led
        row.prop(block, "value", text=block.name, slider=True)
        row.prop_decorator(block, "value")
