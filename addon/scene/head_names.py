"""A head's name, given to all of it."""

import bpy

from . import belongings, heads
from .heads import Head


def rename(scene: bpy.types.Scene, head: Head, title: str) -> str:
    """Name skin and collection of a head; its other data too, where their names begin with the one that it had.

    Data that another head uses too keep their names, and so do those that the artist named. Gives the name, which
    Blender makes another one if it is taken.
    """
    head = heads.claimed(scene, head)
    skin, home, before = head.skin, head.home, stems(head)
    assert skin is not None and home is not None, "a head that is renamed has both"
    skin.name = title
    name = skin.name
    home.name = skin.data.name = name
    skin[heads.NAME] = name
    objects = belongings.things(head)
    for data in [*(obj for obj in objects if obj != skin), *_own(objects)]:
        if called := named_alike(data.name, before, name):
            data.name = called
    return name


def stems(head: Head) -> list[str]:
    """What the names of a head's data may begin with."""
    return [head.name, *([head.home.name] if head.home is not None else [])]


def named_alike(called: str, before: list[str], name: str) -> str:
    """What is called after a head's former names, called after its name; empty for what is not."""
    stem = next((old for old in before if called == old or called.startswith(f"{old} ")), None)
    return "" if stem is None else name + called[len(stem) :]


def _own(objects: list[bpy.types.Object]) -> list[bpy.types.ID]:
    """What only some objects use; an editor that shows it is no user."""
    data = [one for one in belongings.everything(objects) if one.library is None]
    known = {*data, *objects, *belongings.keys_of(objects)}
    users = bpy.data.user_map(subset=data)
    return [one for one in data if all(user in known or isinstance(user, bpy.types.Screen) for user in users[one])]
