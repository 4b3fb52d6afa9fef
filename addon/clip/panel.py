"""The frames of the clip in the panel."""

import bpy

from ..running import draw_text
from ..scene.source import source_of
from ..scene.strips import Strip, fate_of, icon
from ..scene.thumbnails import Fate
from ..words import say, sentence
from . import actions
from .operators import (
    FACEWRIGHT_OT_frames_from_timeline,
    FACEWRIGHT_OT_open_recent_clip,
    FACEWRIGHT_OT_pick_frame,
    FACEWRIGHT_OT_survey,
    FACEWRIGHT_OT_use_all_frames,
)

# Width of a frame of the strip at scale 1, pixels; its height in lines.
WIDTH_PX, LINES = 54, 2.7
# How many frames stand beside each other, at least and at most.
FEWEST, MOST = 3, 8


class FACEWRIGHT_MT_recent_clips(bpy.types.Menu):
    """The clips that were chosen last"""

    bl_label = "Recent Clips"

    def draw(self, _context: bpy.types.Context) -> None:
        clips = actions.recent()
        if not clips:
            self.layout.label(text="No clip was opened yet")
        for number, label in enumerate(clips):
            self.layout.operator(FACEWRIGHT_OT_open_recent_clip.bl_idname, text=label).number = number


class FACEWRIGHT_PT_frames(bpy.types.Panel):
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Facewright"
    bl_label = "Frames"
    bl_parent_id = "FACEWRIGHT_PT_clip"
    # It folds by a property of its own, which a head that was made clears.
    bl_options = {"HIDE_HEADER"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        settings = context.scene.facewright_clip
        return bool(settings.path) and settings.frames != 0 and actions.readable(settings)

    def draw(self, context: bpy.types.Context) -> None:
        settings = context.scene.facewright_clip
        header, layout = self.layout.panel_prop(settings, "show_frames")
        header.label(text="Frames")
        if layout is None:
            return
        draw_part(layout, settings)
        strip = actions.strip_of(settings)
        if strip is None:
            text = say("Looking…") if actions.is_looking(settings) else FACEWRIGHT_OT_survey.bl_label
            layout.operator(FACEWRIGHT_OT_survey.bl_idname, text=text, icon="VIEWZOOM")
            return
        draw_check(layout, context, strip)
        draw_strip(layout, context, strip)
        if settings.use_range:
            layout.operator(FACEWRIGHT_OT_survey.bl_idname, text="Look Closer", icon="ZOOM_IN").part = True


def draw_part(layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup) -> None:
    """First and last frame, by number or from the timeline."""
    row = layout.row(align=True)
    row.prop(settings, "use_range")
    row.operator(FACEWRIGHT_OT_use_all_frames.bl_idname, text="", icon="LOOP_BACK")
    take = FACEWRIGHT_OT_frames_from_timeline.bl_idname
    row.operator(take, text="", icon="PREVIEW_RANGE").which = "RANGE"
    if settings.use_range:
        row = layout.row(align=True)
        row.prop(settings, "shown_first")
        row.operator(take, text="", icon="TIME").which = "FIRST"
        row.prop(settings, "shown_last")
        row.operator(take, text="", icon="TIME").which = "LAST"


def draw_strip(layout: bpy.types.UILayout, context: bpy.types.Context, strip: Strip) -> None:
    """The frames that are shown, each with its number, which is a button."""
    settings = context.scene.facewright_clip
    row = layout.row(align=True)
    row.prop(settings, "click", expand=True)
    row.operator(FACEWRIGHT_OT_survey.bl_idname, text="", icon="FILE_REFRESH")
    frames, width = source_of(settings), context.region.width / context.preferences.system.ui_scale
    columns = min(max(int(width / WIDTH_PX), FEWEST), MOST)
    grid = layout.grid_flow(row_major=True, columns=columns, even_columns=True, even_rows=True, align=True)
    for look in strip.shown():
        fate, number = fate_of(frames, strip, look), strip.number(look)
        cell = grid.column(align=True)
        cell.template_icon(icon_value=icon(strip, look, fate), scale=LINES)
        text = str(actions.shown_number(settings, number))
        button = cell.operator(FACEWRIGHT_OT_pick_frame.bl_idname, text=text, depress=fate is not Fate.LEFT_OUT)
        button.number = number


def draw_check(layout: bpy.types.UILayout, context: bpy.types.Context, strip: Strip) -> None:
    """What the frames that are used show, and what they lack."""
    survey = strip.part(source_of(context.scene.facewright_clip))
    for found in survey.summary:
        draw_text(layout, context, sentence(found))
    for _, found in survey.findings:
        draw_text(layout, context, sentence(found), icon="ERROR")
