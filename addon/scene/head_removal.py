"""A head taken out of the file: with all that only it uses, and nothing of the artist's."""

import bpy

from . import belongings, heads
from .heads import PART, Head

# More are counted, not named.
NAMED = 3


def remove(head: Head) -> list[str]:
    """Take a head away; gives what stays, and why, in a few texts.

    What the artist hung on it stays where it is. Its collection stays with what else is in it, as the artist's own.
    """
    gone, home = [*head.objects, *belongings.led(head)], head.home
    left = belongings.everything(gone)
    _let_go(gone)
    bpy.data.batch_remove(gone)
    left = _removed(left)
    marked = [one for one in left if one.use_fake_user]
    used = [one for one in left if not one.use_fake_user]
    stays = [f"{_names(used)} (used elsewhere)"] if used else []
    stays += [f"{_names(marked)} (with a fake user)"] if marked else []
    return stays + (_leave(home) if home is not None else [])


def _let_go(gone: list[bpy.types.Object]) -> None:
    """Take what hangs on objects off them, and leave it where it is seen."""
    carried = [obj for obj in bpy.data.objects if obj.parent in gone and obj not in gone and obj.library is None]
    for obj in carried:
        place = obj.matrix_world.copy()
        obj.parent = None
        obj.matrix_world = place


def _removed(data: list[bpy.types.ID]) -> list[bpy.types.ID]:
    """Remove what nothing uses any more; gives the rest."""
    while unused := [one for one in data if not one.users and one.library is None]:
        data = [one for one in data if one not in unused]
        bpy.data.batch_remove(unused)
    return data


def _leave(home: bpy.types.Collection) -> list[str]:
    """Remove a head's collection, or make it the artist's own where something else is in it."""
    if any(obj.get(PART) for obj in home.all_objects):
        # A copy of the head is in it, which goes on having it.
        return []
    held = [*home.objects, *home.children]
    if not held:
        bpy.data.collections.remove(home)
        return []
    for name in (heads.KEY, heads.CLIP):
        if name in home:
            del home[name]
    home.asset_clear()
    return [f"the collection {home.name} with {_names(held)}"]


def _names(data: list[bpy.types.ID]) -> str:
    names = [one.name for one in data[:NAMED]]
    return ", ".join(names) + (f" and {len(data) - NAMED} more" if len(data) > NAMED else "")
