"""What runs in this Blender, how far it is, and what came of it: for panels and polls."""

import math
import textwrap
from typing import ClassVar, NamedTuple

import bpy

from .engine import Progress
from .scene.view import redraw
from .words import say, sentence

# Of a side bar at scale 1: what tabs and frames take, what an icon takes, and the mean width of a letter.
SIDE_BAR_MARGIN_PX = 70
ICON_PX = 20
CHARACTER_PX = 5.8
STARTING = Progress("starting", 0.0)


class Said(NamedTuple):
    """What came of some work: a kind of report as Blender calls it, and the sentence."""

    kind: str
    text: str


class Running:
    """What runs: at most one thing at a time."""

    progress: ClassVar[Progress] = STARTING
    active: ClassVar[bool] = False
    # The operator's class: a panel shows the progress of its own, and what came of its last work in the open file.
    operator: ClassVar[type | None] = None
    said: ClassVar[dict[type, Said]] = {}

    @classmethod
    def begin(cls, operator: type) -> None:
        cls.active, cls.operator, cls.progress = True, operator, STARTING
        cls.said.pop(operator, None)

    @classmethod
    def advance(cls, progress: Progress) -> None:
        """One bar for all of the work: it never falls."""
        cls.progress = progress._replace(fraction=max(progress.fraction, cls.progress.fraction))

    @classmethod
    def end(cls) -> None:
        cls.active, cls.operator = False, None


def register() -> None:
    bpy.app.handlers.load_post.append(_opened)


def unregister() -> None:
    bpy.app.handlers.load_post.remove(_opened)
    # The extension may be turned off under its work.
    Running.end()


@bpy.app.handlers.persistent
def _opened(_path: str) -> None:
    """What was said was of another file."""
    Running.said.clear()


def idle(operator: type[bpy.types.Operator]) -> bool:
    """Whether nothing runs; tells the artist otherwise."""
    if Running.active:
        operator.poll_message_set(say("Facewright is already working: wait, or press Esc"))
        return False
    return True


def draw_progress(layout: bpy.types.UILayout) -> None:
    """What runs, as a bar with its present step, and the time left."""
    progress = Running.progress
    row = layout.row()
    row.scale_y = 1.5
    row.progress(factor=progress.fraction, type="BAR", text=bar_text(progress))
    layout.label(text=time_left(progress.remaining_s))


def bar_text(progress: Progress) -> str:
    """`3 of 8: Track`, or the stage alone where steps are not counted."""
    stage = sentence(progress.stage or STARTING.stage)
    if not progress.step:
        return stage
    return say("{step} of {steps}: {stage}", step=progress.step[0], steps=progress.step[1], stage=stage)


def time_left(seconds: float | None) -> str:
    """`2 min left, Esc cancels`, the latter alone where the time is unknown."""
    if seconds is None:
        return say("Esc cancels")
    if seconds > 90:
        return say("{minutes} min left, Esc cancels", minutes=math.ceil(seconds / 60))
    return say("{seconds} s left, Esc cancels", seconds=math.ceil(seconds))


def draw_said(layout: bpy.types.UILayout, context: bpy.types.Context, operator: type) -> None:
    """What came of the last work of an operator, until it works again or the artist clicks on it.

    No labels: Blender would take one in the bar's place for the bar, and show it pressed where the mouse is.
    """
    said = Running.said.get(operator)
    if said is None:
        return
    column = layout.column(align=True)
    for line, icon in wrapped(context, sentence(said.text), "ERROR" if said.kind == "ERROR" else "INFO"):
        row = column.row()
        row.alignment = "LEFT"
        row.operator(FACEWRIGHT_OT_dismiss.bl_idname, text=line, icon=icon, emboss=False).work = operator.__name__


class FACEWRIGHT_OT_dismiss(bpy.types.Operator):
    """What came of the last work. Click to put it away"""

    bl_idname = "facewright.dismiss"
    bl_label = "Dismiss"
    bl_options: ClassVar[set[str]] = {"INTERNAL"}

    work: bpy.props.StringProperty(options={"SKIP_SAVE", "HIDDEN"})

    def execute(self, context: bpy.types.Context) -> set[str]:
        Running.said = {operator: said for operator, said in Running.said.items() if operator.__name__ != self.work}
        redraw()
        return {"FINISHED"}


def draw_text(layout: bpy.types.UILayout, context: bpy.types.Context, text: str, icon: str = "NONE") -> None:
    """A sentence in as many lines as the side bar needs; Blender would leave out the middle of a long one."""
    column = layout.column(align=True)
    for line, mark in wrapped(context, say(text), icon):
        column.label(text=line, icon=mark)


def wrapped(context: bpy.types.Context, text: str, icon: str) -> list[tuple[str, str]]:
    """A sentence as lines of the side bar, each with its icon: the first one has it."""
    width = context.region.width / context.preferences.system.ui_scale - SIDE_BAR_MARGIN_PX
    width -= 0 if icon == "NONE" else ICON_PX
    lines = textwrap.wrap(text, max(16, int(width / CHARACTER_PX)))
    rest = "NONE" if icon == "NONE" else "BLANK1"
    return [(line, rest if k else icon) for k, line in enumerate(lines)]
