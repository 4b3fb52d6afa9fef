"""What of a head's movement other programs do not have."""

import bpy
import numpy as np

from ..engine import FacewrightError
from .export_bones import is_bound
from .export_sample import SAME, Track
from .heads import SKIN, Head


def check(head: Head, tracks: dict[str, Track], is_joined: bool, has_bones: bool) -> None:
    """Refuse a head that moves as its file could not say, before the file is written."""
    if has_bones:
        _check_bound(head, tracks)
    if is_joined:
        _check_joinable(head, tracks)


def _check_bound(head: Head, tracks: dict[str, Track]) -> None:
    """What follows bones has no place of its own over time in most programs."""
    carried = np.linalg.inv(tracks[SKIN].places)
    for name, part in head.parts.items():
        if is_bound(part) and np.ptp(carried @ tracks[name].places, axis=0).max() > SAME:
            raise FacewrightError(
                f"{part.name} moves against {head.name} and follows bones too, as no other program has it: "
                "take its own keyframes away, or remove the controls"
            )


def _check_joinable(head: Head, tracks: dict[str, Track]) -> None:
    """One mesh has one place and one value for each key."""
    skin = tracks[SKIN]
    titles = _key_names(head.parts[SKIN])
    for name, track in tracks.items():
        part = head.parts[name]
        local = np.linalg.inv(skin.places) @ track.places
        if np.ptp(local, axis=0).max() > SAME:
            raise FacewrightError(f"{part.name} moves against {head.name}, as one mesh cannot: export without One Mesh")
        for key, values in zip(_key_names(part), track.values.T):
            if key not in titles or np.abs(values - skin.values[:, titles.index(key)]).max() > SAME:
                raise FacewrightError(
                    f"the shape key {key} of {part.name} does not follow {head.name}'s: export without One Mesh"
                )


def _key_names(obj: bpy.types.Object) -> list[str]:
    """The shape keys of an object but the first."""
    keys = obj.data.shape_keys
    return [block.name for block in keys.key_blocks[1:]] if keys is not None else []
