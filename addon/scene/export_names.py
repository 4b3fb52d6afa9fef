"""The names of a copied head, which its original may have."""

import re
import unicodedata
from itertools import count
from uuid import uuid4

import bpy

# Letters of a head's name, so that its parts' fit too.
LONGEST = 40


class Names:
    """Names that copies need; who has one gets it back in the end."""

    def __init__(self) -> None:
        self._owners: list[tuple[bpy.types.ID, str]] = []
        self._given: set[tuple[str, str]] = set()

    def give(self, data: bpy.types.ID, name: str) -> None:
        """Name a copy, with a number if another copy of its kind has the name.

        Who has the name in the file is moved first: Blender would give numbers to either.
        """
        kind = _kind(data)
        numbered = (name if number == 0 else f"{name}_{number}" for number in count())
        name = next(wanted for wanted in numbered if (kind, wanted) not in self._given)
        self._given.add((kind, name))
        owner = getattr(bpy.data, kind).get((name, None))
        if owner is not None and owner != data:
            self._owners.append((owner, name))
            set_aside(owner)
        data.name = name

    def of(self, data: bpy.types.ID) -> str:
        """The artist's name of data, whoever has it now."""
        return next((name for owner, name in self._owners if owner == data), data.name)

    def give_back(self) -> None:
        for owner, name in reversed(self._owners):
            owner.name = name


def set_aside(data: bpy.types.ID) -> None:
    """Give data a name that nothing else has or wants."""
    data.name = uuid4().hex


def identifier(name: str) -> str:
    """A name as every format and engine takes it: ASCII letters, digits and underscores."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    plain = re.sub(r"[^A-Za-z0-9]+", "_", plain).strip("_")[:LONGEST]
    return f"_{plain}" if plain[:1].isdigit() else plain or "Head"


def _kind(data: bpy.types.ID) -> str:
    """Where the file keeps data of this kind."""
    kinds = {"Mesh": "meshes", "Armature": "armatures", "Material": "materials", "Image": "images"}
    return ({"Scene": "scenes", "Object": "objects"} | kinds)[data.bl_rna.identifier]
