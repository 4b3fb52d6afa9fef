"""A motion.json: what the library reads of it, remembered for panels."""

from functools import lru_cache

from facewright import Motion
from facewright import MotionFrame as MotionFrame
from facewright import MotionPoints as MotionPoints


@lru_cache(maxsize=4)
def parse(text: str) -> Motion:
    """Read a motion.json; raises FacewrightError with what is wrong. Cheap when asked again, so that panels may."""
    return Motion.parse(text)
