"""What is known of the person, for every feature that needs a size."""

import bpy


class FacewrightPerson(bpy.types.PropertyGroup):
    """What was measured of the person's head."""

    use_interocular: bpy.props.BoolProperty(
        name="Known Eye Distance", description="Set the interpupillary distance instead of using the average one"
    )
    interocular_mm: bpy.props.FloatProperty(
        name="Eye Distance", description="Interpupillary distance, millimetres", default=63.0, min=40.0, max=90.0
    )

    @property
    def pupils_mm(self) -> float | None:
        """The measured distance between the pupils; None where none is given."""
        return self.interocular_mm if self.use_interocular else None
