"""What the expressions' buttons do."""

from typing import Any

from ..engine import FacewrightError
from ..scene import head as scene_head
from ..scene import heads

NEUTRAL = "neutral"


def face(scene: Any, active: Any) -> Any:
    """The skin object that the buttons act on: of the active object's head, or of the last one made; None without."""
    return named_face(scene, active)[0]


def named_face(scene: Any, active: Any) -> tuple[Any, str]:
    """The same with what tells its head from others; that is empty where there is only one."""
    shown = heads.current(scene, active, scene.facewright_clip.wanted)
    return (shown[0].skin, shown[1]) if shown is not None else (None, "")


def complaint(skin: Any) -> str:
    """Why the keys of a head cannot be set; empty if they can."""
    if skin is None:
        return "Reconstruct a face first"
    if not skin.data.shape_keys.is_editable:
        return f"the shape keys of {skin.name} are linked from another file: set them there, or append the head instead"
    return ""


def names(skin: Any) -> list[str]:
    """The expressions of a head, the one without any first."""
    return [NEUTRAL, *scene_head.expressions(skin)]


def express(skin: Any, name: str, strength: float, frame: int | None) -> None:
    """Set a head's keys to an expression; insert keyframes at a frame if one is given."""
    if name not in names(skin):
        raise FacewrightError(f"there is no expression {name}: choose one of {', '.join(names(skin))}")
    pose = scene_head.expressions(skin).get(name, {})
    scene_head.set_keys(skin, {key: value * strength for key, value in pose.items()}, frame)
