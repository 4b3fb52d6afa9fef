"""A tracks.json: what the library reads of it."""

from facewright import Track as Track
from facewright import TrackedFrame as TrackedFrame

REGIONS = ("skin", "mouth", "eyes", "brows")
