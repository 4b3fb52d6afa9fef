"""The buttons that open the manual and the report."""

import bpy

from ..delivery import window_of
from ..modal import Result
from ..words import say
from . import actions


class FACEWRIGHT_OT_manual(bpy.types.Operator):
    """Open the manual in the browser; it is on this machine, and nothing is fetched"""

    bl_idname = "facewright.manual"
    bl_label = "Manual"
    # Not REGISTER: there is nothing to redo.
    bl_options = {"INTERNAL"}

    page: bpy.props.StringProperty(
        name="Page", description="The page, such as cameras; empty: the first one", options={"SKIP_SAVE"}
    )

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        if actions.manual() is None:
            cls.poll_message_set(say("This build of the extension comes without the manual"))
            return False
        return True

    def execute(self, _context: bpy.types.Context) -> Result:
        file = actions.manual(self.page)
        assert file is not None, "poll has seen it"
        bpy.ops.wm.url_open(url=file.as_uri())
        return {"FINISHED"}


class FACEWRIGHT_OT_open_report(bpy.types.Operator):
    """Show all that the report says of the head, frame by frame, as a text"""

    bl_idname = "facewright.open_report"
    bl_label = "Open Report"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not actions.has_report(context.scene, context.object):
            cls.poll_message_set(say("Reconstruct a face first"))
            return False
        return True

    def execute(self, context: bpy.types.Context) -> Result:
        text = actions.write_report(context.scene, context.object)
        if (window := window_of(context)) is not None:
            actions.show_text(window, text)
        self.report({"INFO"}, f"{text.name} is in the Text editor")
        return {"FINISHED"}
