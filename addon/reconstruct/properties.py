"""Settings of the clip and the reconstruction."""

import bpy


class FacewrightClip(bpy.types.PropertyGroup):
    """The frames a head is made from."""

    path: bpy.props.StringProperty(
        name="Clip", description="A video, a folder of frames, or the first of an image sequence", subtype="FILE_PATH"
    )
    use_range: bpy.props.BoolProperty(
        name="Part of the Clip", description="Use only some of the clip's frames", default=False
    )
    first: bpy.props.IntProperty(name="First", description="First frame used, counted from 0", default=0, min=0)
    last: bpy.props.IntProperty(name="Last", description="Last frame used, counted from 0", default=250, min=0)
    method: bpy.props.EnumProperty(
        name="Method",
        items=[
            ("default", "Default", "Every frame, a class of heads, even light"),
            ("paper", "Paper", "The steps of Liang, Pan, Chen 2004"),
        ],
    )
    texture_size: bpy.props.EnumProperty(
        name="Texture",
        items=[(str(n), f"{n} px", f"Texture of {n} × {n} pixels") for n in (1024, 2048, 4096)],
        default="2048",
    )
    use_markers: bpy.props.BoolProperty(
        name="Use Markers",
        description="Use the face's tracks as they are in the Clip editor instead of tracking anew",
        default=False,
    )
    output: bpy.props.StringProperty(
        name="Result Folder",
        description="Also write head.glb, texture.png, eyes.png and report.json here",
        subtype="DIR_PATH",
    )
