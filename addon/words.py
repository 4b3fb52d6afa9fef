"""Texts that are put together, or shown where Blender translates nothing, in the language of the interface."""

from typing import Any

import bpy

pgettext_iface = bpy.app.translations.pgettext_iface


def say(text: str, **given: Any) -> str:
    """A text as the user's language has it, with what is given in place of its braces; as it is where it has none."""
    said = pgettext_iface(text)
    return said.format(**given) if given else said


def sentence(text: str, **given: Any) -> str:
    """The same with a capital letter, for panels and tooltips."""
    said = say(text, **given)
    return said[:1].upper() + said[1:]
