"""Settings of tracking."""

import bpy

from ..options import OURS


class FacewrightTrack(bpy.types.PropertyGroup):
    """How the points of a face are tracked."""

    span: bpy.props.EnumProperty(
        name="Frames",
        description="The frames to track in",
        items=[
            ("CLIP", "Clip", "All frames of the clip"),
            ("SCENE", "Scene", "The scene's frame range, or its preview range"),
            ("CUSTOM", "Range", "The first and last frame below"),
        ],
        default="CLIP",
    )
    first: bpy.props.IntProperty(name="First", description="First frame, as on the timeline", default=1)
    last: bpy.props.IntProperty(name="Last", description="Last frame, as on the timeline", default=250)
    points: bpy.props.IntProperty(
        name="Points",
        description="How many points to track from each reference frame",
        default=200,
        min=8,
        max=5000,
        soft_max=1000,
    )
    method: bpy.props.EnumProperty(
        name="Method",
        translation_context=OURS,
        description="Chain of steps by which points are tracked",
        items=[
            ("default", "Default", "Patches warped with the head, over the whole clip"),
            ("paper", "Paper", "The steps of Liang, Pan, Chen 2004"),
        ],
    )
    use_window: bpy.props.BoolProperty(
        name="Known Window", description="Set the size of the pattern instead of deriving it from the face"
    )
    window: bpy.props.IntProperty(
        name="Pattern", description="Side of the pattern that is tracked, pixels", default=15, min=3, max=101, step=2
    )
