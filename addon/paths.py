"""What Blender has to be told of paths that may begin with `//`, the folder of the .blend file."""

import bpy

# Blender before 4.5 asks nobody, and does not know the word.
RELATIVE: set[str] = {"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5, 0) else set()
