"""What the windows show of a head."""

import bpy


def present(window: bpy.types.Window) -> None:
    """Frame what is selected in the 3D views of a window, with its textures.

    A view through a camera stays as it is; so do the colours of one that shows materials or lights already.
    """
    for area in window.screen.areas:
        if area.type != "VIEW_3D":
            continue
        space = area.spaces.active
        if space.shading.type == "SOLID":
            space.shading.color_type = "TEXTURE"
        if space.region_3d.view_perspective != "CAMERA":
            region = next(region for region in area.regions if region.type == "WINDOW")
            with bpy.context.temp_override(window=window, area=area, region=region):
                bpy.ops.view3d.view_selected()
