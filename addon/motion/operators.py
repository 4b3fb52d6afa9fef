"""The motion's buttons."""

import bpy

from ..engine import Motion
from ..jobs import Work
from ..modal import (
    ClipOperator,
    OpenOperator,
    Result,
    SaveOperator,
    WorkOperator,
    clip_of,
    has_clip,
    has_tracks,
    in_object_mode,
    reported,
    saved_as,
)
from ..running import idle
from ..scene import face_tracks
from ..words import say
from . import actions


class TrackedClipOperator(ClipOperator):
    """Mix-in: the movie clip whose face was tracked."""

    def movie_clip(self, context: bpy.types.Context) -> bpy.types.MovieClip:
        """The clip that is named, or that of the editor, of the panel, or the only one that has tracks of a face."""
        clip = None if self.clip else tracked_clip(context)
        return clip if clip is not None else super().movie_clip(context)


class FACEWRIGHT_OT_motion(TrackedClipOperator, WorkOperator, bpy.types.Operator):
    """Solve the face's tracks for the motion of the camera around the head, and for the points on it"""

    bl_idname = "facewright.motion"
    bl_label = "Solve Motion"
    bl_description = (
        "Solve the face's tracks for the motion of the camera around the head, and for the points on it. "
        "A second run updates the camera, head and points of the first"
    )
    # Not REGISTER: the redo panel would run it all again, blocking, at every change.
    bl_options = {"UNDO"}

    clip: bpy.props.StringProperty(name="Movie Clip", description="If empty, the tracked one", options={"SKIP_SAVE"})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return idle(cls) and in_object_mode(cls, context) and has_tracks(cls, context)

    def start(self, context: bpy.types.Context) -> Work[Motion]:
        clip = self.movie_clip(context)
        self.begin_with(clip)
        return actions.solved(clip, actions.Settings.of(context.scene))

    def finish(self, context: bpy.types.Context, result: Motion) -> str:
        return actions.place(context.scene, self.begun_with(), result)


class FACEWRIGHT_OT_open_motion(TrackedClipOperator, OpenOperator, bpy.types.Operator):
    """Open a motion.json of this clip: camera, head and points"""

    bl_idname = "facewright.open_motion"
    bl_label = "Open Motion"

    clip: bpy.props.StringProperty(name="Movie Clip", description="If empty, the tracked one", options={"SKIP_SAVE"})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return in_object_mode(cls, context) and has_clip(cls)

    def work(self, context: bpy.types.Context, path: str) -> str:
        return actions.open_file(path, context.scene, self.movie_clip(context))


class FACEWRIGHT_OT_save_motion(SaveOperator, bpy.types.Operator):
    """Save the motion as motion.json, for the command line"""

    bl_idname = "facewright.save_motion"
    bl_label = "Save Motion"

    filepath: saved_as("motion.json")

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return has_motion(cls, context)

    def work(self, context: bpy.types.Context, path: str) -> str:
        return actions.save(path, context.scene)


class FACEWRIGHT_OT_remove_motion(bpy.types.Operator):
    """Remove the motion's camera, head and points from the scene; your own objects stay"""

    bl_idname = "facewright.remove_motion"
    bl_label = "Remove Motion"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return in_object_mode(cls, context) and has_motion(cls, context)

    def execute(self, context: bpy.types.Context) -> Result:
        actions.remove(context.scene)
        return {"FINISHED"}


class FACEWRIGHT_OT_look_through(bpy.types.Operator):
    """Look through the camera of the current frame: it becomes the scene camera, and renders get the clip's size"""

    bl_idname = "facewright.look_through"
    bl_label = "Look Through"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return has_motion(cls, context)

    def execute(self, context: bpy.types.Context) -> Result:
        return reported(self, lambda: self._look(context))

    def _look(self, context: bpy.types.Context) -> str:
        name = actions.look_through(context.scene)
        area = view(context)
        if area is not None:
            area.spaces.active.region_3d.view_perspective = "CAMERA"
        return f"{name} is the scene's camera; renders have the clip's size"


class FACEWRIGHT_OT_length_from_selection(TrackedClipOperator, bpy.types.Operator):
    """Use the two tracks selected in the Clip editor as the ends of the measured length"""

    bl_idname = "facewright.length_from_selection"
    bl_label = "Selected Tracks"
    bl_options = {"REGISTER", "UNDO"}

    clip: bpy.props.StringProperty(name="Movie Clip", description="If empty, the tracked one", options={"SKIP_SAVE"})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return has_tracks(cls, context)

    def execute(self, context: bpy.types.Context) -> Result:
        return reported(
            self, lambda: actions.selected_length(self.movie_clip(context), context.scene.facewright_motion)
        )


def tracked_clip(context: bpy.types.Context) -> bpy.types.MovieClip | None:
    """The clip of the editor, else that of the panel, else the only one with tracks of a face, else the scene's."""
    shown = getattr(context, "edit_movieclip", None) or context.scene.facewright_motion.clip
    if shown is not None:
        return shown
    tracked = [clip for clip in bpy.data.movieclips if face_tracks.face_object(clip) is not None]
    return tracked[0] if len(tracked) == 1 else clip_of(context)


def view(context: bpy.types.Context) -> bpy.types.Area | None:
    """The 3D view that a button was pressed in, or the first of the window."""
    areas = [context.area, *(context.screen.areas if context.screen is not None else [])]
    return next((area for area in areas if area is not None and area.type == "VIEW_3D"), None)


def has_motion(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether the scene has a motion; tells the artist otherwise."""
    if actions.known(context.scene) is None:
        operator.poll_message_set(say("Solve or open a motion first"))
        return False
    return True
