"""The expressions' buttons."""

import bpy

from ..engine import FacewrightError
from ..modal import Result
from . import actions


class FACEWRIGHT_OT_expression(bpy.types.Operator):
    """Set the head's shape keys to an expression; with auto keying on, insert keyframes"""

    bl_idname = "facewright.expression"
    bl_label = "Expression"
    bl_options = {"REGISTER", "UNDO"}

    name: bpy.props.StringProperty(name="Expression", default=actions.NEUTRAL)
    strength: bpy.props.FloatProperty(name="Strength", default=1.0, min=0.0, max=1.0, subtype="FACTOR")

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        complaint = actions.complaint(actions.face(context.scene, context.object))
        if complaint:
            cls.poll_message_set(complaint)
        return not complaint

    def execute(self, context: bpy.types.Context) -> Result:
        scene = context.scene
        frame = scene.frame_current if scene.tool_settings.use_keyframe_insert_auto else None
        try:
            actions.express(actions.face(scene, context.object), self.name, self.strength, frame)
        except FacewrightError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}
