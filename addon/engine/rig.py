"""A rig.json: what the library reads of it, remembered for panels."""

from functools import lru_cache

from facewright import Rig


@lru_cache(maxsize=4)
def parse(text: str) -> Rig:
    """Read a rig.json; raises FacewrightError with what is wrong. Cheap when asked again, so that panels may."""
    return Rig.parse(text)
