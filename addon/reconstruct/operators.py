"""The reconstruction's buttons."""

from typing import Any

import bpy

from ..delivery import window_of
from ..engine import Reconstruction
from ..jobs import Work
from ..modal import WorkOperator, in_object_mode
from ..options import BLEND_RELATIVE
from ..running import idle
from ..scene import heads
from ..scene.growing import Growing
from ..scene.source import source_of
from ..scene.view import Glance
from ..words import say
from . import actions


class FACEWRIGHT_OT_reconstruct(WorkOperator, bpy.types.Operator):
    """Reconstruct the head of the person in the clip"""

    bl_idname = "facewright.reconstruct"
    bl_label = "Reconstruct Face"
    # Not REGISTER: the redo panel would run it all again, blocking, at every change.
    bl_options = {"UNDO"}

    output: bpy.props.StringProperty(
        name="Result Folder",
        description="Also write head.glb, texture.png, eyes.png and report.json here; "
        "if empty, to the scene's own result folder",
        subtype="DIR_PATH",
        options={"SKIP_SAVE"} | BLEND_RELATIVE,
    )

    # What the panel says when it begins; the head that it means by that, and the folder of the results.
    _chosen = ("", "")
    _wanted = _folder = ""
    _growing: Growing | None = None
    _glance: Glance | None = None

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not in_object_mode(cls, context):
            return False
        if not context.scene.facewright_clip.path:
            cls.poll_message_set(say("Choose a clip first"))
            return False
        return idle(cls)

    def start(self, context: bpy.types.Context) -> Work[Reconstruction]:
        clip = context.scene.facewright_clip
        # The artist may choose another clip, head or folder by the time the work is done.
        self._chosen, self._wanted = (clip.path, clip.wanted), actions.wanted(context.scene)
        self._folder = bpy.path.abspath(self.output or clip.output)
        # An update is not drawn: the head that is there would be in its place.
        is_drawn = self._wanted == heads.NEW and not bpy.app.background
        self._glance = Glance()
        self._growing = Growing(context.scene, self._glance) if is_drawn else None
        source = source_of(clip)
        settings = actions.Settings(
            camera=context.scene.facewright_camera.text or None,
            output=self._folder or None,
            tracks=actions.markers(source.path) if clip.use_markers else None,
            options=actions.options_of(clip, context.scene.facewright_person),
        )
        return actions.reconstructed(source, settings)

    def show(self, context: bpy.types.Context, sketch: Any) -> None:
        if self._growing is not None:
            self._growing.show(context.window, sketch)

    def hide(self, context: bpy.types.Context, cancelled: bool) -> None:
        if self._growing is not None:
            self._growing.end(context.window, cancelled)
            self._growing = None

    def finish(self, context: bpy.types.Context, result: Reconstruction) -> str:
        scene, clip = context.scene, context.scene.facewright_clip
        before, lost = set(scene.objects), actions.lost(scene, self._wanted)
        stays = (clip.path, clip.wanted) == self._chosen
        face = actions.place(scene, result, self._chosen[0], self._wanted, context.collection, stays)
        actions.show(context.view_layer, face)
        # The frames have done their work: what follows is the head's.
        clip.show_frames = False
        made, further = actions.report_lines(result.report)[:1], actions.next_step(face not in before)
        window = window_of(context)
        if face not in before and window is not None and window.scene == scene:
            assert self._glance is not None, "start has set it"
            actions.present(window, face, self._glance)
        if self._folder and (complaint := actions.write(result, self._folder)):
            self.report({"WARNING"}, complaint)
        # What is kept, and warnings, stay in the report.
        self.stays = "; ".join([*made, *lost, *further])
        return "; ".join([*made, *lost, *actions.kept(face), *actions.warnings(result.report), *further])
