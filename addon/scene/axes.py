"""The head frame (x the subject's left, y up, z out of the face) and Blender's (z up, the face looks to −y); metres."""

import numpy as np
from numpy.typing import NDArray


def to_blender(vectors: NDArray[np.float32]) -> NDArray[np.float32]:
    """(…, 3) vectors of the head frame in Blender's axes."""
    return np.ascontiguousarray(np.stack([vectors[..., 0], -vectors[..., 2], vectors[..., 1]], axis=-1), np.float32)


def from_blender(vectors: NDArray[np.float32]) -> NDArray[np.float32]:
    """(…, 3) vectors in Blender's axes in the head frame."""
    return np.ascontiguousarray(np.stack([vectors[..., 0], vectors[..., 2], -vectors[..., 1]], axis=-1), np.float32)
