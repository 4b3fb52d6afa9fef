"""The buttons around the choice of a clip."""

from typing import Any

import bpy

from ..engine import FacewrightError
from ..jobs import Work
from ..modal import Result, WorkOperator, reported
from ..options import BLEND_RELATIVE
from ..running import idle
from ..scene.footage import PICTURES
from ..scene.source import Source, source_of
from ..scene.strips import Strip
from ..scene.video import VIDEOS
from ..scene.view import redraw
from ..words import say
from . import actions
from .options import CLICKS


class FACEWRIGHT_OT_survey(WorkOperator, bpy.types.Operator):
    """Look at frames of the clip: show them, and say whether a head can be made of it"""

    bl_idname = "facewright.survey"
    bl_label = "Look at Clip"

    part: bpy.props.BoolProperty(
        name="Part Alone", description="Look at the chosen part of the clip alone, and closer", options={"SKIP_SAVE"}
    )
    _frames: Source | None = None

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not context.scene.facewright_clip.path:
            cls.poll_message_set(say("Choose a clip first"))
            return False
        return idle(cls)

    def start(self, context: bpy.types.Context) -> Work[Strip]:
        frames = source_of(context.scene.facewright_clip)
        self._frames = Source(frames.path, frames.span if self.part else None, frames.pictures)
        return actions.surveyed(self._frames, context.scene.facewright_camera.text or None)

    def _deliver(self, context: bpy.types.Context) -> Result:
        """At once: nothing in the file changes that a drag or another mode could be mixed with."""
        assert self._given is not None
        (given,) = self._given
        self._end(context, cancelled=False)
        return self._said(lambda: self.finish(context, given))

    def finish(self, context: bpy.types.Context, result: Strip) -> str:
        assert self._frames is not None, "start has set it"
        actions.keep(self._frames, result)
        redraw()
        survey = result.part(source_of(context.scene.facewright_clip))
        return "; ".join([*survey.summary, *(sentence for _, sentence in survey.findings)])


class FACEWRIGHT_OT_pick_frame(bpy.types.Operator):
    """Take this frame as the first or last one, or leave it out"""

    bl_idname = "facewright.pick_frame"
    bl_label = "Pick Frame"
    bl_options = {"UNDO", "INTERNAL"}

    number: bpy.props.IntProperty(name="Frame", description="Number in the clip, counted from 0", min=0)

    @classmethod
    def description(cls, context: bpy.types.Context, properties: Any) -> str:
        settings = context.scene.facewright_clip
        about = actions.about(settings, properties.number)
        return ". ".join(filter(None, [about, next(text for name, _, text in CLICKS if name == settings.click)]))

    def execute(self, context: bpy.types.Context) -> Result:
        return reported(self, lambda: actions.pick(context.scene.facewright_clip, self.number))


class FACEWRIGHT_OT_frames_from_timeline(bpy.types.Operator):
    """Take frames from the timeline"""

    bl_idname = "facewright.frames_from_timeline"
    bl_label = "From Timeline"
    bl_options = {"UNDO"}

    which: bpy.props.EnumProperty(
        items=[
            ("FIRST", "First", "The clip's frame at the timeline's present one begins the part that is used"),
            ("LAST", "Last", "The clip's frame at the timeline's present one ends the part that is used"),
            ("RANGE", "Both", "The preview range is the part that is used, or the scene's range where there is none"),
        ],
        default="RANGE",
    )

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: Any) -> str:
        return cls.bl_rna.properties["which"].enum_items[properties.which].description

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not context.scene.facewright_clip.path:
            cls.poll_message_set(say("Choose a clip first"))
            return False
        return True

    def execute(self, context: bpy.types.Context) -> Result:
        return reported(self, lambda: actions.from_timeline(context.scene, self.which))


class FACEWRIGHT_OT_use_all_frames(bpy.types.Operator):
    """Use all frames of the clip again: none is left out, and it is no part"""

    bl_idname = "facewright.use_all_frames"
    bl_label = "Use All Frames"
    bl_options = {"UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        settings = context.scene.facewright_clip
        if not (settings.use_range or settings.left_out):
            cls.poll_message_set(say("All frames are used"))
            return False
        return True

    def execute(self, context: bpy.types.Context) -> Result:
        settings = context.scene.facewright_clip
        settings.left_out, settings.use_range = "", False
        return {"FINISHED"}


class FACEWRIGHT_OT_open_clip(bpy.types.Operator):
    """Choose a video, a folder of pictures, or some pictures of the head from several sides"""

    bl_idname = "facewright.open_clip"
    bl_label = "Open Clip"
    bl_options = {"UNDO"}

    filepath: bpy.props.StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE", "HIDDEN"} | BLEND_RELATIVE)
    directory: bpy.props.StringProperty(subtype="DIR_PATH", options={"SKIP_SAVE", "HIDDEN"} | BLEND_RELATIVE)
    files: bpy.props.CollectionProperty(type=bpy.types.OperatorFileListElement, options={"SKIP_SAVE", "HIDDEN"})
    relative_path: bpy.props.BoolProperty(
        name="Relative Path", description="Store the path relative to the blend file, once that is saved"
    )
    filter_folder: bpy.props.BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    filter_image: bpy.props.BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    filter_movie: bpy.props.BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> Result:
        if not self.properties.is_property_set("relative_path"):
            self.relative_path = context.preferences.filepaths.use_relative_paths
        # Files that were dropped are known.
        if any(file.name for file in self.files):
            return self.execute(context)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> Result:
        return reported(self, lambda: self._choose(context))

    def _choose(self, context: bpy.types.Context) -> str:
        names = [file.name for file in self.files if file.name]
        folder = bpy.path.abspath(self.directory or self.filepath)
        if not folder:
            raise FacewrightError("choose a video, a folder or pictures")
        return actions.choose(context.scene.facewright_clip, folder, names, self.relative_path)


class FACEWRIGHT_OT_open_recent_clip(bpy.types.Operator):
    """Choose this clip again"""

    bl_idname = "facewright.open_recent_clip"
    bl_label = "Recent Clip"
    bl_options = {"UNDO", "INTERNAL"}

    number: bpy.props.IntProperty(name="Clip", description="Row in the list of recent clips", min=0)

    def execute(self, context: bpy.types.Context) -> Result:
        return reported(self, lambda: actions.choose_recent(context.scene.facewright_clip, self.number))


class FACEWRIGHT_FH_clip(bpy.types.FileHandler):
    """A video or pictures that are dropped into the 3D view."""

    bl_label = "Facewright Clip"
    bl_import_operator = FACEWRIGHT_OT_open_clip.bl_idname
    bl_file_extensions = ";".join(sorted(VIDEOS | PICTURES))

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        return context.area is not None and context.area.type == "VIEW_3D"
