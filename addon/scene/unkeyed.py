"""What an artist has changed and not keyed yet: another look at the scene would set it to its animation."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy

from . import pose_keys

# An owner, the path of its property, and the position within it; -1 for a whole one.
Place = tuple[bpy.types.ID, str, int]


@contextmanager
def kept() -> Iterator[None]:
    """Whatever happens to animated properties of the file, they have the values that they had."""
    before = {place: value for place in _animated() if (value := _value(*place)) is not None}
    try:
        yield
    finally:
        for place, value in before.items():
            if _value(*place) != value:
                _set(*place, value)


def _animated() -> Iterator[Place]:
    for owner in bpy.data.user_map():
        if getattr(owner, "animation_data", None) is not None:
            for path, index in pose_keys.paths_of(owner):
                yield owner, path, index


def _value(owner: bpy.types.ID, path: str, index: int) -> Any:
    """A value as it is now; None for a property that is not there any more."""
    try:
        value = owner.path_resolve(path)
        return value[index] if _has_parts(value) else value
    except (ValueError, IndexError):
        return None


def _set(owner: bpy.types.ID, path: str, index: int, value: Any) -> None:
    if path.endswith('"]'):
        holder, _, name = path[:-2].rpartition('["')
    else:
        holder, _, name = path.rpartition(".")
    within = owner.path_resolve(holder) if holder else owner
    if _has_parts(owner.path_resolve(path)):
        owner.path_resolve(path)[index] = value
    elif path.endswith('"]'):
        within[name] = value
    else:
        setattr(within, name, value)


def _has_parts(value: Any) -> bool:
    return hasattr(value, "__len__") and not isinstance(value, (str, set))
