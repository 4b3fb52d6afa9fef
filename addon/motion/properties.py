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
        description="What moves; may be changed afterwards",
        items=[
            (
                "CAMERA",
                "Animated Camera",
                "The head stands still and one camera moves. Face Head, an Empty, carries both: move it to move all",
            ),
            (
                "HEAD",
                "Animated Head",
                "The camera stands still and Face Head, an Empty, moves before it with the points. "
                "The reconstructed head follows by a constraint if that is wanted below",
            ),
            (
                "CAMERAS",
                "Camera per Key Frame",
                "The head stands still; each key frame has a camera of its own, and a marker of the timeline that "
                "switches to it",
            ),
        ],
        default="CAMERA",
        update=lambda self, _context: actions.refresh(self.id_data),
    )
    key_turn: bpy.props.FloatProperty(
        name="Turn",
        description="How far the head turns from one key frame to the next; 0 makes each posed frame one",
        default=radians(5.0),
        min=0.0,
        max=pi,
        subtype="ANGLE",
        update=lambda self, _context: actions.refresh(self.id_data),
    )
    follow: bpy.props.BoolProperty(
        name="Reconstructed Head Follows",
        description="Let Face take the place of Face Head by a constraint, Facewright Motion; its own place and "
        "parent stay, and come back when this is off",
        default=True,
        update=lambda self, _context: actions.refresh(self.id_data),
    )
    use_length: bpy.props.BoolProperty(
        name="Measured Length",
        description="Give the size of the head by the distance between two tracks that was measured",
        default=False,
    )
    length_from: bpy.props.StringProperty(name="From", description="Track at one end of the measured length")
    length_to: bpy.props.StringProperty(name="To", description="Track at the other end of the measured length")
    length_mm: bpy.props.FloatProperty(
        name="Length", description="The measured length, millimetres", default=60.0, min=1.0, max=500.0, precision=1
    )
