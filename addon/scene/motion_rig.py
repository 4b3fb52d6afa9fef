"""A motion as objects: a camera, or one for each key frame, and the head as an Empty; made once, updated ever after.

One of the two stands and may be moved, the other is its child and moves: what is seen through the camera stays.
"""

from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Euler, Matrix
from numpy.typing import NDArray

from ..engine import Motion
from . import camera as scene_camera
from . import heads, motion_lens, motion_record, pose_keys
from .axes import FORWARD, below_camera, head_below_camera
from .motion_record import KIND, Shown

HEAD = "facewright_motion_head"
CAMERA = "facewright_motion_camera"
NUMBER = "facewright_motion_frame"
HEAD_TITLE, CAMERA_TITLE = "Face Head", "Face Camera"
# Of the constraint that carries the reconstructed head along.
FOLLOW = "Facewright Motion"
# What CAMERA is of the camera that stands for all frames; for one frame it is the frame's name.
ALL = "*"
# Blender's own frame range of a new scene.
NEW_RANGE = (1, 250)


@dataclass(frozen=True, eq=False)
class Stage:
    """What is there to be placed: frames of the timeline, ascending, with their names and (n, 4, 4) cam_from_head."""

    scene: bpy.types.Scene
    home: bpy.types.Collection
    head: bpy.types.Object
    lens: bpy.types.Camera
    frames: NDArray[np.int64]
    names: list[str]
    poses: NDArray[np.float64]


def head(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """The Empty that stands for the head."""
    return next((o for o in scene.objects if o.get(HEAD)), None)


def cameras(scene: bpy.types.Scene) -> dict[str, bpy.types.Object]:
    """The cameras by their frame's name, or that of all frames under `ALL`."""
    found: dict[str, bpy.types.Object] = {}
    for obj in scene.objects:
        if obj.type == "CAMERA" and obj.get(CAMERA):
            found.setdefault(str(obj[CAMERA]), obj)
    return found


def camera_at(scene: bpy.types.Scene, frame: int) -> bpy.types.Object | None:
    """The camera to look through at a frame of the timeline: of key frames the last one until then, or the first."""
    ours = sorted(cameras(scene).values(), key=lambda eye: eye.get(NUMBER, 0))
    home = motion_record.collection(scene)
    if not ours or home is None:
        return None
    number = motion_record.clip_frame(home, frame)
    before = [eye for eye in ours if eye.get(NUMBER, number) <= number]
    return before[-1] if before else ours[0]


def place(scene: bpy.types.Scene, home: bpy.types.Collection, motion: Motion, shown: Shown) -> bpy.types.Object:
    """Put cameras and head of a motion into a collection, or bring those that are there up to date; gives the head."""
    known = head(scene)
    empty = known or _new_head(home)
    changed = known is None or home.get(KIND) != shown.kind
    if scene.camera is None:
        # It will look through ours. Now: a marker of the timeline sets the camera at once.
        scene_camera.set_render(scene.render, motion.camera)
    if changed:
        _take_apart(scene, empty)
    lens = motion_lens.ensured(scene, motion.camera, motion_record.clip(home))
    stage = _stage(scene, home, motion, empty, lens)
    if shown.kind == "HEAD":
        _move_head(stage, changed)
    else:
        if changed:
            empty.matrix_world = _face_matrix(scene)
        (_move_camera if shown.kind == "CAMERA" else _set_key_cameras)(stage, shown)
    _follow(scene, empty if shown.kind == "HEAD" and shown.follow else None)
    home[KIND] = shown.kind
    return empty


def key_frames(poses: NDArray[np.float64], turn: float) -> list[int]:
    """Numbers of poses: the first, and each that has turned by `turn` radians since the one before."""
    keys: list[int] = []
    for number, pose in enumerate(poses):
        if not keys or _angle(poses[keys[-1]], pose) >= turn:
            keys.append(number)
    return keys


def remove(scene: bpy.types.Scene) -> None:
    """Take cameras, head, their markers of the timeline and the constraint of the reconstructed head away."""
    _follow(scene, None)
    _remove_cameras(scene, set())
    empty = head(scene)
    if empty is not None:
        _remove(empty)


def meet_face(scene: bpy.types.Scene, face: bpy.types.Object, is_new: bool, follow: bool) -> None:
    """Treat a reconstructed head as if the motion of its scene had been found afterwards; without one, leave it.

    Where `Face Head` stands, the artist may have put it there: a new head comes to it, one that was there stays.
    """
    home, empty = motion_record.collection(scene), head(scene)
    if home is None or empty is None or _face(scene) != face:
        return
    moves = home.get(KIND) == "HEAD"
    if is_new and not moves:
        face.matrix_world = empty.matrix_world
    _follow(scene, empty if moves and follow else None)


def set_scene(scene: bpy.types.Scene, home: bpy.types.Collection) -> None:
    """Give a scene without a camera ours, and one with Blender's own frame range the clip's; what is set stays."""
    frames = motion_record.frames(home)
    if scene.camera is None:
        scene.camera = camera_at(scene, scene.frame_current)
    if (scene.frame_start, scene.frame_end) == NEW_RANGE:
        scene.frame_start, scene.frame_end = int(frames.min()), int(frames.max())


def _stage(
    scene: bpy.types.Scene,
    home: bpy.types.Collection,
    motion: Motion,
    empty: bpy.types.Object,
    lens: bpy.types.Camera,
) -> Stage:
    posed = np.array(motion.posed)
    frames = motion_record.frames(home)[posed]
    order = np.argsort(frames)
    rows, names = posed[order], [frame.name for frame in motion.frames]
    return Stage(scene, home, empty, lens, frames[order], [names[k] for k in rows], motion.poses[rows])


def _move_camera(stage: Stage, _shown: Shown) -> None:
    """The head stands, the camera moves."""
    eye, _ = _camera(stage, ALL, CAMERA_TITLE)
    _hang(eye, stage.head)
    pose_keys.write(eye, stage.frames, np.linalg.inv(head_below_camera(stage.poses)))
    _remove_cameras(stage.scene, {ALL})


def _move_head(stage: Stage, changed: bool) -> None:
    """The camera stands, level, the head moves before it about the place where it was reconstructed."""
    eye, is_new = _camera(stage, ALL, CAMERA_TITLE)
    if is_new or changed:
        eye.rotation_mode = "XYZ"
        turn = Euler(FORWARD).to_matrix().to_4x4()
        mean = below_camera(stage.poses)[:, :3, 3].mean(axis=0)
        eye.matrix_world = Matrix.Translation(_face_matrix(stage.scene).translation) @ turn @ Matrix.Translation(-mean)
    _hang(stage.head, eye)
    pose_keys.write(stage.head, stage.frames, head_below_camera(stage.poses))
    _remove_cameras(stage.scene, {ALL})


def _set_key_cameras(stage: Stage, shown: Shown) -> None:
    """The head stands, and so does a camera for each key frame; markers of the timeline switch to it."""
    keys = key_frames(stage.poses, shown.key_turn)
    bound = {m.camera: m for m in stage.scene.timeline_markers if m.camera is not None}
    for k in keys:
        frame = int(stage.frames[k])
        eye, _ = _camera(stage, stage.names[k], f"{CAMERA_TITLE} {frame:04d}")
        eye[NUMBER] = motion_record.clip_frame(stage.home, frame)
        _hang(eye, stage.head)
        eye.matrix_basis = Matrix(np.linalg.inv(head_below_camera(stage.poses[k])).tolist())
        marker = bound.get(eye) or stage.scene.timeline_markers.new(eye.name, frame=frame)
        marker.camera, marker.frame = eye, frame
    _remove_cameras(stage.scene, {stage.names[k] for k in keys})


def _camera(stage: Stage, frame: str, title: str) -> tuple[bpy.types.Object, bool]:
    """The camera of a frame, and whether it was made for want of one."""
    eye = cameras(stage.scene).get(frame)
    if eye is not None:
        return eye, False
    eye = bpy.data.objects.new(title, stage.lens)
    eye[CAMERA] = frame
    stage.home.objects.link(eye)
    return eye, True


def _new_head(home: bpy.types.Collection) -> bpy.types.Object:
    empty = bpy.data.objects.new(HEAD_TITLE, None)
    empty[HEAD] = True
    empty.empty_display_size = 0.05
    home.objects.link(empty)
    return empty


def _face_matrix(scene: bpy.types.Scene) -> Matrix:
    """Where the reconstructed head stands of itself; the origin without one."""
    face = _face(scene)
    if face is None:
        return Matrix.Identity(4)
    place = face.matrix_parent_inverse @ face.matrix_basis
    return face.parent.matrix_world @ place if face.parent is not None else place


def _face(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """The head that the motion is of: the one made from its clip, or the only one of the scene."""
    home = motion_record.collection(scene)
    clip = motion_record.clip(home) if home is not None else None
    found = [known for known in heads.heads(scene) if known.skin is not None and known.is_local]
    made = heads.made_of(found, clip.filepath) if clip is not None else None
    if made is None and len(found) == 1:
        made = found[0]
    return made.skin if made is not None else None


def _let_go(scene: bpy.types.Scene) -> None:
    """Let no head take the place of the Empty."""
    empty = head(scene)
    for face in [known.skin for known in heads.heads(scene) if known.skin is not None and known.is_local]:
        constraint = face.constraints.get(FOLLOW)
        if constraint is not None and constraint.target in (empty, None):
            face.constraints.remove(constraint)


def _angle(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Between the rotations of two poses, radians."""
    cosine = (np.trace(a[:3, :3] @ b[:3, :3].T) - 1.0) / 2.0
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _take_apart(scene: bpy.types.Scene, empty: bpy.types.Object) -> None:
    """Before another thing moves than until now: without keys and parents."""
    for obj in (empty, *cameras(scene).values()):
        pose_keys.clear(obj)
        obj.parent = None


def _hang(child: bpy.types.Object, parent: bpy.types.Object) -> None:
    """Make an object a child, unless the artist has given it another parent."""
    if child.parent is None:
        child.parent = parent
        child.matrix_parent_inverse = Matrix.Identity(4)


def _follow(scene: bpy.types.Scene, empty: bpy.types.Object | None) -> None:
    """Let the reconstructed head take the place of the Empty by a constraint, or none."""
    face = _face(scene)
    if empty is None:
        _let_go(scene)
    if empty is None or face is None:
        return
    constraint = face.constraints.get(FOLLOW)
    if constraint is None:
        constraint = face.constraints.new("COPY_TRANSFORMS")
        constraint.name = FOLLOW
    constraint.target = empty


def _remove_cameras(scene: bpy.types.Scene, but: set[str]) -> None:
    """Take away our cameras of other frames than these, with their markers of the timeline."""
    ours = {eye for frame, eye in cameras(scene).items() if frame not in but}
    for marker in [marker for marker in scene.timeline_markers if marker.camera in ours]:
        scene.timeline_markers.remove(marker)
    for eye in ours:
        _remove(eye)


def _remove(obj: bpy.types.Object) -> None:
    pose_keys.clear(obj)
    data = obj.data
    bpy.data.objects.remove(obj)
    if isinstance(data, bpy.types.Camera) and not data.users:
        bpy.data.cameras.remove(data)
