"""Settings of a rig: the cameras' folders, and what was calibrated from them."""

import bpy

from ..options import BLEND_RELATIVE


class FacewrightRigFolder(bpy.types.PropertyGroup):
    """A camera of a rig, and the pictures of the board that it took."""

    name: bpy.props.StringProperty(name="Camera", description="Name of the camera")
    path: bpy.props.StringProperty(
        name="Pictures",
        description="Folder of the camera's pictures of the board. Pictures of one moment have the same number at "
        "the end of their names in all folders, or the same position in the order",
        subtype="DIR_PATH",
        options=BLEND_RELATIVE,
    )


class FacewrightRig(bpy.types.PropertyGroup):
    """Cameras that filmed together."""

    text: bpy.props.StringProperty(name="Rig", description="The calibrated cameras, as rig.json", default="")
    folders: bpy.props.CollectionProperty(type=FacewrightRigFolder)
    camera: bpy.props.StringProperty(
        name="Camera", description="The rig's camera that filmed the clip; empty if none was chosen", default=""
    )
    fingerprint: bpy.props.StringProperty(
        name="Fingerprint",
        description="Fingerprint of the chosen camera, to notice when another one is used",
        default="",
    )
