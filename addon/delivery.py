"""When and where the result of work can be put into a file that an artist goes on with meanwhile."""

from contextlib import suppress
from typing import Any

import bpy

# What a result waits for, as stages.
DRAGGED, RENDERED = "done, let go of the mouse", "done, waits for the render"


def is_dragging(context: bpy.types.Context) -> bool:
    """Whether another operator holds the mouse in any window."""
    # Where Blender does not tell, nothing waits.
    running = [o for window in context.window_manager.windows for o in getattr(window, "modal_operators", ())]
    return any({"BLOCKING", "GRAB_CURSOR"} & operator.bl_options for operator in running)


def busy_with(context: bpy.types.Context) -> str:
    """What a result must wait for, as a stage; empty if for nothing. A render reads pictures that a run replaces."""
    if is_dragging(context):
        return DRAGGED
    return RENDERED if any(map(bpy.app.is_job_running, ("RENDER", "OBJECT_BAKE"))) else ""


def window_of(context: bpy.types.Context) -> bpy.types.Window | None:
    """The window that shows what was made; none in the background, nor for a script that a timer calls."""
    return None if bpy.app.background else context.window


def scene_of(context: bpy.types.Context, number: int) -> tuple[dict[str, Any], list[str]]:
    """How the context must be other for the scene of a number, and what is to be said; nothing where it is shown."""
    scene = next((scene for scene in bpy.data.scenes if scene.session_uid == number), None)
    if scene is None:
        return {}, [f"the scene in which this began is gone, so it is in {context.scene.name}"]
    if scene == context.scene:
        return {}, []
    windows = [window for window in context.window_manager.windows if window.scene == scene]
    where = {"window": windows[0]} if windows else {"scene": scene, "view_layer": scene.view_layers[0]}
    return where, [f"it is in the scene {scene.name}, in which it began"]


def leave_modes(context: bpy.types.Context) -> list[str]:
    """Put all objects into Object Mode, those of scenes that no window shows too, and say of which it was another.

    What is in Edit Mode would overwrite what is made of it, and its undo steps know nothing of other data.
    """
    left = []
    for scene, layer in [(each, layer) for each in bpy.data.scenes for layer in each.view_layers]:
        # A layer has None where an object was deleted just now.
        for obj in [obj for obj in layer.objects if obj is not None and obj.mode != "OBJECT"]:
            mode = obj.mode
            _leave_mode(context, scene, layer, obj)
            if mode != obj.mode:
                left.append(f"{obj.name} was in {mode.replace('_', ' ').title()} Mode, which was left")
    return left


def _leave_mode(
    context: bpy.types.Context, scene: bpy.types.Scene, layer: bpy.types.ViewLayer, obj: bpy.types.Object
) -> None:
    before, layer.objects.active = layer.objects.active, obj
    where = {"scene": scene, "view_layer": layer, "active_object": obj, "object": obj}
    where |= {"edit_object": obj} if obj.mode == "EDIT" else {}
    # Blender cannot for some of what is hidden; the result must not be lost over that.
    with context.temp_override(**where), suppress(RuntimeError):
        bpy.ops.object.mode_set(mode="OBJECT")
    layer.objects.active = before
