"""The reconstruction's panels."""

import bpy

from ..clip.operators import FACEWRIGHT_OT_open_clip
from ..help.operators import FACEWRIGHT_OT_open_report
from ..modal import draw_pupils
from ..options import OURS
from ..running import Running, draw_progress, draw_said, draw_text
from ..words import sentence
from . import actions
from .operators import FACEWRIGHT_OT_reconstruct


class Side:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Facewright"


class FACEWRIGHT_PT_clip(Side, bpy.types.Panel):
    bl_label = "Reconstruct"
    bl_order = 0

    def draw(self, context: bpy.types.Context) -> None:
        layout, clip = self.layout, context.scene.facewright_clip
        row = layout.row(align=True)
        row.operator(FACEWRIGHT_OT_open_clip.bl_idname, text="Open Clip…", icon="FILE_MOVIE")
        row.menu("FACEWRIGHT_MT_recent_clips", text="", icon="DOWNARROW_HLT")
        layout.prop(clip, "path", text="", placeholder="Video or folder")
        text, is_usable = actions.length_line(clip) or ("", True)
        if not is_usable:
            draw_text(layout, context, text, icon="ERROR")
        elif text:
            layout.label(text=text)
        if len(choices := actions.choices(context.scene)) > 1:
            layout.label(text=choices[actions.chosen(context.scene)][1], icon="FILE_REFRESH")
        # The bar takes the button's place: a button under a resting mouse would stay grey after the work.
        if Running.operator is FACEWRIGHT_OT_reconstruct:
            draw_progress(layout)
            return
        row = layout.row()
        row.scale_y = 1.5
        row.operator(FACEWRIGHT_OT_reconstruct.bl_idname, icon="USER")
        draw_said(layout, context, FACEWRIGHT_OT_reconstruct)


class FACEWRIGHT_PT_advanced(Side, bpy.types.Panel):
    bl_label = "Advanced"
    bl_parent_id = "FACEWRIGHT_PT_clip"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout, clip = self.layout, context.scene.facewright_clip
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.prop(clip, "method")
        layout.prop(clip, "texture_size")
        dense = layout.row()
        dense.active = clip.method == "default"
        dense.prop(clip, "dense")
        draw_pupils(layout, context.scene.facewright_person)
        layout.prop(clip, "use_face")
        if clip.use_face:
            layout.prop(clip, "face")
        layout.prop(clip, "output", placeholder="Optional")
        self.draw_markers(context)

    def draw_markers(self, context: bpy.types.Context) -> None:
        """The choice is shown where a clip has markers, and stays in reach while it is on."""
        layout, clip = self.layout, context.scene.facewright_clip
        if not (clip.use_markers or actions.any_markers()):
            return
        complaint = actions.markers_complaint(bpy.path.abspath(clip.path), clip.method)
        row = layout.row()
        row.active = not complaint
        row.prop(clip, "use_markers")
        if complaint:
            draw_text(layout, context, sentence(complaint), icon="INFO")


class FACEWRIGHT_PT_report(Side, bpy.types.Panel):
    bl_label = "Report"
    bl_translation_context = OURS
    bl_order = 2

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return actions.report(context.scene, context.object) is not None

    def draw(self, context: bpy.types.Context) -> None:
        shown = actions.report(context.scene, context.object)
        assert shown is not None, "poll has seen it"
        head, text = shown
        if head:
            self.layout.label(text=head, icon="USER")
        if quality := actions.quality(text):
            self.layout.label(text=quality[0], icon=quality[1])
        column = self.layout.column(align=True)
        for line in actions.report_lines(text):
            draw_text(column, context, line)
        for said in actions.shown_kept(context.scene, context.object):
            draw_text(self.layout, context, sentence(said), icon="INFO")
        for warning in actions.warnings(text):
            draw_text(self.layout, context, sentence(warning), icon="ERROR")
        self.layout.operator(FACEWRIGHT_OT_open_report.bl_idname, icon="TEXT")


def draw_menu(self: bpy.types.Menu, _context: bpy.types.Context) -> None:
    """In Add → Mesh, so that the menu search finds it."""
    self.layout.operator(FACEWRIGHT_OT_reconstruct.bl_idname, icon="USER")
