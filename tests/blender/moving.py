"""A motion of the synthetic person that tests make from its truth, and what Blender sees of it."""

import json
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bpy_extras.object_utils import world_to_camera_view
from numpy.typing import NDArray
from tracking import CLIP, NAMES, REGIONS, TRUTH, module

LEFT_OUT = 4
KINDS = ("CAMERA", "HEAD", "CAMERAS")
FOLLOW = "Facewright Motion"
Content = dict[str, Any]


def points(count: int = 60) -> NDArray[np.float64]:
    """Vertices of the synthetic head's front, metres in the head frame."""
    head, body = (CLIP / "head.ply").read_bytes().split(b"end_header\n", 1)
    number = next(int(line.split()[2]) for line in head.splitlines() if line.startswith(b"element vertex"))
    vertices = np.frombuffer(body, "<f4", 3 * number).reshape(-1, 3).astype(np.float64)
    face = vertices[(vertices[:, 2] > -0.03) & (np.abs(vertices[:, 1] + 0.03) < 0.08)]
    return face[np.linspace(0, len(face) - 1, count).astype(int)]


def solution(names: list[str] | None = None, lens: bool = True, **more: Any) -> Content:
    """A motion.json of the truth, with one frame left out; `lens` False takes the distortion away."""
    names = NAMES if names is None else names
    poses = [frame["cam_from_head"] for frame in TRUTH["frames"]]
    camera = TRUTH["camera"] | {"source": "board"} | ({} if lens else {"k1": 0.0, "k2": 0.0})
    content = {
        "version": "0.1.0",
        "method": "default",
        "camera": camera,
        "focal_sigma_px": None,
        "frames": [one_frame(name, k, poses[k]) for k, name in enumerate(names)],
        "points": [one_point(k, position) for k, position in enumerate(points().tolist())],
        "scale": {"source": "eyes", "metres_per_unit": 1.0, "relative_sigma": 0.031},
        "reprojection_rms_px": 0.2,
        "roughness": {"rotation_deg": 0.05, "translation_mm": 0.12},
        "timings_s": {"bundle": 0.1},
        "warnings": ["the head turns little: turn it more"],
    }
    return content | more


def one_frame(name: str, number: int, pose: list[list[float]]) -> Content:
    """A frame with its pose; the fifth is left out, the eighth fits badly."""
    if number == LEFT_OUT:
        nothing = dict.fromkeys(("cam_from_head", "rotation_sigma_deg", "translation_sigma_mm", "reprojection_rms_px"))
        return {"name": name, "used": False, "reason": "blurred", "points": 0} | nothing
    numbers = {"rotation_sigma_deg": 0.05, "translation_sigma_mm": 0.3}
    error = {"reprojection_rms_px": 0.9 if number == 7 else 0.2}
    return {"name": name, "used": True, "reason": "", "cam_from_head": pose, "points": 60} | numbers | error


def one_point(number: int, position: list[float]) -> Content:
    """A point whose numbers all differ from its neighbours'."""
    return {
        "id": 3 * number + 1,
        "position": position,
        "sigma_mm": 0.1 + 0.01 * number,
        "frames": 5 + number % 16,
        "reprojection_rms_px": 0.1 + 0.001 * number,
        "region": REGIONS[number % 4],
        "moves": REGIONS[number % 4] == "mouth",
    }


def show(clip: bpy.types.MovieClip, content: Content, kind: str = "CAMERA", **settings: Any) -> str:
    """Put a motion into the scene as the operator does."""
    scene = bpy.context.scene
    for name, value in ({"kind": kind} | settings).items():
        setattr(scene.facewright_motion, name, value)
    return module("motion.actions").place(scene, clip, parsed(content))


def parsed(content: Content) -> Any:
    """As the library has it."""
    return module("engine.motion").parse(json.dumps(content))


def posed(content: Content) -> list[int]:
    return [k for k, frame in enumerate(content["frames"]) if frame["cam_from_head"] is not None]


def projected(content: Content, number: int) -> NDArray[np.float64]:
    """Where the library's camera, without distortion, sees the points in a frame, pixels."""
    camera, pose = content["camera"], np.array(content["frames"][number]["cam_from_head"])
    x, y, z = pose[:3, :3] @ np.array([p["position"] for p in content["points"]]).T + pose[:3, 3:]
    return np.stack([camera["fx"] * x / z + camera["cx"], camera["fy"] * y / z + camera["cy"]], axis=-1)


def seen(frame: int, cloud: str = "Face Points") -> NDArray[np.float64]:
    """Where Blender's scene camera sees the vertices at a frame of the timeline, pixels of the library."""
    scene = bpy.context.scene
    scene.frame_set(frame)
    obj, render = scene.objects[cloud], scene.render
    places = [world_to_camera_view(scene, scene.camera, obj.matrix_world @ v.co) for v in obj.data.vertices]
    x, y, _ = np.array(places).T
    return np.stack([x * render.resolution_x - 0.5, (1.0 - y) * render.resolution_y - 0.5], axis=-1)


def keyed(obj: bpy.types.Object) -> dict[str, list[tuple[float, float]]]:
    """The keys of an object by their paths and indices."""
    curves = module("scene.pose_keys").curves(obj) or []
    return {f"{c.data_path} {c.array_index}": [tuple(k.co) for k in c.keyframe_points] for c in curves}


def saved(content: Content, folder: Path) -> str:
    """The path of a motion.json with this content."""
    path = folder / "motion.json"
    path.write_text(json.dumps(content))
    return str(path)


def places(*names: str) -> list[list[float]]:
    """Where objects are now."""
    bpy.context.view_layer.update()
    return [np.array(bpy.data.objects[name].matrix_world).ravel().tolist() for name in names]


def assert_follows(face: bpy.types.Object) -> None:
    """It is where the points are, by the one constraint, and they move."""
    assert [constraint.name for constraint in face.constraints] == [FOLLOW] and face.parent is None
    seen = []
    for frame in (1, 12):
        bpy.context.scene.frame_set(frame)
        assert np.allclose(face.matrix_world, bpy.data.objects["Face Points"].matrix_world, atol=1e-6)
        seen += places(face.name)
    assert not np.allclose(*seen, atol=1e-3)
