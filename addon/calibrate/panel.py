"""The camera's panels."""

import bpy

from ..running import Running, draw_progress, draw_said, draw_text
from ..words import say
from . import actions
from .operators import (
    FACEWRIGHT_OT_calibrate,
    FACEWRIGHT_OT_forget_camera,
    FACEWRIGHT_OT_open_camera,
    FACEWRIGHT_OT_remove_boards,
    FACEWRIGHT_OT_save_board,
    FACEWRIGHT_OT_save_calibration_picture,
    FACEWRIGHT_OT_save_camera,
    FACEWRIGHT_OT_set_clip_lens,
    FACEWRIGHT_OT_set_scene_camera,
    FACEWRIGHT_OT_show_boards,
)

# Part of the width that names take: of numbers, and of pictures.
NAMES, PICTURES = 0.42, 0.5
# The numbers that a side bar has room for beside a picture's name; the others are below the table.
HEADINGS = ("RMS", "Worst")
COLUMNS = len(HEADINGS)
# Of a longer name the end is shown: there frames of a clip differ.
LONG = 9


class Side:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Facewright"
    bl_options = {"DEFAULT_CLOSED"}


class Child(Side):
    bl_parent_id = "FACEWRIGHT_PT_camera"


class FACEWRIGHT_PT_camera(Side, bpy.types.Panel):
    bl_label = "Camera"
    bl_order = 1

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.layout, context.scene.facewright_camera
        lines = layout.column(align=True)
        for line in actions.summary(settings.text) or ["Not calibrated: the focal length is estimated"]:
            draw_text(lines, context, line)
        for warning in actions.warnings(settings.text):
            draw_text(layout, context, warning[:1].upper() + warning[1:], icon="ERROR")
        if Running.operator is FACEWRIGHT_OT_calibrate:
            draw_progress(layout)
            return
        column = layout.column(align=True)
        column.operator(FACEWRIGHT_OT_calibrate.bl_idname, text="Calibrate from Photos…", icon="IMAGE_DATA")
        clip = column.operator(FACEWRIGHT_OT_calibrate.bl_idname, text="Calibrate from Clip…", icon="FILE_MOVIE")
        clip.filter_image, clip.filter_movie = False, True
        draw_said(column, context, FACEWRIGHT_OT_calibrate)
        row = layout.row(align=True)
        row.operator(FACEWRIGHT_OT_open_camera.bl_idname, text="Open…")
        row.operator(FACEWRIGHT_OT_save_camera.bl_idname, text="Save…")
        if settings.text:
            row.operator(FACEWRIGHT_OT_forget_camera.bl_idname, text="", icon="X")


class FACEWRIGHT_PT_board(Child, bpy.types.Panel):
    bl_label = "Board"
    bl_order = 0

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.layout, context.scene.facewright_camera
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.prop(settings, "pattern")
        separate = settings.pattern == "SQUARES"
        column = layout.column(align=True)
        column.prop(settings, "columns", text="Squares" if separate else "Inner Corners")
        column.prop(settings, "rows", text=" ")
        column = layout.column(align=True)
        column.prop(settings, "square_mm", text="Square (mm)")
        if separate:
            column.prop(settings, "gap_mm", text="Gap (mm)")
        layout.prop(settings, "page")
        layout.operator(FACEWRIGHT_OT_save_board.bl_idname)


class FACEWRIGHT_UL_board_pictures(bpy.types.UIList):
    """A row for each picture of the board: its errors, and a sign where something is wrong."""

    def draw_item(
        self,
        _context: bpy.types.Context,
        layout: bpy.types.UILayout,
        _data: bpy.types.AnyType,
        item: bpy.types.PropertyGroup,
        _icon: int,
        _active_data: bpy.types.AnyType,
        _active_property: str,
    ) -> None:
        split = layout.split(factor=PICTURES)
        name = split.row(align=True)
        name.label(icon="ERROR" if item.bad else "CHECKMARK" if item.used else "REMOVE")
        name = name.row()
        name.active = item.used
        name.label(text=item.name if len(item.name) <= LONG else f"…{item.name[-LONG + 1 :]}")
        draw_cells(split, [pixels(v) if item.used else "" for v in (item.rms, item.worst)])


class FACEWRIGHT_PT_pictures(Child, bpy.types.Panel):
    bl_label = "Pictures"
    bl_order = 1

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return bool(context.scene.facewright_camera.text)

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.layout, context.scene.facewright_camera
        column = layout.column(align=True)
        for number in actions.numbers(settings.text):
            split = column.split(factor=NAMES)
            split.label(text=number.name)
            split.label(text=str(number))
        if not settings.pictures:
            return
        column = layout.column(align=True)
        head = column.row()
        split = head.split(factor=PICTURES)
        split.label(text="Error (px)")
        draw_cells(split, list(HEADINGS))
        # Above the list's scroll bar.
        head.label(icon="BLANK1")
        column.template_list(
            FACEWRIGHT_UL_board_pictures.__name__, "", settings, "pictures", settings, "active", rows=5
        )
        if settings.active < len(settings.pictures):
            draw_picture(layout.column(align=True), context, settings.pictures[settings.active])
        layout.operator(FACEWRIGHT_OT_save_calibration_picture.bl_idname, text="Save Picture…")


class FACEWRIGHT_PT_calibrated_scene(Child, bpy.types.Panel):
    bl_label = "In the Scene"
    bl_order = 2

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.layout, context.scene.facewright_camera
        column = layout.column(align=True)
        row = column.row(align=True)
        row.operator(FACEWRIGHT_OT_show_boards.bl_idname, icon="OUTLINER_OB_CAMERA")
        row.operator(FACEWRIGHT_OT_remove_boards.bl_idname, text="", icon="X")
        column.prop(settings, "wire")
        layout.operator(FACEWRIGHT_OT_set_scene_camera.bl_idname, icon="CAMERA_DATA")
        column = layout.column(align=True)
        column.template_ID(settings, "clip", open="clip.open")
        column.operator(FACEWRIGHT_OT_set_clip_lens.bl_idname, icon="TRACKER")


class FACEWRIGHT_PT_lens(Child, bpy.types.Panel):
    bl_label = "Advanced"
    bl_order = 3

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.layout, context.scene.facewright_camera
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.prop(settings, "distortion_terms")
        layout.prop(settings, "tangential")
        layout.prop(settings, "square_pixels")
        layout.prop(settings, "bend")


def draw_picture(layout: bpy.types.UILayout, context: bpy.types.Context, row: bpy.types.PropertyGroup) -> None:
    """All that is known of a picture: the table has no room for it."""
    draw_text(layout, context, row.name)
    if row.used:
        for name, value in (("RMS", row.rms), (say("Worst corner"), row.worst), (say("Held out"), row.hold_out)):
            split = layout.split(factor=NAMES)
            split.label(text=name)
            split.label(text=f"{pixels(value)} px")
    if row.reason:
        sentence = row.reason[:1].upper() + row.reason[1:]
        draw_text(layout, context, sentence, icon="ERROR" if row.bad else "INFO")


def draw_cells(layout: bpy.types.UILayout, texts: list[str]) -> None:
    """Columns of equal width, to the right."""
    row = layout.grid_flow(row_major=True, columns=len(texts), even_columns=True, align=True)
    for text in texts:
        cell = row.row()
        cell.alignment = "RIGHT"
        cell.label(text=text)


def pixels(value: float) -> str:
    """An error with as many digits as tell something."""
    return f"{value:.3f}" if value < 1.0 else f"{value:.2f}" if value < 10.0 else f"{value:.0f}"


def draw_clip_menu(self: bpy.types.Menu, context: bpy.types.Context) -> None:
    """In the Movie Clip Editor's menu: the clip that is open there."""
    clip = context.edit_movieclip
    if clip is not None:
        self.layout.separator()
        calibrate = self.layout.operator(FACEWRIGHT_OT_calibrate.bl_idname, text="Calibrate Camera from Board")
        calibrate.clip = clip.name
        lens = self.layout.operator(FACEWRIGHT_OT_set_clip_lens.bl_idname, text="Set Calibrated Lens")
        lens.clip = clip.name
