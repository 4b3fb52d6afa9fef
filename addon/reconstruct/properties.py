"""Settings of the clip and the reconstruction."""

from typing import Any

import bpy

from ..clip.actions import look_soon, set_shown, shown_number
from ..clip.options import CLICKS
from ..options import BLEND_RELATIVE, OURS
from . import actions

# Blender keeps no text of a choice that Python has forgotten.
_texts: dict[str, str] = {}


def _heads(clip: Any, _context: bpy.types.Context | None) -> list[tuple[str, str, str, int]]:
    """The choices of a clip's scene."""
    kept = [[_texts.setdefault(text, text) for text in choice] for choice in actions.choices(clip.id_data)]
    return [(name, label, about, number) for number, (name, label, about) in enumerate(kept)]


def _meet(clip: Any) -> None:
    """Another clip was chosen."""
    clip.show_frames = True
    actions.meet_clip(clip.id_data, bpy.path.abspath(clip.path))
    look_soon(clip)


class FacewrightPicture(bpy.types.PropertyGroup):
    """A picture of the clip's folder, by its file's name."""

    name: bpy.props.StringProperty(name="Picture", description="Name of the picture's file")


class FacewrightClip(bpy.types.PropertyGroup):
    """The frames a head is made from."""

    path: bpy.props.StringProperty(
        name="Clip",
        translation_context=OURS,
        description="A video, a folder of frames, or the first image of a sequence",
        subtype="FILE_PATH",
        options=BLEND_RELATIVE,
        update=lambda self, _context: _meet(self),
    )
    # Of a folder these pictures and no others, in this order; all where none is named.
    pictures: bpy.props.CollectionProperty(type=FacewrightPicture, options={"HIDDEN"})
    left_out: bpy.props.StringProperty(
        name="Left Out", description="Frames that are not used, counted from 0: 12-40,77", options={"HIDDEN"}
    )
    # How many frames the clip has, counted when it is chosen: 0 where none can be read, -1 in files of older versions.
    frames: bpy.props.IntProperty(default=-1, options={"HIDDEN"})
    head: bpy.props.EnumProperty(
        name="Head",
        description="The head that is made or updated; another clip makes a new head, unless it has made one before",
        items=_heads,
        get=lambda self: actions.chosen(self.id_data),
        set=lambda self, number: actions.choose(self.id_data, number),
        options=set(),
    )
    # The key of that head, "new", or empty for the one that the clip has made.
    wanted: bpy.props.StringProperty(options={"HIDDEN"})
    use_range: bpy.props.BoolProperty(
        name="Part of the Clip", description="Use only some of the clip's frames", default=False
    )
    show_frames: bpy.props.BoolProperty(
        name="Frames", description="Show the clip's frames, and what of it is used", default=True
    )
    click: bpy.props.EnumProperty(
        name="Click", description="What a click on a frame does", items=CLICKS, options={"SKIP_SAVE"}
    )
    first: bpy.props.IntProperty(name="First", description="First frame used, counted from 0", default=0, min=0)
    last: bpy.props.IntProperty(name="Last", description="Last frame used, counted from 0", default=250, min=0)
    # The same as the artist counts.
    shown_first: bpy.props.IntProperty(
        name="First",
        description="First frame used: as the timeline counts where a movie clip shows the file, else from 0",
        get=lambda self: shown_number(self, self.first),
        set=lambda self, number: set_shown(self, first=number),
        options=set(),
    )
    shown_last: bpy.props.IntProperty(
        name="Last",
        description="Last frame used: as the timeline counts where a movie clip shows the file, else from 0",
        get=lambda self: shown_number(self, self.last),
        set=lambda self, number: set_shown(self, last=number),
        options=set(),
    )
    method: bpy.props.EnumProperty(
        name="Method",
        translation_context=OURS,
        description="Chain of steps by which the head is made",
        items=[
            ("default", "Default", "All frames, a statistical head model, evened lighting"),
            ("paper", "Paper", "The steps of Liang, Pan, Chen 2004"),
        ],
    )
    texture_size: bpy.props.EnumProperty(
        name="Texture",
        description="Width and height of the skin's texture, pixels; unless chosen here, that of the preferences",
        items=[(str(n), f"{n} px", f"Texture of {n} × {n} pixels") for n in actions.TEXTURE_SIZES],
        get=lambda self: actions.texture_choice(self),
        set=lambda self, number: actions.choose_texture(self, number),
        options=set(),
    )
    # That size where it was chosen, else 0.
    texture_px: bpy.props.IntProperty(default=0, options={"HIDDEN"})
    dense: bpy.props.BoolProperty(
        name="Dense Surface",
        description="Measure the skin between its points in the frames; only with the method Default",
        default=True,
    )
    use_face: bpy.props.BoolProperty(
        name="Choose the Face",
        description="Of several faces, follow the one nearest to a pixel instead of the largest one that turns",
        default=False,
    )
    face: bpy.props.FloatVectorProperty(
        name="Face at",
        description="A pixel of the face where the clip begins, from the picture's upper left corner",
        size=2,
        min=0.0,
    )
    use_markers: bpy.props.BoolProperty(
        name="Use Markers",
        description="Use the face's tracks as they are in the Clip editor instead of tracking again",
        default=False,
    )
    output: bpy.props.StringProperty(
        name="Result Folder",
        description="Also write head.glb, texture.png, eyes.png and report.json here",
        subtype="DIR_PATH",
        options=BLEND_RELATIVE,
    )
