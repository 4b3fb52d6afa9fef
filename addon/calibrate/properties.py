"""Settings of the board, the camera and what became of its pictures."""

import bpy

from . import actions


class FacewrightBoardPicture(bpy.types.PropertyGroup):
    """A picture of the board: a row of the table. Errors in pixels, 0 where there are none."""

    name: bpy.props.StringProperty(name="Picture", description="File name, or frame of the clip")
    found: bpy.props.BoolProperty(name="Found", description="Whether the board was found")
    used: bpy.props.BoolProperty(name="Used", description="Whether the camera was calibrated from it")
    bad: bpy.props.BoolProperty(
        name="Bad", description="No board was found, or it fits more than twice as badly as the median picture"
    )
    rms: bpy.props.FloatProperty(name="RMS", description="RMS reprojection error of its corners, pixels")
    worst: bpy.props.FloatProperty(name="Worst", description="Largest error of a corner, pixels")
    hold_out: bpy.props.FloatProperty(
        name="Held Out", description="The same RMS error with a camera calibrated without this picture, pixels"
    )
    reason: bpy.props.StringProperty(name="Reason", description="Why it was not used, or what is wrong with it")


class FacewrightCamera(bpy.types.PropertyGroup):
    """The camera that filmed the clip."""

    text: bpy.props.StringProperty(
        name="Camera",
        description="The calibrated camera, as camera.json",
        default="",
        update=lambda self, _context: actions.fill_table(self),
    )
    pictures: bpy.props.CollectionProperty(type=FacewrightBoardPicture)
    active: bpy.props.IntProperty(
        name="Active Picture",
        description="The row of the table; its board is selected in the scene",
        default=0,
        min=0,
        update=lambda self, context: actions.select_board(self, context),
    )
    wire: bpy.props.BoolProperty(
        name="Wireframe",
        description="Show the boards as wireframes",
        default=False,
        update=lambda self, _context: actions.set_wire(self),
    )
    clip: bpy.props.PointerProperty(
        name="Movie Clip", description="The clip that this camera filmed", type=bpy.types.MovieClip
    )
    pattern: bpy.props.EnumProperty(
        name="Pattern",
        description="What is printed on the board",
        items=[
            ("CHECKERBOARD", "Checkerboard", "Black and white squares that touch"),
            ("SQUARES", "Separate Squares", "Black squares with gaps between them"),
        ],
        default="CHECKERBOARD",
    )
    columns: bpy.props.IntProperty(
        name="Columns",
        description="In a row: inner corners of the checkerboard, where four squares meet, or separate squares",
        default=9,
        min=2,
        max=100,
    )
    rows: bpy.props.IntProperty(
        name="Rows",
        description="In a column: inner corners of the checkerboard, where four squares meet, or separate squares",
        default=6,
        min=2,
        max=100,
    )
    square_mm: bpy.props.FloatProperty(
        name="Square", description="Side of a square, millimetres", default=25.5, min=3.0, precision=2
    )
    gap_mm: bpy.props.FloatProperty(
        name="Gap", description="White gap between two squares, millimetres", default=25.5, min=0.1, precision=2
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
    distortion_terms: bpy.props.IntProperty(
        name="Radial Terms",
        description="Radial distortion terms: k1, k2, k3. The paper has two",
        default=2,
        min=0,
        max=3,
    )
    tangential: bpy.props.BoolProperty(
        name="Tangential", description="Also solve for tangential distortion, p1 and p2", default=False
    )
    square_pixels: bpy.props.BoolProperty(
        name="Square Pixels", description="One focal length for both directions", default=False
    )
    bend: bpy.props.EnumProperty(
        name="Bent Board",
        description="When to solve for a board that is not flat; for several cameras, only Always does",
        items=[
            ("never", "Never", "Assume a flat board; warn of a clear bend"),
            ("judged", "Where It Helps", "Where it predicts every held-out picture better"),
            ("always", "Always", "In every case"),
        ],
        default="judged",
    )
