"""What a scene remembers of a motion, in its collection: the motion.json, the clip with its frames, how it is shown."""

from dataclasses import dataclass
from typing import Literal

import bpy
import numpy as np
from numpy.typing import NDArray

from . import footage

COLLECTION = "facewright_motion"
TITLE = "Face Motion"
CLIP = "facewright_motion_clip"
NUMBERS = "facewright_motion_frames"
KIND = "facewright_motion_kind"

Kind = Literal["CAMERA", "HEAD", "CAMERAS"]


@dataclass(frozen=True)
class Shown:
    """How a motion is shown: what moves, and by how many radians the head turns from one key frame to the next.

    `follow`: where the head moves, the reconstructed head is carried along.
    """

    kind: Kind = "CAMERA"
    key_turn: float = np.pi / 36
    follow: bool = True


def collection(scene: bpy.types.Scene) -> bpy.types.Collection | None:
    """The collection of a scene's motion."""
    return next((c for c in scene.collection.children_recursive if c.get(COLLECTION) is not None), None)


def ensured(scene: bpy.types.Scene) -> bpy.types.Collection:
    """The collection of a scene's motion, made when it is missing."""
    home = collection(scene)
    if home is None:
        home = bpy.data.collections.new(TITLE)
        home[COLLECTION] = ""
        scene.collection.children.link(home)
    return home


def store(home: bpy.types.Collection, text: str, clip: bpy.types.MovieClip, numbers: NDArray[np.int64]) -> None:
    """Keep a motion.json and the clip's number of each of its frames."""
    home[COLLECTION], home[CLIP], home[NUMBERS] = text, clip, numbers.tolist()


def forget(scene: bpy.types.Scene) -> None:
    """Take the memory away, and the collection if it is empty."""
    home = collection(scene)
    if home is None:
        return
    home[COLLECTION] = ""
    for key in (CLIP, NUMBERS, KIND):
        if key in home:
            del home[key]
    if not home.objects and not home.children:
        bpy.data.collections.remove(home)


def text(scene: bpy.types.Scene) -> str:
    """The motion.json of a scene; empty without one."""
    home = collection(scene)
    return str(home[COLLECTION]) if home is not None else ""


def clip(home: bpy.types.Collection) -> bpy.types.MovieClip | None:
    """The clip of the motion; None when it was removed."""
    return home.get(CLIP)


def clip_frame(home: bpy.types.Collection, scene_frame: int) -> int:
    """The clip's frame that the timeline shows."""
    return scene_frame - footage.scene_frame(clip(home), 0)


def frames(home: bpy.types.Collection) -> NDArray[np.int64]:
    """The frame of the timeline of each frame of the motion; the artist may have moved the clip."""
    numbers = np.array(list(home.get(NUMBERS, [])), np.int64)
    return numbers + footage.scene_frame(clip(home), 0)
