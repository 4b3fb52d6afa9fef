"""Settings of the motion."""

from math import pi, radians

import bpy

from . import actions


class FacewrightMotion(bpy.types.PropertyGroup):
    """How a head's motion is found from its tracks, and shown."""

    clip: bpy.props.PointerProperty(
        name="Movie Clip", description="The clip with the face's tracks", type=bpy.types.MovieClip
    )
    kind: bpy.props.EnumProperty(
        name="Show As",
        description="What moves; can be changed afterwards",
        items=[
            (
                "CAMERA",
                "Animated Camera",
                "The head stands still and one camera moves. "
                "Both follow Face Head, an Empty: move it to move everything",
            ),
            (
                "HEAD",
                "Animated Head",
                "The camera stands still and Face Head, an Empty, moves in front of it with the "
                "points. The reconstructed head follows by a constraint if enabled below",
            ),
            (
                "CAMERAS",
                "Camera per Key Frame",
                "The head stands still; each key frame has a camera of its own, and a timeline marker that "
                "switches to it",
            ),
        ],
        default="CAMERA",
        update=lambda self, _context: actions.refresh(self.id_data),
    )
    key_turn: bpy.props.FloatProperty(
        name="Turn",
        description="How far the head turns from one key frame to the next; 0 makes every posed frame a key frame",
        default=radians(5.0),
        min=0.0,
        max=pi,
        subtype="ANGLE",
        update=lambda self, _context: actions.refresh(self.id_data),
    )
    follow: bpy.props.BoolProperty(
        name="Reconstructed Head Follows",
        description="Make Face follow Face Head by a constraint, Facewright Motion; its own transform and "
        "parent are kept, and come back when this is off",
        default=True,
        update=lambda self, _context: actions.refresh(self.id_data),
    )
    use_length: bpy.props.BoolProperty(
        name="Measured Length",
        description="Set the size of the head by a measured distance between two tracks",
        default=False,
    )
    length_from: bpy.props.StringProperty(name="From", description="Track at one end of the measured length")
    length_to: bpy.props.StringProperty(name="To", description="Track at the other end of the measured length")
    length_mm: bpy.props.FloatProperty(
        name="Length", description="The measured length, millimetres", default=60.0, min=1.0, max=500.0, precision=1
    )
