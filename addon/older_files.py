"""What an older version has saved in a file, taken over when the file is opened, or is open already."""

from typing import Any

import bpy

from .reconstruct.actions import TEXTURE_SIZES
from .scene import heads

# Settings of the clip that are the person's now.
OF_PERSON = ("use_interocular", "interocular_mm")
# What is the preferences' now unless it is chosen.
TEXTURE = "texture_size"


def register() -> None:
    bpy.app.handlers.load_post.append(_opened)
    # An extension that is put into a running Blender may not look at the open file before it is registered.
    bpy.app.timers.register(take_over, first_interval=0.0)


def unregister() -> None:
    if bpy.app.timers.is_registered(take_over):
        bpy.app.timers.unregister(take_over)
    bpy.app.handlers.load_post.remove(_opened)


@bpy.app.handlers.persistent
def _opened(_path: str) -> None:
    take_over()


def take_over() -> None:
    """Bring every scene of the open file to what this version expects; changes nothing the second time."""
    for scene in bpy.data.scenes:
        if scene.library is None:
            _take_person(scene)
            _take_clip(scene)
            _take_texture(scene)


def _take_person(scene: bpy.types.Scene) -> None:
    saved = _saved(scene.facewright_clip)
    for name in OF_PERSON:
        if name in saved:
            setattr(scene.facewright_person, name, saved[name])
            del saved[name]


def _take_clip(scene: bpy.types.Scene) -> None:
    """The head of a scene without a key was the only one, and its clip the panel's."""
    path = scene.facewright_clip.path
    for head in [head for head in heads.heads(scene) if path and not head.key and head.is_local]:
        if head.skin is not None and head.clip is None:
            head.skin[heads.CLIP] = path


def _take_texture(scene: bpy.types.Scene) -> None:
    """The size of a texture was saved as the number of the choice."""
    settings = scene.facewright_clip
    saved = _saved(settings)
    if TEXTURE in saved:
        settings.texture_px = TEXTURE_SIZES[saved[TEXTURE]]
        del saved[TEXTURE]


def _saved(group: bpy.types.PropertyGroup) -> Any:
    """What a file has of a group, by names; those that this version does not declare too."""
    system = getattr(group, "bl_system_properties_get", None)
    return group if system is None else (system() or {})
