"""Tracking's buttons."""

import bpy

from ..engine import FacewrightError
from ..jobs import Work
from ..modal import FileOperator, Result, WorkOperator, idle
from ..scene import face_tracks
from . import actions


class ClipOperator:
    """Mix-in: the movie clip that an operator works on."""

    clip: str

    def movie_clip(self, context: bpy.types.Context) -> bpy.types.MovieClip:
        """The clip that is named, or that of the editor."""
        clip = bpy.data.movieclips.get(self.clip) if self.clip else clip_of(context)
        if clip is None:
            none = f"there is no movie clip {self.clip}" if self.clip else "no movie clip is shown"
            raise FacewrightError(f"{none}: open it in the Clip editor")
        return clip


class FACEWRIGHT_OT_track(ClipOperator, WorkOperator, bpy.types.Operator):
    """Track points of the face through the clip, as markers that can be edited.

    A second run replaces the tracks of the first, but those that were locked or edited"""

    bl_idname = "facewright.track"
    bl_label = "Track Face"
    # Not REGISTER: the redo panel would run it all again, blocking, at every change.
    bl_options = {"UNDO"}

    clip: bpy.props.StringProperty(name="Movie Clip", description="The editor's if empty", options={"SKIP_SAVE"})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return idle(cls) and has_clip(cls)

    def start(self, context: bpy.types.Context) -> Work[str]:
        scene, clip = context.scene, self.movie_clip(context)
        # The editor may show another clip by the time the work is done.
        self.clip = clip.name
        settings = actions.Settings.of(scene.facewright_track, scene.facewright_camera.text)
        return actions.tracked(actions.shown(clip, scene), settings)

    def finish(self, context: bpy.types.Context, result: str) -> str:
        return actions.place(self.movie_clip(context), result)


class FACEWRIGHT_OT_open_tracks(ClipOperator, FileOperator, bpy.types.Operator):
    """Open a tracks.json of this clip as markers"""

    bl_idname = "facewright.open_tracks"
    bl_label = "Open Tracks"
    bl_options = {"REGISTER", "UNDO"}

    clip: bpy.props.StringProperty(name="Movie Clip", description="The editor's if empty", options={"SKIP_SAVE"})
    filepath: bpy.props.StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE"})
    filter_glob: bpy.props.StringProperty(default="*.json", options={"HIDDEN"})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return has_clip(cls)

    def work(self, context: bpy.types.Context, path: str) -> str:
        return actions.open_file(path, self.movie_clip(context))


class FACEWRIGHT_OT_save_tracks(ClipOperator, FileOperator, bpy.types.Operator):
    """Save the face's tracks as they are now as tracks.json, for the command line"""

    bl_idname = "facewright.save_tracks"
    bl_label = "Save Tracks"
    bl_options = {"REGISTER"}

    clip: bpy.props.StringProperty(name="Movie Clip", description="The editor's if empty", options={"SKIP_SAVE"})
    filepath: bpy.props.StringProperty(subtype="FILE_PATH", default="tracks.json", options={"SKIP_SAVE"})
    filter_glob: bpy.props.StringProperty(default="*.json", options={"HIDDEN"})
    check_existing: bpy.props.BoolProperty(default=True, options={"HIDDEN"})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return has_tracks(cls, context)

    def work(self, context: bpy.types.Context, path: str) -> str:
        return actions.save(path, self.movie_clip(context))


class FACEWRIGHT_OT_remove_tracks(ClipOperator, bpy.types.Operator):
    """Take the face's tracks out of the clip; your own and those that are locked stay"""

    bl_idname = "facewright.remove_tracks"
    bl_label = "Remove Tracks"
    bl_options = {"REGISTER", "UNDO"}

    clip: bpy.props.StringProperty(name="Movie Clip", description="The editor's if empty", options={"SKIP_SAVE"})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return has_tracks(cls, context)

    def execute(self, context: bpy.types.Context) -> Result:
        try:
            message = actions.remove(self.movie_clip(context))
        except FacewrightError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, message)
        return {"FINISHED"}


def clip_of(context: bpy.types.Context) -> bpy.types.MovieClip | None:
    """The clip that the Clip editor shows; elsewhere the scene's, or the only one."""
    clips = bpy.data.movieclips
    alone = clips[0] if len(clips) == 1 else None
    return getattr(context, "edit_movieclip", None) or context.scene.active_clip or alone


def has_clip(operator: type[bpy.types.Operator]) -> bool:
    """Whether there is any clip; tells the artist otherwise."""
    if not bpy.data.movieclips:
        operator.poll_message_set("Open a movie clip first")
        return False
    return True


def has_tracks(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether the clip shown, or where none is shown any, has tracks of a face; tells the artist otherwise."""
    shown = getattr(context, "edit_movieclip", None)
    clips = [shown] if shown is not None else bpy.data.movieclips
    if not any(face_tracks.counts(clip) for clip in clips):
        operator.poll_message_set("Track the face first")
        return False
    return True
