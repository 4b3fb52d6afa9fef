"""A tracks.json: what the library reads of it."""

from facewright import Track as Track
from facewright import TrackedFrame as TrackedFrame
from facewright import Tracks

REGIONS = ("skin", "mouth", "eyes", "brows")


def parse(text: str) -> Tracks:
    """Read a tracks.json; raises FacewrightError with what is wrong."""
    return Tracks.parse(text)


def to_text(tracks: Tracks) -> str:
    """The text of a tracks.json."""
    return tracks.to_json()
