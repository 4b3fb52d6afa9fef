"""The buttons of the list of heads."""

from collections.abc import Callable
from typing import ClassVar

import bpy

from ..delivery import leave_modes, window_of
from ..modal import Result, in_object_mode, reported
from ..running import idle
from ..scene.heads import Head
from ..words import say
from . import actions

ANOTHER = "Let the next run make a new head, in a collection of its own; those that are here stay as they are"


class OnHead:
    """Mix-in: an operator on the head of the active object, or the last one made; `work` gives the message."""

    bl_options: ClassVar[set[str]] = {"REGISTER", "UNDO"}
    # Of `bpy.types.Operator`, the other base.
    report: Callable[[set[str], str], None]
    poll_message_set: ClassVar[Callable[[str], None]]

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not in_object_mode(cls, context):
            return False
        if complaint := actions.complaint(context.scene, context.object):
            cls.poll_message_set(complaint)
            return False
        return idle(cls)

    def execute(self, context: bpy.types.Context) -> Result:
        row = actions.current(context.scene, context.object)
        assert row is not None, "poll has seen one"
        if row.head is None or row.complaint:
            # A part of it is of another file.
            self.report({"ERROR"}, row.complaint)
            return {"CANCELLED"}
        head = row.head
        # Another window may be in Edit Mode.
        left = leave_modes(context)
        return reported(self, lambda: "; ".join([self.work(context, head), *left]))

    def work(self, context: bpy.types.Context, head: Head) -> str:
        raise NotImplementedError


class FACEWRIGHT_OT_choose_head(bpy.types.Operator):
    """Choose what the next run makes; the heads of the scene stay as they are"""

    bl_idname = "facewright.choose_head"
    bl_label = "New Head"
    bl_options = {"REGISTER", "UNDO"}

    head: bpy.props.StringProperty(
        name="Head", description="Key of the head that is made anew; empty: a new head", options={"SKIP_SAVE"}
    )

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        if properties.head:
            return say("Let the next run make this head again: its skin was deleted")
        return say(ANOTHER)

    def execute(self, context: bpy.types.Context) -> Result:
        return reported(self, lambda: actions.make_next(context.scene, self.head))


class FACEWRIGHT_OT_duplicate_head(OnHead, bpy.types.Operator):
    """Copy the head with its meshes, keys, drivers, keyframes, materials and pictures; the copy stands beside it"""

    bl_idname = "facewright.duplicate_head"
    bl_label = "Duplicate Head"

    def work(self, context: bpy.types.Context, head: Head) -> str:
        said = actions.duplicate(context.scene, context.view_layer, head)
        if (window := window_of(context)) is not None:
            actions.present(window)
        return said


class FACEWRIGHT_OT_remove_head(OnHead, bpy.types.Operator):
    """Remove the head with all that nothing else uses; what you have put into its collection stays"""

    bl_idname = "facewright.remove_head"
    bl_label = "Remove Head"

    def work(self, context: bpy.types.Context, head: Head) -> str:
        return actions.remove(context.scene, head)


class FACEWRIGHT_OT_mark_head(OnHead, bpy.types.Operator):
    """Offer the head in the Asset Browser, with a picture of it"""

    bl_idname = "facewright.mark_head"
    bl_label = "Mark as Asset"

    clear: bpy.props.BoolProperty(
        name="Clear", description="Let the head be no asset any more", default=False, options={"SKIP_SAVE"}
    )

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        if properties.clear:
            return say("Let the head be no asset any more; the head stays as it is")
        return say("Offer the head in the Asset Browser, with a picture of it")

    def work(self, context: bpy.types.Context, head: Head) -> str:
        return actions.clear_asset(head) if self.clear else actions.mark_as_asset(context.scene, head)
