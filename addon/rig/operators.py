"""The rig's buttons."""

import bpy

from ..calibrate.actions import BoardSettings, LensSettings, set_camera
from ..engine import Rig
from ..jobs import Work
from ..modal import OpenOperator, Result, SaveOperator, WorkOperator, reported, saved_as
from ..options import BLEND_RELATIVE
from ..running import idle
from ..words import say
from . import actions


class FACEWRIGHT_OT_add_rig_folder(bpy.types.Operator):
    """Add a camera, given the folder of its pictures of the board"""

    bl_idname = "facewright.add_rig_folder"
    bl_label = "Add Camera"
    bl_options = {"REGISTER", "UNDO"}

    directory: bpy.props.StringProperty(subtype="DIR_PATH", options={"SKIP_SAVE", "HIDDEN"} | BLEND_RELATIVE)
    filter_folder: bpy.props.BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> Result:
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> Result:
        return reported(self, lambda: f"Camera {self._add(context)} added")

    def _add(self, context: bpy.types.Context) -> str:
        return actions.add_folder(context.scene.facewright_rig, bpy.path.abspath(self.directory))


class FACEWRIGHT_OT_remove_rig_folder(bpy.types.Operator):
    """Remove this camera from the list; its pictures stay"""

    bl_idname = "facewright.remove_rig_folder"
    bl_label = "Remove Camera"
    bl_options = {"REGISTER", "UNDO"}

    index: bpy.props.IntProperty(name="Camera", description="Its position in the list", min=0, options={"SKIP_SAVE"})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not context.scene.facewright_rig.folders:
            cls.poll_message_set(say("The list has no cameras"))
            return False
        return True

    def execute(self, context: bpy.types.Context) -> Result:
        folders = context.scene.facewright_rig.folders
        if self.index >= len(folders):
            return {"CANCELLED"}
        folders.remove(self.index)
        return {"FINISHED"}


class FACEWRIGHT_OT_calibrate_rig(WorkOperator, bpy.types.Operator):
    """Calibrate all cameras and their poses together, from pictures of one board taken at the same moments"""

    bl_idname = "facewright.calibrate_rig"
    bl_label = "Calibrate Rig"
    bl_options = {"UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if len(context.scene.facewright_rig.folders) < actions.FEWEST:
            cls.poll_message_set(say("First add the folders of two or more cameras"))
            return False
        return idle(cls)

    def start(self, context: bpy.types.Context) -> Work[Rig]:
        settings = context.scene.facewright_camera
        folders = [(row.name, bpy.path.abspath(row.path)) for row in context.scene.facewright_rig.folders]
        options = BoardSettings.of(settings).arguments | LensSettings.of(settings).arguments
        return actions.calibrated(folders, options)

    def finish(self, context: bpy.types.Context, result: Rig) -> str:
        return actions.set_rig(context.scene, result)


class FACEWRIGHT_OT_open_rig(OpenOperator, bpy.types.Operator):
    """Open a rig.json"""

    bl_idname = "facewright.open_rig"
    bl_label = "Open Rig"

    def work(self, context: bpy.types.Context, path: str) -> str:
        return actions.set_rig(context.scene, Rig.read(path))


class FACEWRIGHT_OT_save_rig(SaveOperator, bpy.types.Operator):
    """Save the rig as rig.json, for other scenes and the command line"""

    bl_idname = "facewright.save_rig"
    bl_label = "Save Rig"

    filepath: saved_as("rig.json")

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return has_rig(cls, context)

    def work(self, context: bpy.types.Context, path: str) -> str:
        return actions.save(path, context.scene.facewright_rig.text)


class FACEWRIGHT_OT_forget_rig(bpy.types.Operator):
    """Remove the rig from the scene; the chosen camera stays"""

    bl_idname = "facewright.forget_rig"
    bl_label = "Forget Rig"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not context.scene.facewright_rig.text:
            cls.poll_message_set(say("The scene has no rig to forget"))
            return False
        return True

    def execute(self, context: bpy.types.Context) -> Result:
        actions.forget(context.scene)
        return {"FINISHED"}


class FACEWRIGHT_OT_choose_rig_camera(bpy.types.Operator):
    """Use this camera of the rig: the clip was filmed with it"""

    bl_idname = "facewright.choose_rig_camera"
    bl_label = "Choose Camera"
    bl_options = {"REGISTER", "UNDO"}

    name: bpy.props.StringProperty(name="Camera", description="Its name in the rig", options={"SKIP_SAVE"})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return has_rig(cls, context)

    def execute(self, context: bpy.types.Context) -> Result:
        return reported(self, lambda: self._choose(context))

    def _choose(self, context: bpy.types.Context) -> str:
        camera = actions.choose(context.scene, self.name)
        set_camera(context.scene, camera.to_json())
        return f"The clip was filmed with {self.name}, focal {camera.fx:.1f} px"


def has_rig(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether a rig is known; tells the artist otherwise."""
    if actions.known(context.scene.facewright_rig.text) is None:
        operator.poll_message_set(say("Calibrate or open a rig first"))
        return False
    return True
