"""What operators have in common: work that goes on while the artist looks on, files that are asked for, movie clips."""

import traceback
from collections.abc import Callable
from typing import Any, ClassVar

import bpy

from .delivery import busy_with, leave_modes, scene_of
from .engine import Cancelled, FacewrightError
from .jobs import POLL_SECONDS, Work, wait
from .options import BLEND_RELATIVE
from .running import STARTING, Running, Said
from .scene import face_tracks
from .scene.view import redraw
from .words import say

Result = set[str]


class WorkOperator:
    """Mix-in: `start` gives the work, `finish` changes the data in one step and gives the message.

    Meanwhile `show` may draw what there is of the result, and `hide` takes that away, `cancelled` or as the result
    comes.
    What was said stays in the panel: the message, or the part of it that `finish` has put into `stays`.
    """

    stays = ""
    _work: Work[Any] | None = None
    # What the work gave, until Blender can take it.
    _given: tuple[Any] | None = None
    _timer: bpy.types.Timer | None = None
    # The scene in which it began, by the number that it keeps over undo and renaming.
    _scene = 0
    # Of `bpy.types.Operator`, the other base.
    report: Callable[[set[str], str], None]

    def start(self, context: bpy.types.Context) -> Work[Any]:
        raise NotImplementedError

    def finish(self, context: bpy.types.Context, result: Any) -> str:
        raise NotImplementedError

    def show(self, context: bpy.types.Context, sketch: Any) -> None:
        """Draw a sketch of the result; a sketch is whatever the work yields as one."""

    def hide(self, context: bpy.types.Context, cancelled: bool) -> None:
        """Take the sketch away."""

    def execute(self, context: bpy.types.Context) -> Result:
        return self._said(lambda: self.finish(context, wait(self.start(context))))

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> Result:
        if bpy.app.background:
            return self.execute(context)
        try:
            self._work = self.start(context)
        except FacewrightError as error:
            return self._say("ERROR", str(error))
        self._scene = context.scene.session_uid
        Running.begin(type(self))
        self._timer = context.window_manager.event_timer_add(POLL_SECONDS, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> Result:
        if event.type == "ESC" and event.value == "PRESS":
            self._end(context)
            return self._say("INFO", "Cancelled; nothing was changed")
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            return self._advance(context) if self._given is None else self._deliver(context)
        except Exception as error:  # noqa: BLE001 — Blender would call what fails again, at every event
            traceback.print_exc()
            self._end(context)
            self._say("ERROR", f"Facewright has failed, undo takes back what it has changed: {error!r}")
            return {"CANCELLED"} if self._given is None else {"FINISHED"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender closes or loads a file."""
        self._end(context)

    def _advance(self, context: bpy.types.Context) -> Result:
        assert self._work is not None
        try:
            progress = next(self._work)
        except StopIteration as end:
            self._given = (end.value,)
            return self._deliver(context)
        except FacewrightError as error:
            self._end(context)
            return self._say("INFO" if isinstance(error, Cancelled) else "ERROR", str(error))
        Running.advance(progress)
        if progress.sketch is not None:
            self.show(context, progress.sketch)
        redraw()
        return {"RUNNING_MODAL"}

    def _deliver(self, context: bpy.types.Context) -> Result:
        """Finish, unless what is shown or dragged now would be pulled away; in the scene in which the work began."""
        assert self._given is not None
        if busy := busy_with(context):
            Running.advance(STARTING._replace(stage=busy, fraction=1.0))
            redraw()
            return {"RUNNING_MODAL"}
        (given,) = self._given
        self._end(context, cancelled=False)
        left = leave_modes(context)
        where, said = scene_of(context, self._scene)
        with context.temp_override(**where):
            return self._said(lambda: "; ".join([self.finish(context, given), *said, *left]))

    def _said(self, action: Callable[[], str]) -> Result:
        """Do what gives a message, and say that, or what is wrong."""
        try:
            message = action()
        except FacewrightError as error:
            return self._say("ERROR", str(error))
        self._say("INFO", message)
        return {"FINISHED"}

    def _say(self, kind: str, text: str) -> Result:
        self.report({kind}, text)
        Running.said[type(self)] = Said(kind, text if kind == "ERROR" else self.stays or text)
        return {"CANCELLED"}

    def _end(self, context: bpy.types.Context, cancelled: bool = True) -> None:
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None
        Running.end()
        self.hide(context, cancelled)
        work, self._work = self._work, None
        if work is not None:
            work.close()
        redraw()


class FileOperator:
    """Mix-in: asks for a path, then `work` reads or writes it and gives the message."""

    filepath: str

    def work(self, context: bpy.types.Context, path: str) -> str:
        raise NotImplementedError

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> Result:
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> Result:
        return reported(self, lambda: self.work(context, bpy.path.abspath(self.filepath)))


class OpenOperator(FileOperator):
    """Mix-in: opens one of the library's JSON files."""

    bl_options: ClassVar[set[str]] = {"REGISTER", "UNDO"}

    filepath: bpy.props.StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE"} | BLEND_RELATIVE)
    filter_glob: bpy.props.StringProperty(default="*.json", options={"HIDDEN"})


class SaveOperator(FileOperator):
    """Mix-in: saves one of the library's JSON files; `filepath` is declared as `saved_as` by each operator."""

    bl_options: ClassVar[set[str]] = {"REGISTER"}

    filter_glob: bpy.props.StringProperty(default="*.json", options={"HIDDEN"})
    check_existing: bpy.props.BoolProperty(default=True, options={"HIDDEN"})


class SaveDrawingOperator(SaveOperator):
    """Mix-in: the same for a drawing."""

    filter_glob: bpy.props.StringProperty(default="*.pdf;*.svg;*.png", options={"HIDDEN"})


def saved_as(name: str) -> Any:
    """The path of an operator that saves a file, which proposes a name."""
    return bpy.props.StringProperty(subtype="FILE_PATH", default=name, options={"SKIP_SAVE"} | BLEND_RELATIVE)


class ClipOperator:
    """Mix-in: the movie clip that an operator works on."""

    clip: str
    # The clip that work began with, by the number that it keeps over undo and renaming.
    _clip = 0

    def begin_with(self, clip: bpy.types.MovieClip) -> None:
        """Stay with a clip: the editor may show another, and this one have another name, by the time work is done."""
        self._clip = clip.session_uid

    def begun_with(self) -> bpy.types.MovieClip:
        """The clip that work began with."""
        clip = next((clip for clip in bpy.data.movieclips if clip.session_uid == self._clip), None)
        if clip is None:
            raise FacewrightError(
                "the movie clip was removed while its frames were worked on: open it, and begin again"
            )
        return clip

    def movie_clip(self, context: bpy.types.Context) -> bpy.types.MovieClip:
        """The clip that is named, or that of the editor."""
        clip = bpy.data.movieclips.get(self.clip) if self.clip else clip_of(context)
        if clip is None:
            none = f"there is no movie clip named {self.clip}" if self.clip else "no movie clip is open"
            raise FacewrightError(f"{none}: open it in the Clip editor")
        return clip


def reported(operator: Any, action: Callable[[], str]) -> Result:
    """Do what gives a message, and report the message, or what is wrong."""
    try:
        message = action()
    except FacewrightError as error:
        operator.report({"ERROR"}, str(error))
        return {"CANCELLED"}
    operator.report({"INFO"}, message)
    return {"FINISHED"}


def clip_of(context: bpy.types.Context) -> bpy.types.MovieClip | None:
    """The clip that the Clip editor shows; elsewhere the scene's, or the only one."""
    clips = bpy.data.movieclips
    alone = clips[0] if len(clips) == 1 else None
    return getattr(context, "edit_movieclip", None) or context.scene.active_clip or alone


def in_object_mode(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether objects may be made; tells the artist otherwise."""
    if context.mode != "OBJECT":
        operator.poll_message_set(say("Go to Object Mode first"))
        return False
    return True


def has_clip(operator: type[bpy.types.Operator]) -> bool:
    """Whether there is any clip; tells the artist otherwise."""
    if not bpy.data.movieclips:
        operator.poll_message_set(say("Open a movie clip first"))
        return False
    return True


def has_tracks(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether the clip shown, or where none is shown any, has tracks of a face; tells the artist otherwise."""
    shown = getattr(context, "edit_movieclip", None)
    clips = [shown] if shown is not None else bpy.data.movieclips
    if not any(face_tracks.counts(clip) for clip in clips):
        operator.poll_message_set(say("Track the face first"))
        return False
    return True


def draw_pupils(layout: bpy.types.UILayout, person: bpy.types.PropertyGroup) -> None:
    """The measured interpupillary distance, in a layout that splits properties."""
    row = layout.row(heading="Pupils (mm)")
    row.prop(person, "use_interocular", text="")
    value = row.row()
    value.active = person.use_interocular
    value.prop(person, "interocular_mm", text="")
