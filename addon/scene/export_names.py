"""The names of a copied head, which its original may have."""

import re
import unicodedata
from uuid import uuid4

import bpy

# Letters of a head's name, so that its parts' fit too.
LONGEST = 40


class Names:
    """Names that copies need; who has one gets it back in the end."""

    def __init__(self) -> None:
        self._owners: list[tuple[bpy.types.ID, str]] = []

    def give(self, data: bpy.types.ID, name: str) -> None:
        """Name a copy. Who has the name is moved first: Blender would let both have numbers as it likes."""
        owner = getattr(bpy.data, _kind(data)).get((name, None))
        if owner is not None and owner != data:
            self._owners.append((owner, name))
            owner.name = uuid4().hex
        data.name = name

    def give_back(self) -> None:
        for owner, name in reversed(self._owners):
            owner.name = name


def identifier(name: str) -> str:
    """A name as every format and engine takes it: ASCII letters, digits and underscores."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    plain = re.sub(r"[^A-Za-z0-9]+", "_", plain).strip("_")[:LONGEST]
    return f"_{plain}" if plain[:1].isdigit() else plain or "Head"


def _kind(data: bpy.types.ID) -> str:
    """Where the file keeps data of this kind."""
    kinds = {"Scene": "scenes", "Object": "objects", "Mesh": "meshes", "Material": "materials", "Image": "images"}
    return kinds[data.bl_rna.identifier]
