"""The buttons of controls."""

import bpy

from ..delivery import leave_modes, window_of
from ..modal import Result, reported
from ..running import idle
from ..scene import view
from ..words import sentence
from . import actions

MODES = {"OBJECT", "POSE"}


class FACEWRIGHT_OT_add_controls(bpy.types.Operator):
    """Add bones and handles that lead the face"""

    bl_idname = "facewright.add_controls"
    bl_label = "Add Controls"
    bl_description = (
        "Add bones for neck, head, jaw and gaze, and a panel of handles beside the face that lead its keys. "
        "Pose, keys and keyframes stay. Where there are controls: bring them up to date"
    )
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return can(cls, context, actions.adding_complaint(context.scene, context.object))

    def execute(self, context: bpy.types.Context) -> Result:
        return reported(self, lambda: self._add(context))

    def _add(self, context: bpy.types.Context) -> str:
        active, before = context.object, actions.armature(context.scene, context.object)
        leave_modes(context)
        made, message = actions.add(context.scene, active)
        window = window_of(context)
        if pose(context, made) and before is None and window is not None:
            # The target would be far before the head.
            actions.mark(made, lambda role: role != actions.EYES)
            view.present_wide(window)
            actions.mark(made, lambda _: False)
        return message


class FACEWRIGHT_OT_remove_controls(bpy.types.Operator):
    """Remove bones and handles. The face keeps its pose, its keys get the keyframes; neck and head become straight"""

    bl_idname = "facewright.remove_controls"
    bl_label = "Remove Controls"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return can(cls, context, actions.removing_complaint(context.scene, context.object))

    def execute(self, context: bpy.types.Context) -> Result:
        return reported(self, lambda: self._remove(context))

    def _remove(self, context: bpy.types.Context) -> str:
        active = context.object
        leave_modes(context)
        return actions.remove(context.scene, context.view_layer, active)


class FACEWRIGHT_OT_pose_controls(bpy.types.Operator):
    """Go to Pose Mode, where handles and bones are dragged, or back to Object Mode"""

    bl_idname = "facewright.pose_controls"
    bl_label = "Pose"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        made = actions.armature(context.scene, context.object)
        return can(cls, context, "" if made is not None else actions.NONE)

    def execute(self, context: bpy.types.Context) -> Result:
        made, was_posed = actions.armature(context.scene, context.object), context.mode == "POSE"
        leave_modes(context)
        if was_posed:
            return {"FINISHED"}
        if pose(context, made):
            return {"FINISHED"}
        self.report({"ERROR"}, f"{made.name} is in no collection of this view layer: turn its collection on first")
        return {"CANCELLED"}


def can(operator: type[bpy.types.Operator], context: bpy.types.Context, complaint: str) -> bool:
    """Whether bones can be changed now; tells the artist otherwise."""
    if context.mode not in MODES:
        complaint = complaint or "Go to Object Mode first"
    if complaint:
        operator.poll_message_set(sentence(complaint))
        return False
    return idle(operator)


def pose(context: bpy.types.Context, made: bpy.types.Object) -> bool:
    """Enter Pose Mode with an armature; false where the view layer leaves it out, or hides it."""
    if not actions.select(context.view_layer, made) or not made.visible_get(view_layer=context.view_layer):
        return False
    bpy.ops.object.mode_set(mode="POSE")
    return True
