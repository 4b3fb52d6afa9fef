"""Frames of the library and Blender's, in metres.

The head frame has x to the subject's left, y up, z out of the face; in Blender z is up and the face looks to −y.
The library's camera has x right, y down and looks along z; Blender's has y up and looks along −z.
"""

from math import pi

import numpy as np
from numpy.typing import NDArray

# Of a new camera object: it looks along +y, z is up.
FORWARD = (pi / 2, 0.0, 0.0)


def to_blender(vectors: NDArray[np.float32]) -> NDArray[np.float32]:
    """(…, 3) vectors of the head frame in Blender's axes."""
    return np.ascontiguousarray(np.stack([vectors[..., 0], -vectors[..., 2], vectors[..., 1]], axis=-1), np.float32)


def from_blender(vectors: NDArray[np.float32]) -> NDArray[np.float32]:
    """(…, 3) vectors in Blender's axes in the head frame."""
    return np.ascontiguousarray(np.stack([vectors[..., 0], vectors[..., 2], -vectors[..., 1]], axis=-1), np.float32)


def below_camera(cam_from_object: NDArray[np.float64]) -> NDArray[np.float64]:
    """(4, 4) pose before the library's camera as the transform of a child of Blender's camera object."""
    return np.diag([1.0, -1.0, -1.0, 1.0]) @ cam_from_object
