"""Options of properties that Blender's versions call differently."""

import bpy

# A path may begin with `//`, which stands for the folder of the file; Blender before 4.5 does not ask.
BLEND_RELATIVE: set[str] = (
    {"PATH_SUPPORTS_BLEND_RELATIVE"}
    if "is_path_supports_blend_relative" in bpy.types.Property.bl_rna.properties
    else set()
)
