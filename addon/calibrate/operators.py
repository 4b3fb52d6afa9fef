"""The camera's buttons."""

import bpy

from ..engine import FacewrightError
from ..jobs import Work
from ..modal import Result, WorkOperator, idle
from . import actions


class FACEWRIGHT_OT_calibrate(WorkOperator, bpy.types.Operator):
    """Calibrate the camera from pictures of the printed board"""

    bl_idname = "facewright.calibrate"
    bl_label = "Calibrate"
    bl_options = {"REGISTER", "UNDO"}

    directory: bpy.props.StringProperty(subtype="DIR_PATH", options={"SKIP_SAVE", "HIDDEN"})
    files: bpy.props.CollectionProperty(type=bpy.types.OperatorFileListElement, options={"SKIP_SAVE", "HIDDEN"})
    filter_image: bpy.props.BoolProperty(default=True, options={"HIDDEN"})
    filter_folder: bpy.props.BoolProperty(default=True, options={"HIDDEN"})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return idle(cls)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Result:
        if not self.directory:
            context.window_manager.fileselect_add(self)
            return {"RUNNING_MODAL"}
        return super().invoke(context, event)

    def start(self, context: bpy.types.Context) -> Work[str]:
        settings = context.scene.facewright_camera
        folder = bpy.path.abspath(self.directory)
        pictures = [bpy.path.native_pathsep(f"{folder}/{f.name}") for f in self.files if f.name] or [folder]
        return actions.calibrated(pictures, settings.columns, settings.rows, settings.square_mm)

    def finish(self, context: bpy.types.Context, result: str) -> str:
        context.scene.facewright_camera.text = result
        return ", ".join(actions.summary(result)[:2])


class FACEWRIGHT_OT_open_camera(bpy.types.Operator):
    """Open a camera.json"""

    bl_idname = "facewright.open_camera"
    bl_label = "Open Camera"
    bl_options = {"REGISTER", "UNDO"}

    filepath: bpy.props.StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE"})
    filter_glob: bpy.props.StringProperty(default="*.json", options={"HIDDEN"})

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> Result:
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> Result:
        try:
            context.scene.facewright_camera.text = actions.read_camera(bpy.path.abspath(self.filepath))
        except FacewrightError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class FACEWRIGHT_OT_forget_camera(bpy.types.Operator):
    """Estimate the focal length instead"""

    bl_idname = "facewright.forget_camera"
    bl_label = "Forget Camera"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> Result:
        context.scene.facewright_camera.text = ""
        return {"FINISHED"}


class FACEWRIGHT_OT_save_board(bpy.types.Operator):
    """Save a checkerboard to print, exact at 100 % print scale, as PDF, SVG or PNG"""

    bl_idname = "facewright.save_board"
    bl_label = "Save Board to Print"
    bl_options = {"REGISTER"}

    filepath: bpy.props.StringProperty(subtype="FILE_PATH", default="board.pdf", options={"SKIP_SAVE"})
    filter_glob: bpy.props.StringProperty(default="*.pdf;*.svg;*.png", options={"HIDDEN"})

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> Result:
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> Result:
        settings = context.scene.facewright_camera
        try:
            path = bpy.path.abspath(self.filepath)
            actions.save_board(path, settings.columns, settings.rows, settings.square_mm, settings.page)
        except FacewrightError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, f"{self.filepath}: print at 100 % and check the rulers")
        return {"FINISHED"}
