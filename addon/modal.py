"""What operators have in common: work that goes on while the artist looks on, files that are asked for, movie clips."""

import math
import textwrap
from collections.abc import Callable
from typing import Any, ClassVar

import bpy

from .engine import Cancelled, FacewrightError
from .jobs import POLL_SECONDS, Work, wait
from .scene import face_tracks

Result = set[str]

# Editors with a side bar of ours.
SIDE_BARS = {"VIEW_3D", "CLIP_EDITOR"}
# Of a side bar at scale 1: what tabs and frames take, what an icon takes, and the mean width of a letter.
SIDE_BAR_MARGIN_PX = 70
ICON_PX = 20
CHARACTER_PX = 5.8


class Running:
    """What runs in this Blender, for panels and polls: at most one thing at a time."""

    stage: ClassVar[str] = ""
    fraction: ClassVar[float] = 0.0
    # Seconds left, where that is known.
    remaining_s: ClassVar[float | None] = None
    active: ClassVar[bool] = False
    # The operator's class: a panel shows the progress of its own.
    operator: ClassVar[type | None] = None


class WorkOperator:
    """Mix-in: `start` gives the work, `finish` changes the data in one step and gives the message."""

    _work: Work[Any] | None = None
    # What the work gave, until Blender can take it.
    _given: tuple[Any] | None = None
    _timer: bpy.types.Timer | None = None
    # Of `bpy.types.Operator`, the other base.
    report: Callable[[set[str], str], None]

    def start(self, context: bpy.types.Context) -> Work[Any]:
        raise NotImplementedError

    def finish(self, context: bpy.types.Context, result: Any) -> str:
        raise NotImplementedError

    def execute(self, context: bpy.types.Context) -> Result:
        return reported(self, lambda: self.finish(context, wait(self.start(context))))

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> Result:
        if bpy.app.background:
            return self.execute(context)
        try:
            self._work = self.start(context)
        except FacewrightError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        Running.active = True
        Running.stage, Running.fraction, Running.remaining_s = "starting", 0.0, None
        Running.operator = type(self)
        self._timer = context.window_manager.event_timer_add(POLL_SECONDS, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> Result:
        if event.type == "ESC" and event.value == "PRESS":
            self._end(context)
            self.report({"INFO"}, "Cancelled; nothing was changed")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        return self._advance(context) if self._given is None else self._deliver(context)

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender closes or loads a file."""
        self._end(context)

    def _advance(self, context: bpy.types.Context) -> Result:
        assert self._work is not None
        try:
            Running.stage, fraction, Running.remaining_s = next(self._work)
            # One bar for decoding and the work after it: it never falls.
            Running.fraction = max(Running.fraction, fraction)
        except StopIteration as end:
            self._given = (end.value,)
            return self._deliver(context)
        except FacewrightError as error:
            self._end(context)
            level = "INFO" if isinstance(error, Cancelled) else "ERROR"
            self.report({level}, str(error))
            return {"CANCELLED"}
        redraw(context)
        return {"RUNNING_MODAL"}

    def _deliver(self, context: bpy.types.Context) -> Result:
        """Finish, unless the artist is dragging something: changes meanwhile would pull it from under the mouse."""
        assert self._given is not None
        if is_dragging(context):
            Running.stage, Running.fraction, Running.remaining_s = "done, let go of the mouse", 1.0, None
            redraw(context)
            return {"RUNNING_MODAL"}
        (given,) = self._given
        self._end(context)
        left = leave_modes(context)
        return reported(self, lambda: "; ".join([self.finish(context, given), *left]))

    def _end(self, context: bpy.types.Context) -> None:
        if self._work is not None:
            self._work.close()
            self._work = None
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None
        Running.active, Running.operator = False, None
        redraw(context)


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

    filepath: bpy.props.StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE"})
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
    return bpy.props.StringProperty(subtype="FILE_PATH", default=name, options={"SKIP_SAVE"})


class ClipOperator:
    """Mix-in: the movie clip that an operator works on."""

    clip: str

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


def is_dragging(context: bpy.types.Context) -> bool:
    """Whether another operator holds the mouse in any window."""
    # Where Blender does not tell, nothing waits.
    running = [o for window in context.window_manager.windows for o in getattr(window, "modal_operators", ())]
    return any({"BLOCKING", "GRAB_CURSOR"} & operator.bl_options for operator in running)


def leave_modes(context: bpy.types.Context) -> list[str]:
    """Go to Object Mode in all windows, and say so where it was another.

    What is in Edit Mode would overwrite what is made of it, and its undo steps know nothing of other data.
    """
    left = []
    for window in context.window_manager.windows:
        active = window.view_layer.objects.active
        if active is None or active.mode == "OBJECT":
            continue
        with context.temp_override(window=window):
            # Blender cannot for what is hidden; the result must not be lost over that.
            if bpy.ops.object.mode_set.poll():
                left.append(f"{active.name} was in {active.mode.replace('_', ' ').title()} Mode, which was left")
                bpy.ops.object.mode_set(mode="OBJECT")
    return left


def redraw(context: bpy.types.Context) -> None:
    """Draw the side bars again."""
    for area in context.screen.areas if context.screen else []:
        if area.type in SIDE_BARS:
            area.tag_redraw()


def idle(operator: type[bpy.types.Operator]) -> bool:
    """Whether nothing runs; tells the artist otherwise."""
    if Running.active:
        operator.poll_message_set("Facewright is already working: wait, or press Esc")
        return False
    return True


def clip_of(context: bpy.types.Context) -> bpy.types.MovieClip | None:
    """The clip that the Clip editor shows; elsewhere the scene's, or the only one."""
    clips = bpy.data.movieclips
    alone = clips[0] if len(clips) == 1 else None
    return getattr(context, "edit_movieclip", None) or context.scene.active_clip or alone


def in_object_mode(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether objects may be made; tells the artist otherwise."""
    if context.mode != "OBJECT":
        operator.poll_message_set("Go to Object Mode first")
        return False
    return True


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


def draw_progress(layout: bpy.types.UILayout) -> None:
    """What runs, as a bar with its present stage and the time left."""
    row = layout.row()
    row.scale_y = 1.5
    row.progress(factor=Running.fraction, type="BAR", text=(Running.stage or "starting").capitalize())
    layout.label(text=f"{time_left(Running.remaining_s)}Esc cancels")


def time_left(seconds: float | None) -> str:
    """`2 min left, ` or nothing where that is unknown."""
    if seconds is None:
        return ""
    return f"{math.ceil(seconds / 60)} min left, " if seconds > 90 else f"{math.ceil(seconds)} s left, "


def draw_pupils(layout: bpy.types.UILayout, person: bpy.types.PropertyGroup) -> None:
    """The measured interpupillary distance, in a layout that splits properties."""
    row = layout.row(heading="Pupils (mm)")
    row.prop(person, "use_interocular", text="")
    value = row.row()
    value.active = person.use_interocular
    value.prop(person, "interocular_mm", text="")


def draw_text(layout: bpy.types.UILayout, context: bpy.types.Context, text: str, icon: str = "NONE") -> None:
    """A sentence in as many lines as the side bar needs; Blender would leave out the middle of a long one."""
    width = context.region.width / context.preferences.system.ui_scale - SIDE_BAR_MARGIN_PX
    width -= 0 if icon == "NONE" else ICON_PX
    column = layout.column(align=True)
    for line in textwrap.wrap(text, max(16, int(width / CHARACTER_PX))):
        column.label(text=line, icon=icon)
        icon = "NONE" if icon == "NONE" else "BLANK1"
