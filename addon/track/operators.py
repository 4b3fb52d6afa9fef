"""Tracking's buttons."""

import bpy

from ..engine import Tracks
from ..jobs import Work
from ..modal import (
    ClipOperator,
    OpenOperator,
    Result,
    SaveOperator,
    WorkOperator,
    has_clip,
    has_tracks,
    reported,
    saved_as,
)
from ..running import idle
from . import actions


class FACEWRIGHT_OT_track(ClipOperator, WorkOperator, bpy.types.Operator):
    """Track points of the face through the clip, as markers"""

    bl_idname = "facewright.track"
    bl_label = "Track Face"
    bl_description = (
        "Track points of the face through the clip, as markers that can be edited. "
        "A second run replaces the tracks of the first, except those that were locked or edited"
    )
    # Not REGISTER: the redo panel would run it all again, blocking, at every change.
    bl_options = {"UNDO"}

    clip: bpy.props.StringProperty(name="Movie Clip", description="If empty, the editor's clip", options={"SKIP_SAVE"})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return idle(cls) and has_clip(cls)

    def start(self, context: bpy.types.Context) -> Work[Tracks]:
        scene, clip = context.scene, self.movie_clip(context)
        self.begin_with(clip)
        settings = actions.Settings.of(scene.facewright_track, scene.facewright_camera.text)
        return actions.tracked(actions.shown(clip, scene), settings)

    def finish(self, _context: bpy.types.Context, result: Tracks) -> str:
        return actions.place(self.begun_with(), result)


class FACEWRIGHT_OT_open_tracks(ClipOperator, OpenOperator, bpy.types.Operator):
    """Open a tracks.json of this clip as markers"""

    bl_idname = "facewright.open_tracks"
    bl_label = "Open Tracks"

    clip: bpy.props.StringProperty(name="Movie Clip", description="If empty, the editor's clip", options={"SKIP_SAVE"})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return has_clip(cls)

    def work(self, context: bpy.types.Context, path: str) -> str:
        return actions.open_file(path, self.movie_clip(context))


class FACEWRIGHT_OT_save_tracks(ClipOperator, SaveOperator, bpy.types.Operator):
    """Save the face's tracks in their current state as tracks.json, for the command line"""

    bl_idname = "facewright.save_tracks"
    bl_label = "Save Tracks"

    clip: bpy.props.StringProperty(name="Movie Clip", description="If empty, the editor's clip", options={"SKIP_SAVE"})
    filepath: saved_as("tracks.json")

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return has_tracks(cls, context)

    def work(self, context: bpy.types.Context, path: str) -> str:
        return actions.save(path, self.movie_clip(context))


class FACEWRIGHT_OT_remove_tracks(ClipOperator, bpy.types.Operator):
    """Remove the face's tracks from the clip; your own and locked ones stay"""

    bl_idname = "facewright.remove_tracks"
    bl_label = "Remove Tracks"
    bl_options = {"REGISTER", "UNDO"}

    clip: bpy.props.StringProperty(name="Movie Clip", description="If empty, the editor's clip", options={"SKIP_SAVE"})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return has_tracks(cls, context)

    def execute(self, context: bpy.types.Context) -> Result:
        return reported(self, lambda: actions.remove(self.movie_clip(context)))
