"""The keying set of a face: while it is the active one, I inserts the whole pose."""

import bpy

from . import actions


class FacewrightFace(bpy.types.KeyingSetInfo):
    """Insert a keyframe of every shape key of the active object's face, or of the handle that leads it"""

    bl_idname = "FacewrightFace"
    bl_label = "Facewright Face"

    def poll(self, context: bpy.types.Context) -> bool:
        return not actions.keying_complaint(actions.face(context.scene, context.object))

    def iterator(self, context: bpy.types.Context, ks: bpy.types.KeyingSet) -> None:
        self.generate(context, ks, actions.face(context.scene, context.object))

    def generate(self, _context: bpy.types.Context, ks: bpy.types.KeyingSet, data: bpy.types.Object) -> None:
        for channel in actions.keyable(data):
            path, index = channel.full_path, channel.index
            ks.paths.add(channel.owner, path, index=index, group_method="NAMED", group_name=channel.group)
