"""The camera of a motion: its lens, and the clip behind what it sees."""

import bpy

from ..engine import Camera
from . import camera as scene_camera

LENS = "facewright_motion_lens"
TITLE = "Face Camera"


def ensured(scene: bpy.types.Scene, camera: Camera, clip: bpy.types.MovieClip | None) -> bpy.types.Camera:
    """The lens that all cameras of a scene's motion share, made when it is missing, with the clip as its background."""
    known = (o.data for o in scene.objects if o.type == "CAMERA" and o.data.get(LENS))
    lens = next(known, None) or _new()
    scene_camera.set_lens(lens, camera)
    # The file of a clip may have gone or been changed for another since the motion was found.
    if clip is not None and tuple(clip.size) == (camera.width, camera.height):
        _set_background(lens, clip, camera)
    return lens


def is_distorted(camera: Camera) -> bool:
    """Whether the lens bends straight lines."""
    return any(value != 0.0 for value in (camera.k1, camera.k2, camera.k3, camera.p1, camera.p2))


def _new() -> bpy.types.Camera:
    lens = bpy.data.cameras.new(TITLE)
    lens[LENS] = True
    lens.display_size, lens.clip_start = 0.1, 0.01
    return lens


def _set_background(lens: bpy.types.Camera, clip: bpy.types.MovieClip, camera: Camera) -> None:
    """Show the clip behind what the camera sees, undistorted if its lens is not straight; other pictures stay."""
    mine = next((b for b in lens.background_images if b.source == "MOVIE_CLIP" and b.clip in (clip, None)), None)
    if mine is None:
        mine = lens.background_images.new()
        mine.source, mine.use_camera_clip, mine.alpha = "MOVIE_CLIP", False, 1.0
        lens.show_background_images = True
    mine.clip = clip
    if is_distorted(camera):
        scene_camera.set_clip_lens(clip, camera)
        # Without proxies, Blender undistorts a clip as it is shown, at full size only.
        mine.clip_user.proxy_render_size, mine.clip_user.use_render_undistorted = "FULL", True
    else:
        mine.clip_user.use_render_undistorted = False
