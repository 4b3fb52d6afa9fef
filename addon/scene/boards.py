"""A calibration as objects: the camera, and the board in each picture where it was; made once, updated ever after."""

import bpy
import numpy as np
from mathutils import Matrix

from ..engine import Camera
from ..engine.calibration import Board, pictures
from . import camera as scene_camera
from .axes import below_camera
from .materials import plain

COLLECTION = "facewright_calibration"
CAMERA = "facewright_calibrated_camera"
BOARD = "facewright_board"
# White paper around the squares, parts of a square's side.
MARGIN = 0.6
COLOURS = {"Board white": (0.8, 0.8, 0.8, 1.0), "Board black": (0.02, 0.02, 0.02, 1.0)}


def collection(scene: bpy.types.Scene) -> bpy.types.Collection | None:
    """The collection of a scene's calibration."""
    return next((c for c in scene.collection.children_recursive if c.get(COLLECTION)), None)


def camera(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """The calibrated camera's object."""
    home = collection(scene)
    return next((o for o in home.objects if o.get(CAMERA)), None) if home else None


def boards(scene: bpy.types.Scene) -> dict[str, bpy.types.Object]:
    """The board objects by the name of their picture."""
    home = collection(scene)
    return {str(o[BOARD]): o for o in home.objects if o.get(BOARD)} if home else {}


def picture_of(obj: bpy.types.Object) -> str:
    """The picture that a board object stands for; empty for other objects."""
    return str(obj.get(BOARD, ""))


def place(scene: bpy.types.Scene, calibration: Camera, wire: bool) -> bpy.types.Object:
    """Put the camera and its boards into a scene, or bring those that are there up to date; gives back the camera.

    The boards are the camera's children: an artist may move the camera, and keeps that.
    """
    home = collection(scene) or _new_collection(scene)
    eye = camera(scene) or _new_camera(home)
    scene_camera.set_lens(eye.data, calibration)
    old = boards(scene)
    meshes = [_mesh(scene, board, k) for k, board in enumerate(calibration.boards)]
    for picture in pictures(calibration):
        pose, board = picture.image.cam_from_board, picture.image.board or 0
        if pose is None:
            continue
        obj = old.pop(picture.name, None) or _new_board(home, eye, picture.name, meshes[board])
        if obj.data is not meshes[board]:
            obj.data = meshes[board]
        obj.matrix_parent_inverse = Matrix.Identity(4)
        obj.matrix_basis = Matrix(below_camera(pose).tolist())
    for obj in old.values():
        bpy.data.objects.remove(obj)
    set_wire(scene, wire)
    _forget_unused()
    return eye


def remove(scene: bpy.types.Scene) -> None:
    """Take the camera, the boards and what only they use out of the file; other objects of the collection stay."""
    home = collection(scene)
    if home is None:
        return
    ours = [*boards(scene).values(), *([eye] if (eye := camera(scene)) else [])]
    lenses = {o.data for o in ours if o.type == "CAMERA"}
    for obj in ours:
        bpy.data.objects.remove(obj)
    for lens in lenses:
        if not lens.users:
            bpy.data.cameras.remove(lens)
    if not home.objects and not home.children:
        bpy.data.collections.remove(home)
    _forget_unused()


def set_wire(scene: bpy.types.Scene, wire: bool) -> None:
    """Show the boards as wires, or solid."""
    for obj in boards(scene).values():
        obj.display_type = "WIRE" if wire else "TEXTURED"


def select(scene: bpy.types.Scene, layer: bpy.types.ViewLayer, name: str) -> None:
    """Select the board of a picture alone among the boards, if it is shown; not where it is active already."""
    shown = boards(scene)
    chosen = shown.get(name)
    if chosen is not None and layer.objects.active is chosen and chosen.select_get(view_layer=layer):
        return
    for obj in shown.values():
        if layer.objects.get(obj.name) is obj:
            obj.select_set(obj is chosen, view_layer=layer)
    if chosen is not None and layer.objects.get(chosen.name) is chosen:
        layer.objects.active = chosen


def _new_collection(scene: bpy.types.Scene) -> bpy.types.Collection:
    home = bpy.data.collections.new("Calibration")
    home[COLLECTION] = True
    scene.collection.children.link(home)
    return home


def _new_camera(home: bpy.types.Collection) -> bpy.types.Object:
    eye = scene_camera.new("Calibrated Camera")
    eye[CAMERA] = True
    eye.data.display_size = 0.1
    eye.data.clip_start = 0.01
    home.objects.link(eye)
    return eye


def _new_board(home: bpy.types.Collection, eye: bpy.types.Object, name: str, mesh: bpy.types.Mesh) -> bpy.types.Object:
    obj = bpy.data.objects.new(name, mesh)
    obj[BOARD] = name
    obj.parent = eye
    home.objects.link(obj)
    return obj


def _mesh(scene: bpy.types.Scene, board: Board, number: int) -> bpy.types.Mesh:
    """The squares of a board in its own frame; all objects of one board share it."""
    name = f"Board {number + 1}"
    mesh = next((o.data for o in boards(scene).values() if o.data.get(BOARD) == name), None)
    if mesh is None:
        mesh = bpy.data.meshes.new(name)
        mesh[BOARD] = name
        for look, colour in COLOURS.items():
            mesh.materials.append(plain(look, colour))
    x, y = (_lines(count, board.gap) * board.square for count in (board.columns, board.rows))
    corners = np.stack([*np.meshgrid(x, y), np.zeros((len(y), len(x)))], axis=-1).reshape(-1, 3)
    row, column = (k.ravel() for k in np.mgrid[: len(y) - 1, : len(x) - 1])
    first = row * len(x) + column
    # The printed side is seen from −z.
    quads = np.stack([first, first + len(x), first + len(x) + 1, first + 1], axis=-1)
    mesh.clear_geometry()
    mesh.from_pydata(corners.tolist(), [], quads.tolist())
    inside = (row > 0) & (row < len(y) - 2) & (column > 0) & (column < len(x) - 2)
    black = (row + column) % 2 == 0 if board.gap is None else (row % 2 == 1) & (column % 2 == 1)
    mesh.polygons.foreach_set("material_index", (inside & black).astype(np.int32))
    mesh.update()
    return mesh


def _lines(count: int, gap: float | None) -> np.ndarray:
    """Edges of squares and paper along a side, in squares from the first corner."""
    if gap is None:
        lines = np.arange(-1.0, count + 1.0)
    else:
        lines = (np.arange(count)[:, None] * (1.0 + gap) + [0.0, 1.0]).ravel()
    return np.concatenate([[lines[0] - MARGIN], lines, [lines[-1] + MARGIN]])


def _forget_unused() -> None:
    """Meshes of boards that no object shows, and the boards' materials with the last of them."""
    for mesh in [m for m in bpy.data.meshes if m.get(BOARD) and not m.users]:
        bpy.data.meshes.remove(mesh)
    for name in COLOURS:
        look = bpy.data.materials.get(name)
        if look is not None and not look.users:
            bpy.data.materials.remove(look)
