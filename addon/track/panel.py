"""Tracking's panels, in the Clip editor."""

import bpy

from ..running import Running, draw_progress, draw_said, draw_text
from ..words import say
from . import actions
from .operators import (
    FACEWRIGHT_OT_open_tracks,
    FACEWRIGHT_OT_remove_tracks,
    FACEWRIGHT_OT_save_tracks,
    FACEWRIGHT_OT_track,
)

NO_CLIP = (
    "Open the film of a face: Track Face then follows it with markers to look at and correct, "
    "and Solve Motion gives the camera's motion"
)


class Side:
    bl_space_type = "CLIP_EDITOR"
    bl_region_type = "UI"
    bl_category = "Facewright"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return is_tracking(context.space_data) and context.space_data.clip is not None


class FACEWRIGHT_PT_track(Side, bpy.types.Panel):
    bl_label = "Track"
    bl_order = 0

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        # Without a clip too: the tab says what it is for.
        return is_tracking(context.space_data)

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.layout, context.scene.facewright_track
        if context.space_data.clip is None:
            draw_text(layout, context, NO_CLIP)
            layout.operator("clip.open", text="Open…", icon="FILE_FOLDER")
            return
        layout.row().prop(settings, "span", expand=True)
        if settings.span == "CUSTOM":
            row = layout.row(align=True)
            row.prop(settings, "first")
            row.prop(settings, "last")
        layout.prop(settings, "points")
        text, wrong = actions.camera_line(context.scene.facewright_camera.text, context.space_data.clip)
        draw_text(layout, context, text, icon="ERROR" if wrong else "NONE")
        # The bar takes the button's place: a button under a resting mouse would stay grey after the work.
        if Running.operator is FACEWRIGHT_OT_track:
            draw_progress(layout)
            return
        row = layout.row()
        row.scale_y = 1.5
        row.operator(FACEWRIGHT_OT_track.bl_idname, icon="TRACKER")
        draw_said(layout, context, FACEWRIGHT_OT_track)


class FACEWRIGHT_PT_track_advanced(Side, bpy.types.Panel):
    bl_label = "Advanced"
    bl_parent_id = "FACEWRIGHT_PT_track"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.layout, context.scene.facewright_track
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.prop(settings, "method")
        row = layout.row(heading="Pattern (px)")
        row.prop(settings, "use_window", text="")
        value = row.row()
        value.active = settings.use_window
        value.prop(settings, "window", text="")


class FACEWRIGHT_PT_tracks(Side, bpy.types.Panel):
    bl_label = "Tracks"
    bl_order = 1

    def draw(self, context: bpy.types.Context) -> None:
        lines = self.layout.column(align=True)
        for line in actions.summary(context.space_data.clip) or [say("The face is not tracked yet")]:
            draw_text(lines, context, line)
        row = self.layout.row(align=True)
        row.operator(FACEWRIGHT_OT_open_tracks.bl_idname, text="Open…")
        row.operator(FACEWRIGHT_OT_save_tracks.bl_idname, text="Save…")
        row.operator(FACEWRIGHT_OT_remove_tracks.bl_idname, text="", icon="X")


def is_tracking(space: bpy.types.SpaceClipEditor) -> bool:
    """Whether the editor shows a clip's tracks, or would if it had a clip."""
    return space.mode == "TRACKING" and space.view == "CLIP"


def draw_clip_menu(self: bpy.types.Menu, context: bpy.types.Context) -> None:
    """In the Movie Clip Editor's menu: the clip that is open there."""
    clip = context.edit_movieclip
    if clip is not None:
        self.layout.operator(FACEWRIGHT_OT_track.bl_idname, text="Track Face").clip = clip.name
