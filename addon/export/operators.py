"""The button that takes a head elsewhere."""

import os

import bpy

from ..modal import FileOperator, Result, in_object_mode
from ..options import BLEND_RELATIVE
from ..running import idle
from ..words import say
from . import actions

FORMATS = [
    (".glb", "glTF (.glb)", "For Godot, three.js, Unreal and most others: shape keys, pictures inside"),
    (".fbx", "FBX (.fbx)", "For Unity, Unreal and Maya: shape keys, pictures inside; in centimetres"),
    (".usdc", "USD (.usdc)", "For Omniverse, Houdini and others: shape keys; pictures in a folder beside the file"),
    (".usdz", "USD, packed (.usdz)", "For Apple's devices: shape keys, pictures inside"),
    (".abc", "Alembic (.abc)", "The mesh of every frame: no shape keys, no pictures; modifiers are applied"),
]


class FACEWRIGHT_OT_export(FileOperator, bpy.types.Operator):
    """Write the head to a GLB, FBX, USD or Alembic file"""

    bl_idname = "facewright.export"
    bl_label = "Export Head"
    bl_description = (
        "Write the head to a GLB, FBX, USD or Alembic file, upright and in true size, with animation on every part. "
        "Alembic has no shape keys: it gets the mesh of every frame. The scene stays as it is"
    )
    # Not UNDO: nothing changes.
    bl_options = {"REGISTER", "PRESET"}

    filepath: bpy.props.StringProperty(
        subtype="FILE_PATH",
        description="The file; its ending says the format: .glb, .fbx, .usd, .usdc, .usda, .usdz or .abc",
        options={"SKIP_SAVE"} | BLEND_RELATIVE,
    )
    filter_glob: bpy.props.StringProperty(
        default="*.glb;*.fbx;*.usd;*.usdc;*.usda;*.usdz;*.abc", options={"HIDDEN", "SKIP_SAVE"}
    )
    check_existing: bpy.props.BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    format: bpy.props.EnumProperty(
        name="Format", description="Sets the ending of the file's name", items=FORMATS, default=".glb"
    )
    animation: bpy.props.BoolProperty(
        name="Animation",
        description="Write what the head does over time; otherwise only how it is now",
        default=True,
    )
    range: bpy.props.EnumProperty(
        name="Frames",
        description="Which frames are written",
        items=[
            (actions.ANIMATION, "Animation", "From the first keyframe that moves the head to the last"),
            (actions.SCENE, "Scene", "The frames of the scene"),
            (actions.CUSTOM, "From … to", "The frames that are given below"),
        ],
        default=actions.ANIMATION,
    )
    first: bpy.props.IntProperty(name="First", description="First frame that is written", default=1)
    last: bpy.props.IntProperty(name="Last", description="Last frame that is written", default=250)
    joined: bpy.props.BoolProperty(
        name="One Mesh",
        description="Join skin, eyes, teeth, tongue and lashes into one mesh with several materials",
        default=False,
    )

    _format = ""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not in_object_mode(cls, context):
            return False
        if actions.head(context.scene, context.object) is None:
            cls.poll_message_set(say("Reconstruct a face first"))
            return False
        return idle(cls)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Result:
        if not self.filepath:
            folder = os.path.dirname(bpy.data.filepath)
            name = actions.proposed(actions.head(context.scene, context.object), self.format)
            self.filepath = os.path.join(folder, name)
        self._format = self.format
        return super().invoke(context, event)

    def check(self, _context: bpy.types.Context) -> bool:
        """Let the ending of the file's name follow the format, where one is chosen or none is written."""
        path, chosen = self.filepath, self.format != self._format
        if chosen or not actions.is_known(path):
            self.filepath = actions.with_suffix(path, self.format)
        self._format = self.format
        return self.filepath != path

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.prop(self, "format")
        layout.prop(self, "joined")
        layout.prop(self, "animation")
        column = layout.column()
        column.active = self.animation
        column.prop(self, "range")
        if self.range == actions.CUSTOM:
            column.prop(self, "first")
            column.prop(self, "last")

    def work(self, context: bpy.types.Context, path: str) -> str:
        return actions.export(context, path, self)
