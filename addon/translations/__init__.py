"""The interface in other languages: a module for each, with its texts by the English ones."""

import bpy

from ..options import OURS
from . import de, fr, ja, zh_HANS

# By the names that Blender has for languages; what it has for a country takes the language's.
LANGUAGES = {"de": de.TEXTS, "fr": fr.TEXTS, "ja": ja.TEXTS, "zh_HANS": zh_HANS.TEXTS}
# Blender looks texts of buttons up in a context of their own, and prefers its translations to ours: some texts have our
# own context. With us a text means the same on a button and elsewhere.
CONTEXTS = (bpy.app.translations.contexts.default, bpy.app.translations.contexts.operator_default, OURS)


def register() -> None:
    """Give the texts to Blender, which asks for them where it has none itself."""
    messages = {
        language: {(context, text): said for text, said in texts.items() for context in CONTEXTS}
        for language, texts in LANGUAGES.items()
    }
    bpy.app.translations.register(__package__, messages)


def unregister() -> None:
    bpy.app.translations.unregister(__package__)
