"""A calibrated camera as Blender's camera, and as the lens of a movie clip."""

import bpy

from ..engine import Camera, FacewrightError
from .axes import FORWARD


def new(name: str) -> bpy.types.Object:
    """A camera object at the origin, in no scene yet."""
    obj = bpy.data.objects.new(name, bpy.data.cameras.new(name))
    obj.rotation_euler = FORWARD
    return obj


def set_lens(data: bpy.types.Camera, camera: Camera) -> None:
    """Give a camera the focal length and the principal point; its sensor stays. `set_render` belongs to it.

    Blender measures the focal length by the side of the sensor that its fit says, and shifts in parts of that side.
    """
    aspect = camera.fx / camera.fy
    sensor, side = data.sensor_width, float(camera.width)
    portrait = camera.width < camera.height * aspect
    if data.sensor_fit == "VERTICAL" or (data.sensor_fit == "AUTO" and portrait):
        side = camera.height * aspect
    if data.sensor_fit == "VERTICAL":
        sensor = data.sensor_height
    data.type = "PERSP"
    data.lens_unit = "MILLIMETERS"
    data.lens = camera.fx * sensor / side
    # The library's pixel centres are at integers: the picture's left edge is at −½.
    data.shift_x = (camera.width / 2 - (camera.cx + 0.5)) / side
    data.shift_y = ((camera.cy + 0.5) - camera.height / 2) * aspect / side


def set_render(render: bpy.types.RenderSettings, camera: Camera) -> None:
    """Render pictures of the camera's size and the shape of its pixels."""
    render.resolution_x, render.resolution_y = camera.width, camera.height
    render.resolution_percentage = 100
    # Blender wants neither below 1.
    render.pixel_aspect_x = max(1.0, camera.fy / camera.fx)
    render.pixel_aspect_y = max(1.0, camera.fx / camera.fy)


def set_scene_camera(scene: bpy.types.Scene, camera: Camera, like: bpy.types.Object | None = None) -> bpy.types.Object:
    """Set the scene's camera and the render size; a new camera, if there is none, stands where `like` does."""
    if scene.camera is None or scene.camera.type != "CAMERA":
        scene.camera = new("Camera")
        if like is not None:
            scene.camera.matrix_world = like.matrix_world
        scene.collection.objects.link(scene.camera)
    set_lens(scene.camera.data, camera)
    set_render(scene.render, camera)
    return scene.camera


# Blender 5.0 tracks and solves with the shape of pixels, but undistorts as if they were square.
SQUARE = 0.005


def has_square_pixels(camera: Camera) -> bool:
    """Whether Blender's undistortion of a clip is right to some hundredths of a pixel."""
    return abs(camera.fy / camera.fx - 1.0) < SQUARE


def complaint(camera: Camera, clip: str, size: tuple[int, int]) -> str:
    """What is wrong with a camera for a clip; empty if nothing."""
    if (camera.width, camera.height) == size:
        return ""
    measured = f"{clip} is {size[0]} × {size[1]}, the camera was calibrated at {camera.width} × {camera.height}"
    return f"{measured}: calibrate from pictures of the clip's size, or forget the camera"


def set_clip_lens(clip: bpy.types.MovieClip, camera: Camera) -> None:
    """Give a movie clip the camera and its lens distortion, for tracking, undistortion and solving."""
    size = (clip.size[0], clip.size[1])
    if size != (camera.width, camera.height):
        raise FacewrightError(
            f"{clip.name} is {size[0]} × {size[1]}, the camera was calibrated at {camera.width} × {camera.height}: "
            "calibrate from pictures of the clip's size"
        )
    lens = clip.tracking.camera
    lens.units = "MILLIMETERS"
    lens.pixel_aspect = camera.fy / camera.fx
    lens.focal_length_pixels = camera.fx
    # From the lower left corner of the picture.
    lens.principal_point_pixels = (camera.cx + 0.5, camera.height - (camera.cy + 0.5))
    if camera.p1 == 0.0 and camera.p2 == 0.0:
        lens.distortion_model = "POLYNOMIAL"
        lens.k1, lens.k2, lens.k3 = camera.k1, camera.k2, camera.k3
        return
    lens.distortion_model = "BROWN"
    lens.brown_k1, lens.brown_k2, lens.brown_k3, lens.brown_k4 = camera.k1, camera.k2, camera.k3, 0.0
    # Blender names the tangential terms the other way round, and its y points up.
    lens.brown_p1, lens.brown_p2 = camera.p2, -camera.p1
