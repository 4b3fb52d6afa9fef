"""Options of properties that Blender's versions call differently, and that many of ours have."""

import bpy

# A path may begin with `//`, which stands for the folder of the file; Blender before 4.5 does not ask.
BLEND_RELATIVE: set[str] = (
    {"PATH_SUPPORTS_BLEND_RELATIVE"}
    if "is_path_supports_blend_relative" in bpy.types.Property.bl_rna.properties
    else set()
)

# The context of texts that Blender has translated for something else: paper to write on, expressions that are computed.
OURS = "Facewright"
