"""The reconstruction's buttons."""

import bpy

from ..engine import Reconstruction
from ..jobs import Work
from ..modal import Result, WorkOperator, idle
from ..scene import head as scene_head
from . import actions


class FACEWRIGHT_OT_reconstruct(WorkOperator, bpy.types.Operator):
    """Make the head of the person in the clip"""

    bl_idname = "facewright.reconstruct"
    bl_label = "Reconstruct Face"
    # Not REGISTER: the redo panel would run it all again, blocking, at every change.
    bl_options = {"UNDO"}

    output: bpy.props.StringProperty(
        name="Result Folder",
        description="Also write head.glb, texture.png, eyes.png and report.json here; the scene's own folder if empty",
        subtype="DIR_PATH",
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if context.mode != "OBJECT":
            cls.poll_message_set("Go to Object Mode first")
            return False
        if not context.scene.facewright_clip.path:
            cls.poll_message_set("Choose a clip first")
            return False
        return idle(cls)

    def start(self, context: bpy.types.Context) -> Work[Reconstruction]:
        clip = context.scene.facewright_clip
        path = bpy.path.abspath(clip.path)
        source = actions.Source(path, (clip.first, clip.last) if clip.use_range else None)
        settings = actions.Settings(
            camera=context.scene.facewright_camera.text or None,
            output=self._folder(context),
            tracks=actions.markers(path) if clip.use_markers else None,
            options=actions.options_of(clip),
        )
        return actions.reconstructed(source, settings)

    def finish(self, context: bpy.types.Context, result: Reconstruction) -> str:
        if folder := self._folder(context):
            result.write(folder)
        face = actions.place(context.scene, result, context.collection)
        for obj in context.selected_objects:
            obj.select_set(False)
        face.select_set(True)
        context.view_layer.objects.active = face
        return "; ".join([*actions.report_lines(result.report)[:1], *actions.warnings(result.report)])

    def _folder(self, context: bpy.types.Context) -> str | None:
        folder = self.output or context.scene.facewright_clip.output
        return bpy.path.abspath(folder) if folder else None


class FACEWRIGHT_OT_expression(bpy.types.Operator):
    """Set the head's keys to an expression; with auto keying on, insert keyframes"""

    bl_idname = "facewright.expression"
    bl_label = "Expression"
    bl_options = {"REGISTER", "UNDO"}

    name: bpy.props.StringProperty(name="Expression", default="neutral")
    strength: bpy.props.FloatProperty(name="Strength", default=1.0, min=0.0, max=1.0, subtype="FACTOR")

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if scene_head.face(context.scene) is None:
            cls.poll_message_set("Reconstruct a face first")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> Result:
        skin = scene_head.face(context.scene)
        poses = scene_head.expressions(skin)
        if self.name != "neutral" and self.name not in poses:
            self.report({"ERROR"}, f"there is no expression {self.name}: choose one of neutral, {', '.join(poses)}")
            return {"CANCELLED"}
        values = {key: value * self.strength for key, value in poses.get(self.name, {}).items()}
        keying = context.scene.tool_settings.use_keyframe_insert_auto
        scene_head.set_keys(skin, values, context.scene.frame_current if keying else None)
        return {"FINISHED"}
