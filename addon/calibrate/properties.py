"""Settings of the camera."""

import bpy


class FacewrightCamera(bpy.types.PropertyGroup):
    """The camera that filmed the clip."""

    text: bpy.props.StringProperty(name="Camera", description="The calibrated camera, as camera.json", default="")
    columns: bpy.props.IntProperty(name="Columns", description="Inner corners of the board in a row", default=9, min=3)
    rows: bpy.props.IntProperty(name="Rows", description="Inner corners of the board in a column", default=6, min=3)
    square_mm: bpy.props.FloatProperty(
        name="Square", description="Side of a square, millimetres", default=25.5, min=3.0, precision=2
    )
    page: bpy.props.EnumProperty(
        name="Page",
        description="Paper the board is printed on",
        items=[
            ("A4", "A4", "297 × 210 mm"),
            ("A3", "A3", "420 × 297 mm"),
            ("Letter", "Letter", "11 × 8.5 in"),
        ],
        default="A4",
    )
