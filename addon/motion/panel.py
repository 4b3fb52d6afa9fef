"""The motion's panels: in the 3D view, and beside the tracks in the Clip editor."""

import bpy

from ..modal import draw_pupils
from ..running import Running, draw_progress, draw_said, draw_text
from ..scene import face_tracks
from . import actions
from .operators import (
    FACEWRIGHT_OT_length_from_selection,
    FACEWRIGHT_OT_look_through,
    FACEWRIGHT_OT_motion,
    FACEWRIGHT_OT_open_motion,
    FACEWRIGHT_OT_remove_motion,
    FACEWRIGHT_OT_save_motion,
    tracked_clip,
)


class Side:
    bl_label = "Motion"
    bl_region_type = "UI"
    bl_category = "Facewright"
    bl_order = 2


class FACEWRIGHT_PT_motion(Side, bpy.types.Panel):
    bl_space_type = "VIEW_3D"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        if len(bpy.data.movieclips) > 1:
            self.layout.prop(context.scene.facewright_motion, "clip", text="")
        draw_motion(self.layout, context)


class FACEWRIGHT_PT_clip_motion(Side, bpy.types.Panel):
    bl_space_type = "CLIP_EDITOR"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        space = context.space_data
        return space.mode == "TRACKING" and space.view == "CLIP" and space.clip is not None

    def draw(self, context: bpy.types.Context) -> None:
        draw_motion(self.layout, context)


def draw_motion(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Settings, the button and what was found."""
    settings = context.scene.facewright_motion
    layout.prop(settings, "kind", text="")
    if settings.kind == "CAMERAS":
        layout.prop(settings, "key_turn")
    if settings.kind == "HEAD":
        layout.prop(settings, "follow")
    column = layout.column()
    column.use_property_split, column.use_property_decorate = True, False
    draw_pupils(column, context.scene.facewright_person)
    draw_length(layout, settings, tracked_clip(context))
    # The bar takes the button's place: a button under a resting mouse would stay grey after the work.
    if Running.operator is FACEWRIGHT_OT_motion:
        draw_progress(layout)
        return
    row = layout.row()
    row.scale_y = 1.5
    row.operator(FACEWRIGHT_OT_motion.bl_idname, icon="CON_CAMERASOLVER")
    draw_said(layout, context, FACEWRIGHT_OT_motion)
    row = layout.row(align=True)
    row.operator(FACEWRIGHT_OT_open_motion.bl_idname, text="Open…")
    row.operator(FACEWRIGHT_OT_save_motion.bl_idname, text="Save…")
    row.operator(FACEWRIGHT_OT_remove_motion.bl_idname, text="", icon="X")
    draw_result(layout, context)


def draw_length(
    layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup, clip: bpy.types.MovieClip | None
) -> None:
    """A length that was measured on the head, between two tracks."""
    layout.prop(settings, "use_length")
    face = face_tracks.face_object(clip) if settings.use_length and clip is not None else None
    if face is None:
        return
    column = layout.column(align=True)
    column.prop_search(settings, "length_from", face, "tracks", text="", icon="TRACKER")
    column.prop_search(settings, "length_to", face, "tracks", text="", icon="TRACKER")
    column.prop(settings, "length_mm", text="mm")
    column.operator(FACEWRIGHT_OT_length_from_selection.bl_idname)


def draw_result(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """What was found, and what to distrust."""
    motion = actions.known(context.scene)
    if motion is None:
        return
    # Blender takes the first thing without a command for the bar that was here, and marks it: let it be a gap, unseen.
    layout.separator(factor=0.1)
    layout.operator(FACEWRIGHT_OT_look_through.bl_idname, icon="OUTLINER_OB_CAMERA")
    column = layout.column(align=True)
    for line in actions.summary(motion):
        draw_text(column, context, line)
    column = layout.column(align=True)
    for line in actions.complaints(motion):
        draw_text(column, context, line)
    for warning in motion.warnings:
        draw_text(layout, context, warning[:1].upper() + warning[1:], icon="ERROR")


def draw_clip_menu(self: bpy.types.Menu, context: bpy.types.Context) -> None:
    """In the Movie Clip Editor's menu: the clip that is open there."""
    clip = context.edit_movieclip
    if clip is not None:
        self.layout.operator(FACEWRIGHT_OT_motion.bl_idname, text="Solve Face Motion").clip = clip.name
