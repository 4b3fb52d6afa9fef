"""What holds for this user in every file."""

import bpy

from . import preferred
from .engine import use_assets
from .help.operators import FACEWRIGHT_OT_manual
from .options import BLEND_RELATIVE
from .reconstruct.actions import TEXTURE_SIZES


class FacewrightPreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    assets: bpy.props.StringProperty(
        name="Assets",
        description="Folder of the generic head and the nets that find faces; empty: those of the extension. The "
        "environment variable FACEWRIGHT_ASSETS goes before it",
        subtype="DIR_PATH",
        options=BLEND_RELATIVE,
        update=lambda self, _context: use_assets(bpy.path.abspath(self.assets)),
    )
    texture_size: bpy.props.EnumProperty(
        name="Texture",
        description="Size of the textures in scenes where no other was chosen, in pixels",
        items=[(str(n), f"{n} px", f"Texture of {n} × {n} pixels") for n in TEXTURE_SIZES],
        default="2048",
        update=lambda self, _context: prefer_texture(self.texture_size),
    )

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.prop(self, "assets", placeholder="Built-in")
        layout.prop(self, "texture_size")
        layout.operator(FACEWRIGHT_OT_manual.bl_idname, icon="HELP")


def register() -> None:
    """Let hold what the user has set before; the classes are registered already."""
    addon = bpy.context.preferences.addons.get(__package__)
    # Blender enables add-ons without preferences where they are not to be remembered.
    if addon is not None:
        use_assets(bpy.path.abspath(addon.preferences.assets))
        prefer_texture(addon.preferences.texture_size)


def prefer_texture(size: str) -> None:
    """Let a size be that of every scene without one of its own."""
    preferred.texture_px = int(size)
