"""Which bone leads which key, and where the handles are in the panel beside the face.

Names are Rigify's and ARKit's where they have one for the same thing. The panel is seen as the face is: the person's
left is on its right.
"""

from dataclasses import dataclass

# How far a handle goes for a key's whole value, metres.
TRAVEL = 0.01
# What the jaw's bone does for a whole key: as the generic head's lower teeth turn, and about as far as its chin goes.
OPEN, SIDEWAYS, FORWARD = 0.43, 0.1, 0.0095

ROOT, NECK, HEAD, JAW, EYES, PANEL = "root", "neck", "head", "jaw_master", "eyes", "face_panel"
# Where each eye has the target; of no use to the artist.
AIMS = {"Left": "MCH-eye.L", "Right": "MCH-eye.R"}
# Those that move the mesh.
DEFORMING = (ROOT, NECK, HEAD)
LOCATION, ROTATION = "location", "rotation_euler"


@dataclass(frozen=True)
class Axis:
    """A number of a bone, by the bone's role: one way it leads a key, the other way another."""

    role: str
    channel: str
    index: int


@dataclass(frozen=True)
class Link:
    """What leads a key: `full` is where the axis brings it to 1."""

    axis: Axis
    full: float


@dataclass(frozen=True)
class Handle:
    """A handle of the panel: its place, to the right and up in travels; its keys to the right, left, up and down."""

    role: str
    place: tuple[float, float]
    label: str
    keys: tuple[str, str, str, str]

    @property
    def links(self) -> dict[str, Link]:
        ways = zip(self.keys, ((0, TRAVEL), (0, -TRAVEL), (1, TRAVEL), (1, -TRAVEL)))
        return {key: Link(Axis(self.role, LOCATION, index), full) for key, (index, full) in ways if key}


# Outwards, inwards, up, down.
_PAIRED = [
    ("brow.T", (5.0, 8.2), "Brow", ("", "", "browOuterUp", "browDown")),
    ("lid.T", (7.4, 4.8), "Lid", ("", "", "eyeWide", "eyeBlink")),
    ("lid.B", (4.9, 4.8), "Squint", ("", "", "eyeSquint", "")),
    ("gaze", (1.8, 4.8), "Gaze", ("eyeLookOut", "eyeLookIn", "eyeLookUp", "eyeLookDown")),
    ("cheek.T", (5.0, 1.6), "Cheek", ("", "", "cheekSquint", "")),
    ("nose", (2.5, 1.6), "Nose", ("", "", "noseSneer", "")),
    ("lips", (6.8, -3.6), "Corner", ("mouthStretch", "mouthDimple", "mouthSmile", "mouthFrown")),
    ("lip.T", (3.4, -1.8), "Lip up", ("", "", "mouthUpperUp", "")),
    ("lip.B", (3.4, -5.2), "Press, down", ("", "", "mouthPress", "mouthLowerDown")),
]
# To the person's left, to the right, up, down.
_MIDDLE = [
    ("brow.T", (0.0, 8.2), "Inner brow", ("", "", "browInnerUp", "")),
    ("cheeks", (0.0, 1.6), "Puff", ("", "", "cheekPuff", "")),
    ("lip.T", (0.0, -1.8), "Shrug, roll", ("", "", "mouthShrugUpper", "mouthRollUpper")),
    ("lip.B", (0.0, -5.2), "Shrug, roll", ("", "", "mouthShrugLower", "mouthRollLower")),
    ("mouth", (-4.2, -8.6), "Mouth, close", ("mouthLeft", "mouthRight", "mouthClose", "")),
    ("lips", (0.0, -8.6), "Pucker, funnel", ("mouthPucker", "", "mouthFunnel", "")),
    ("tongue", (4.2, -8.6), "Tongue", ("", "", "", "tongueOut")),
]


def _sides(role: str, place: tuple[float, float], label: str, keys: tuple[str, str, str, str]) -> list[Handle]:
    """The handles of both sides of the face."""
    left, right = (tuple(key and key + side for key in keys) for side in ("Left", "Right"))
    mirrored = (right[1], right[0], right[2], right[3])
    return [
        Handle(f"{role}.L", place, label, (left[0], left[1], left[2], left[3])),
        Handle(f"{role}.R", (-place[0], place[1]), label, mirrored),
    ]


HANDLES = [handle for row in _PAIRED for handle in _sides(*row)] + [Handle(*row) for row in _MIDDLE]
_JAW = {
    "jawOpen": Link(Axis(JAW, ROTATION, 0), OPEN),
    "jawLeft": Link(Axis(JAW, ROTATION, 2), -SIDEWAYS),
    "jawRight": Link(Axis(JAW, ROTATION, 2), SIDEWAYS),
    "jawForward": Link(Axis(JAW, LOCATION, 1), FORWARD),
}
# What leads each of ARKit's keys.
LINKS: dict[str, Link] = _JAW | {key: link for handle in HANDLES for key, link in handle.links.items()}
GAZE = [key for key in LINKS if key.startswith("eyeLook")]


def axes() -> dict[Axis, tuple[str, str]]:
    """Every axis with the key that it leads upwards, and the one downwards; empty where there is none."""
    found: dict[Axis, tuple[str, str]] = {}
    for key, link in LINKS.items():
        plus, minus = found.get(link.axis, ("", ""))
        found[link.axis] = (key, minus) if link.full > 0.0 else (plus, key)
    return found
