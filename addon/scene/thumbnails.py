"""Pictures as previews: square, with the face in the middle, framed in the colour of what becomes of them."""

from collections.abc import Callable
from enum import Enum
from typing import Any

import bpy.utils.previews
import numpy as np
from numpy.typing import NDArray

# Width of a frame, pixels.
FRAME = 4
# How much is left of the colours of what is left out, and of their brightness.
PALE, DARK = 0.2, 0.45


class Fate(Enum):
    """What becomes of a frame, with the colour of its frame."""

    USED = (0.25, 0.7, 0.3)
    UNUSABLE = (0.9, 0.6, 0.1)
    LEFT_OUT = (0.35, 0.35, 0.35)


class Thumbnails:
    """Previews of the frames of one clip."""

    def __init__(self) -> None:
        self._previews = bpy.utils.previews.new()

    def icon(
        self, number: int, fate: Fate, thumbnail: Callable[[], NDArray[np.uint8]], middle: tuple[float, float]
    ) -> int:
        """The icon of a frame; `thumbnail` gives (height, width, 3), top row first; `middle` is in parts of it."""
        name = f"{number} {fate.name}"
        if name not in self._previews:
            pixels = framed(square(thumbnail(), middle), fate)
            preview: Any = self._previews.new(name)
            preview.image_size = pixels.shape[1::-1]
            preview.image_pixels_float.foreach_set(pixels[::-1].ravel())
        return self._previews[name].icon_id

    def close(self) -> None:
        """Let go of them."""
        bpy.utils.previews.remove(self._previews)


def square(picture: NDArray[np.uint8], middle: tuple[float, float]) -> NDArray[np.uint8]:
    """The largest square of a picture with a place as near to its middle as can be."""
    side = min(picture.shape[:2])
    corner = [
        int(np.clip(round(place * length - side / 2), 0, length - side))
        for place, length in zip(middle, picture.shape[1::-1], strict=True)
    ]
    return picture[corner[1] : corner[1] + side, corner[0] : corner[0] + side]


def framed(picture: NDArray[np.uint8], fate: Fate) -> NDArray[np.float32]:
    """(n, n, 4) with a frame; what is left out is dark and pale."""
    colours = picture.astype(np.float32) / 255.0
    if fate is Fate.LEFT_OUT:
        grey = colours.mean(axis=2, keepdims=True)
        colours = DARK * (grey + PALE * (colours - grey))
    pixels = np.ones((*picture.shape[:2], 4), np.float32)
    pixels[..., :3] = fate.value
    inner = slice(FRAME, -FRAME)
    pixels[inner, inner, :3] = colours[inner, inner]
    return pixels
