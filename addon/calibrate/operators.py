"""The camera's buttons."""

import bpy

from ..engine import FacewrightError
from ..jobs import Work
from ..modal import OpenOperator, Result, SaveDrawingOperator, SaveOperator, WorkOperator, in_object_mode, saved_as
from ..options import BLEND_RELATIVE
from ..running import idle
from ..scene import boards as scene_boards
from ..scene import camera as scene_camera
from ..scene import footage
from ..words import say
from . import actions


class FACEWRIGHT_OT_calibrate(WorkOperator, bpy.types.Operator):
    """Calibrate the camera from pictures of the printed board, or from a clip of it"""

    bl_idname = "facewright.calibrate"
    bl_label = "Calibrate"
    bl_options = {"UNDO"}

    directory: bpy.props.StringProperty(subtype="DIR_PATH", options={"SKIP_SAVE", "HIDDEN"} | BLEND_RELATIVE)
    files: bpy.props.CollectionProperty(type=bpy.types.OperatorFileListElement, options={"SKIP_SAVE", "HIDDEN"})
    filepath: bpy.props.StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE", "HIDDEN"} | BLEND_RELATIVE)
    clip: bpy.props.StringProperty(
        name="Movie Clip", description="A movie clip in this file that shows the board", options={"SKIP_SAVE", "HIDDEN"}
    )
    filter_image: bpy.props.BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    filter_movie: bpy.props.BoolProperty(default=False, options={"HIDDEN", "SKIP_SAVE"})
    filter_folder: bpy.props.BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})

    _asked = False

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return idle(cls)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Result:
        if self.directory or self.filepath or self.clip:
            return super().invoke(context, event)
        self._asked = True
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> Result:
        if not self._asked:
            return super().execute(context)
        # The file browser executes what it was asked for; invoked instead, the work shows its progress.
        files = [{"name": file.name} for file in self.files]
        bpy.ops.facewright.calibrate("INVOKE_DEFAULT", directory=self.directory, files=files, filepath=self.filepath)
        return {"CANCELLED"}

    def start(self, context: bpy.types.Context) -> Work[str]:
        settings = context.scene.facewright_camera
        board, lens = actions.BoardSettings.of(settings), actions.LensSettings.of(settings)
        return actions.calibrated(self._pictures(), board, lens=lens)

    def finish(self, context: bpy.types.Context, result: str) -> str:
        actions.set_camera(context.scene, result)
        return ", ".join(actions.summary(result))

    def _pictures(self) -> list[str]:
        if self.clip:
            clip = bpy.data.movieclips.get(self.clip)
            return footage.clip_files(clip) if clip else []
        folder = bpy.path.abspath(self.directory)
        if chosen := [bpy.path.native_pathsep(f"{folder}/{file.name}") for file in self.files if file.name]:
            return chosen
        path = bpy.path.abspath(self.filepath) or folder
        return [path] if path else []


class FACEWRIGHT_OT_open_camera(OpenOperator, bpy.types.Operator):
    """Open a camera.json"""

    bl_idname = "facewright.open_camera"
    bl_label = "Open Camera"

    def work(self, context: bpy.types.Context, path: str) -> str:
        text = actions.read_camera(path)
        actions.set_camera(context.scene, text)
        return ", ".join(actions.summary(text))


class FACEWRIGHT_OT_forget_camera(bpy.types.Operator):
    """Remove the camera from the scene: the focal length is estimated instead"""

    bl_idname = "facewright.forget_camera"
    bl_label = "Forget Camera"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not context.scene.facewright_camera.text:
            cls.poll_message_set(say("The scene has no camera to forget"))
            return False
        return True

    def execute(self, context: bpy.types.Context) -> Result:
        context.scene.facewright_camera.text = ""
        return {"FINISHED"}


class FACEWRIGHT_OT_save_camera(SaveOperator, bpy.types.Operator):
    """Save the camera as camera.json, for other scenes and the command line"""

    bl_idname = "facewright.save_camera"
    bl_label = "Save Camera"

    filepath: saved_as("camera.json")

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return has_camera(cls, context)

    def work(self, context: bpy.types.Context, path: str) -> str:
        actions.save_camera(path, context.scene.facewright_camera.text)
        return f"{path} saved"


class FACEWRIGHT_OT_save_calibration_picture(SaveDrawingOperator, bpy.types.Operator):
    """Save one page with the boards, their corners, the errors and the numbers, as PDF, SVG or PNG"""

    bl_idname = "facewright.save_calibration_picture"
    bl_label = "Save Picture"

    filepath: saved_as("calibration.pdf")

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return has_boards(cls, context)

    def work(self, context: bpy.types.Context, path: str) -> str:
        actions.save_picture(path, context.scene.facewright_camera.text)
        return f"{path} saved"


class FACEWRIGHT_OT_save_board(SaveDrawingOperator, bpy.types.Operator):
    """Save a board to print, exact at 100 % print scale, as PDF, SVG or PNG"""

    bl_idname = "facewright.save_board"
    bl_label = "Save Board to Print"

    filepath: saved_as("board.pdf")

    def work(self, context: bpy.types.Context, path: str) -> str:
        settings = context.scene.facewright_camera
        actions.save_board(path, actions.BoardSettings.of(settings), settings.page)
        return f"{path}: print at 100 % and check the rulers"


class FACEWRIGHT_OT_show_boards(bpy.types.Operator):
    """Add the camera and the boards to the scene, posed as they were when photographed"""

    bl_idname = "facewright.show_boards"
    bl_label = "Show Boards"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return in_object_mode(cls, context) and has_boards(cls, context)

    def execute(self, context: bpy.types.Context) -> Result:
        actions.show_boards(context.scene)
        return {"FINISHED"}


class FACEWRIGHT_OT_remove_boards(bpy.types.Operator):
    """Remove the calibrated camera and the boards from the scene"""

    bl_idname = "facewright.remove_boards"
    bl_label = "Remove Boards"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if scene_boards.collection(context.scene) is None:
            cls.poll_message_set(say("No boards are in the scene"))
            return False
        return in_object_mode(cls, context)

    def execute(self, context: bpy.types.Context) -> Result:
        scene_boards.remove(context.scene)
        return {"FINISHED"}


class FACEWRIGHT_OT_set_scene_camera(bpy.types.Operator):
    """Set the scene camera to the calibrated one"""

    bl_idname = "facewright.set_scene_camera"
    bl_label = "Set Scene Camera"
    bl_description = (
        "Set the scene camera to the calibrated focal length and principal point, and the render to the picture's "
        "size. Renders have no lens distortion: they match undistorted footage"
    )
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return in_object_mode(cls, context) and has_camera(cls, context)

    def execute(self, context: bpy.types.Context) -> Result:
        camera = actions.known(context.scene.facewright_camera.text)
        assert camera is not None, "poll has seen it"
        like = scene_boards.camera(context.scene)
        obj = scene_camera.set_scene_camera(context.scene, camera, like)
        self.report({"INFO"}, f"{obj.name} has {obj.data.lens:.2f} mm")
        return {"FINISHED"}


class FACEWRIGHT_OT_set_clip_lens(bpy.types.Operator):
    """Set a movie clip's lens to the calibrated camera with its distortion, for tracking and undistortion"""

    bl_idname = "facewright.set_clip_lens"
    bl_label = "Set Clip Lens"
    bl_options = {"REGISTER", "UNDO"}

    clip: bpy.props.StringProperty(
        name="Movie Clip", description="The clip; the one chosen in the panel if empty", options={"SKIP_SAVE"}
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not bpy.data.movieclips:
            cls.poll_message_set(say("First open the movie clip that this camera filmed"))
            return False
        return has_camera(cls, context)

    def execute(self, context: bpy.types.Context) -> Result:
        settings = context.scene.facewright_camera
        camera = actions.known(settings.text)
        clip = bpy.data.movieclips.get(self.clip) if self.clip else settings.clip
        assert camera is not None, "poll has seen it"
        if clip is None:
            self.report({"ERROR"}, "choose the movie clip that this camera filmed")
            return {"CANCELLED"}
        try:
            scene_camera.set_clip_lens(clip, camera)
        except FacewrightError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if scene_camera.has_square_pixels(camera):
            self.report({"INFO"}, f"{clip.name} has {clip.tracking.camera.focal_length_pixels:.1f} px")
        else:
            sentence = "its pixels are not square: Blender allows for that when solving, but not when undistorting"
            self.report({"WARNING"}, f"{clip.name} has the lens; {sentence}")
        return {"FINISHED"}


def has_camera(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether the camera is known; tells the artist otherwise."""
    if actions.known(context.scene.facewright_camera.text) is None:
        operator.poll_message_set(say("Calibrate or open a camera first"))
        return False
    return True


def has_boards(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether the camera is known with the boards it was calibrated from; tells the artist otherwise."""
    if not has_camera(operator, context):
        return False
    if not any(picture.used for picture in context.scene.facewright_camera.pictures):
        operator.poll_message_set(say("This camera file lists no boards: calibrate, or open one that does"))
        return False
    return True
