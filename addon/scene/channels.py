"""A number that keyframes set: of a shape key, or of a bone that leads one."""

from dataclasses import dataclass
from typing import Any

import bpy

from .pose_keys import curves

# Keyframes that are nearer are one to Blender, frames.
SAME_FRAME = 0.01


@dataclass(frozen=True)
class Channel:
    """A property of a shape key or a bone, the position within it (-1: a whole one), and its group in the action."""

    holder: Any
    path: str
    index: int
    group: str

    @property
    def owner(self) -> bpy.types.ID:
        return self.holder.id_data

    @property
    def full_path(self) -> str:
        """From its owner on."""
        is_custom = self.path.startswith("[")
        return self.holder.path_from_id() + self.path if is_custom else self.holder.path_from_id(self.path)

    @property
    def curve(self) -> bpy.types.FCurve | None:
        path, index = self.full_path, max(self.index, 0)
        found = curves(self.owner) or ()
        return next((curve for curve in found if curve.data_path == path and curve.array_index == index), None)

    def insert(self, frame: float, kind: str) -> bool:
        """Insert a keyframe of the present value; false where the channel is locked."""
        return self.holder.keyframe_insert(self.path, index=self.index, frame=frame, group=self.group, keytype=kind)

    def delete(self, frame: float) -> bool:
        """Delete the keyframe at a frame; false where the channel is locked."""
        return self.holder.keyframe_delete(self.path, index=self.index, frame=frame)

    def has_keyframe(self, frame: float) -> bool:
        curve = self.curve
        return curve is not None and any(abs(point.co.x - frame) < SAME_FRAME for point in curve.keyframe_points)
