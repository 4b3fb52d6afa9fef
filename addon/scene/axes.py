"""Frames of the library and Blender's, in metres.

The head frame has x to the subject's left, y up, z out of the face; in Blender z is up and the face looks to −y.
The library's camera has x right, y down and looks along z; Blender's has y up and looks along −z.
"""

from math import pi

import numpy as np
from numpy.typing import NDArray

# From the head frame to Blender's axes.
BLENDER_FROM_HEAD = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])

# Of a new camera object: it looks along +y, z is up.
FORWARD = (pi / 2, 0.0, 0.0)


def to_blender(vectors: NDArray[np.float32]) -> NDArray[np.float32]:
    """(…, 3) vectors of the head frame in Blender's axes."""
    return np.ascontiguousarray(np.stack([vectors[..., 0], -vectors[..., 2], vectors[..., 1]], axis=-1), np.float32)


def below_camera(cam_from_object: NDArray[np.float64]) -> NDArray[np.float64]:
    """(…, 4, 4) poses before the library's camera as transforms of children of Blender's camera object."""
    return np.diag([1.0, -1.0, -1.0, 1.0]) @ cam_from_object


def head_below_camera(cam_from_head: NDArray[np.float64]) -> NDArray[np.float64]:
    """(…, 4, 4) poses of the head as transforms, below Blender's camera, of a head in Blender's axes."""
    return below_camera(cam_from_head) @ BLENDER_FROM_HEAD.T
