"""What the expressions' buttons do."""

from typing import Any

from ..engine import FacewrightError
from ..scene import head as scene_head

NEUTRAL = "neutral"


def face(scene: Any) -> Any:
    """The skin object that the buttons act on; None without a head."""
    return scene_head.face(scene)


def names(skin: Any) -> list[str]:
    """The expressions of a head, the one without any first."""
    return [NEUTRAL, *scene_head.expressions(skin)]


def express(skin: Any, name: str, strength: float, frame: int | None) -> None:
    """Set a head's keys to an expression; insert keyframes at a frame if one is given."""
    if name not in names(skin):
        raise FacewrightError(f"there is no expression {name}: choose one of {', '.join(names(skin))}")
    pose = scene_head.expressions(skin).get(name, {})
    scene_head.set_keys(skin, {key: value * strength for key, value in pose.items()}, frame)
