"""What the buttons of controls do."""

from collections.abc import Callable
from typing import Any

from ..engine import FacewrightError
from ..scene import controls, controls_find, heads
from ..scene.controls_layout import AIMS, EYES, LINKS
from ..words import say

NONE = "Add Controls first"
# The property of the gaze target that says how far the eyes follow it.
FOLLOW = controls_find.FOLLOW
# How many sentences about single keys a message has before it says how many more there are.
NAMED = 2


def head(scene: Any, active: Any) -> Any:
    """The head that the buttons act on: of the active object, or the last one made; None without."""
    shown = heads.current(scene, active, scene.facewright_clip.wanted)
    return shown[0] if shown is not None else None


def adding_complaint(scene: Any, active: Any) -> str:
    """Why no controls can be added; empty if they can."""
    found = head(scene, active)
    return controls.complaint(found) if found is not None else say("Reconstruct a face first")


def removing_complaint(scene: Any, active: Any) -> str:
    """Why no controls can be removed; empty if they can."""
    found = head(scene, active)
    if found is None:
        return say("Reconstruct a face first")
    if not found.is_local:
        return say("{head} is linked from another file: change it there", head=found.name)
    return "" if controls.has(found) else say(NONE)


def armature(scene: Any, active: Any) -> Any:
    """The armature of the head that the buttons act on; None without."""
    found = head(scene, active)
    return controls_find.of(found.skin) if found is not None and found.skin is not None else None


def add(scene: Any, active: Any) -> tuple[Any, str]:
    """Give the head controls, or bring its own up to date; gives the armature and the message."""
    found = head(scene, active)
    if found is None:
        raise FacewrightError("Reconstruct a face first")
    made, left = controls.add(found)
    count = len(controls_find.led(found.skin) & LINKS.keys())
    more = [f"{len(left) - NAMED} more keys stay as they are"] if len(left) > NAMED else []
    return made, "; ".join([f"{made.name} lead {count} keys: drag a handle beside the face", *left[:NAMED], *more])


def remove(scene: Any, layer: Any, active: Any) -> str:
    """Take the controls of the head away, and make its skin active; gives the message."""
    if sentence := removing_complaint(scene, active):
        raise FacewrightError(sentence)
    found = head(scene, active)
    controls.remove(found)
    layer.update()
    if found.skin in layer.objects.values():
        layer.objects.active = found.skin
    return f"The keys of {found.skin.name} have its pose and keyframes; neck and head are straight"


def target(made: Any) -> Any:
    """The bone that the eyes look at; None where the artist has deleted it."""
    return controls_find.bones(made).get(EYES)


def groups(made: Any) -> list[Any]:
    """The groups of bones that an artist shows and hides: not that of bones which only aim."""
    aiming = {pose.name for role, pose in controls_find.bones(made).items() if role in AIMS.values()}
    return [group for group in made.data.collections if {bone.name for bone in group.bones} - aiming]


def mark(made: Any, is_wanted: Callable[[str], bool]) -> None:
    """Select the bones of an armature whose roles are wanted, and no others."""
    wanted = {pose.name for role, pose in controls_find.bones(made).items() if is_wanted(role)}
    for pose in made.pose.bones:
        # Blender 5.0 selects bones of poses, and those before the armature's.
        holder = pose if hasattr(pose, "select") else pose.bone
        holder.select = pose.name in wanted


def select(layer: Any, made: Any) -> bool:
    """Make an armature the only selected and the active object; false where the view layer leaves it out."""
    layer.update()
    if made not in layer.objects.values():
        return False
    for obj in layer.objects.selected:
        obj.select_set(False, view_layer=layer)
    made.hide_set(False, view_layer=layer)
    made.select_set(True, view_layer=layer)
    layer.objects.active = made
    return True
