"""The buttons of expressions and keys."""

from collections.abc import Callable
from typing import ClassVar

import bpy

from ..engine import FacewrightError
from ..modal import Result
from ..options import OURS
from ..words import say
from . import actions
from .options import Blended


class OnFace:
    """Mix-in: an operator on the keys of the face that the buttons act on; `work` does it."""

    bl_options: ClassVar[set[str]] = {"REGISTER", "UNDO"}
    # Of `bpy.types.Operator`, the other base.
    report: Callable[[set[str], str], None]
    poll_message_set: ClassVar[Callable[[str], None]]

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        complaint = actions.complaint(actions.face(context.scene, context.object))
        if complaint:
            cls.poll_message_set(say(complaint))
        return not complaint

    def execute(self, context: bpy.types.Context) -> Result:
        skin = actions.face(context.scene, context.object)
        try:
            said = self.work(context.scene, skin)
        except FacewrightError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if said:
            self.report({"WARNING"}, said[:1].upper() + said[1:])
        return {"FINISHED"}

    def work(self, scene: bpy.types.Scene, skin: bpy.types.Object) -> str:
        """Do it; gives a sentence about what could not be done, empty without any."""
        raise NotImplementedError


class Grouped:
    """Mix-in: for a group of keys, or for the whole face."""

    group: bpy.props.StringProperty(
        name="Group", description="Group of keys, such as Mouth; empty: the whole face", options={"SKIP_SAVE"}
    )


class Keyed:
    """Mix-in: sets keys, and keyframes of them if it is asked to."""

    # Blender gives unset properties their last values, but for SKIP_SAVE: a button means the same at every press.

    keyframe: bpy.props.EnumProperty(
        name="Keyframes",
        description="Whether keyframes are inserted at the current frame: of every key, so that it shows this pose",
        items=[
            (actions.AUTO, "With Auto Keying", "Insert keyframes if auto keying is on"),
            (actions.INSERT, "Insert", "Insert keyframes"),
            (actions.NONE, "None", "Set the keys only"),
        ],
        default=actions.AUTO,
        options={"SKIP_SAVE"},
    )


class FACEWRIGHT_OT_expression(OnFace, Keyed, Blended, bpy.types.Operator):
    """Set the head's shape keys to an expression; with auto keying on, insert keyframes of all of them"""

    bl_idname = "facewright.expression"
    bl_label = "Expression"

    name: bpy.props.StringProperty(
        name="Expression",
        translation_context=OURS,
        description="Name of the expression, such as happiness",
        default=actions.NEUTRAL,
    )

    def work(self, scene: bpy.types.Scene, skin: bpy.types.Object) -> str:
        keying = actions.keying(scene, skin, self.keyframe)
        return actions.express(skin, self.name, self.strength, self.blend, keying)


class FACEWRIGHT_OT_reset_keys(OnFace, Grouped, Keyed, bpy.types.Operator):
    """Set all keys that expressions are made of to 0, or those of a group; with auto keying on, insert keyframes"""

    bl_idname = "facewright.reset_keys"
    bl_label = "Clear Pose"

    def work(self, scene: bpy.types.Scene, skin: bpy.types.Object) -> str:
        return actions.reset(skin, self.group, actions.keying(scene, skin, self.keyframe))


class FACEWRIGHT_OT_mirror_keys(OnFace, Grouped, Keyed, bpy.types.Operator):
    """Exchange the left and right of the pose, or copy one side to the other; with auto keying on, insert keyframes"""

    bl_idname = "facewright.mirror_keys"
    bl_label = "Mirror"

    direction: bpy.props.EnumProperty(
        name="Direction",
        description="What goes where. Left is the person's left",
        items=[
            (actions.SWAP, "Swap", "Exchange left and right"),
            (actions.TO_RIGHT, "Left to Right", "Give the right side what the left one has"),
            (actions.TO_LEFT, "Right to Left", "Give the left side what the right one has"),
        ],
        default=actions.SWAP,
        options={"SKIP_SAVE"},
    )

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        where = f"the keys of {properties.group}" if properties.group else "the pose"
        return {
            actions.SWAP: f"Exchange left and right of {where}",
            actions.TO_RIGHT: f"Copy the person's left side of {where} to the right. Jaw and mouth moved sideways stay",
            actions.TO_LEFT: f"Copy the person's right side of {where} to the left. Jaw and mouth moved sideways stay",
        }[properties.direction]

    def work(self, scene: bpy.types.Scene, skin: bpy.types.Object) -> str:
        keying = actions.keying(scene, skin, self.keyframe)
        return actions.mirror(skin, self.direction, self.group, keying)


class FACEWRIGHT_OT_insert_keyframes(OnFace, Grouped, bpy.types.Operator):
    """Insert a keyframe of every key of the face at the current frame, whether it has changed or not"""

    bl_idname = "facewright.insert_keyframes"
    bl_label = "Insert Keyframes"

    def work(self, scene: bpy.types.Scene, skin: bpy.types.Object) -> str:
        keying = actions.keying(scene, skin, actions.INSERT)
        assert keying is not None, "keyframes were asked for"
        return actions.insert(skin, self.group, keying)


class FACEWRIGHT_OT_clear_keyframes(OnFace, Grouped, bpy.types.Operator):
    """Delete the keyframes of the face's keys at the current frame"""

    bl_idname = "facewright.clear_keyframes"
    bl_label = "Clear Keyframes"

    def work(self, scene: bpy.types.Scene, skin: bpy.types.Object) -> str:
        return actions.clear(skin, self.group, scene.frame_float)
