"""What `cargo x demo` runs inside Blender's module: install, reconstruct, save, take pictures."""

import argparse
import json
import math
import time
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

PACKAGE = "bl_ext.user_default.facewright"
SIZE = 512
YAWS = (-35, 0, 35)
EXPRESSIONS = ("happiness", "surprise", "smile", "fear")


def main() -> None:
    arguments = parse()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    install(arguments.zip)
    begun = time.monotonic()
    reconstruct(arguments)
    print(f"reconstructed in {time.monotonic() - begun:.1f} s")
    face = next(o for o in bpy.data.objects if o.get("facewright_part") == "skin")
    bpy.ops.wm.save_as_mainfile(filepath=str(arguments.out / "face.blend"))
    begun = time.monotonic()
    take_pictures(face, arguments)
    print(f"pictures in {time.monotonic() - begun:.1f} s")


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    parser.add_argument("--zip", type=Path, required=True)
    parser.add_argument("--clip", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--frames")
    return parser.parse_args()


def install(archive: Path) -> None:
    bpy.ops.extensions.package_install_files(
        filepath=str(archive), repo="user_default", enable_on_install=True, overwrite=True
    )


def reconstruct(arguments: argparse.Namespace) -> None:
    clip = bpy.context.scene.facewright_clip
    clip.path = str(arguments.clip)
    if arguments.frames:
        clip.use_range = True
        clip.first, clip.last = (int(n) for n in arguments.frames.split("-"))
    try:
        bpy.ops.facewright.reconstruct(output=str(arguments.out))
    except RuntimeError as error:
        # Blender's way to hand on what the operator reports.
        raise SystemExit(str(error).strip()) from None
    report = json.loads((arguments.out / "report.json").read_text())
    print(f"library: {report['timings_s']}")


def take_pictures(face: bpy.types.Object, arguments: argparse.Namespace) -> None:
    scene = set_up_studio()
    camera = bpy.data.objects.new("Studio camera", bpy.data.cameras.new("Studio camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    camera.data.lens = 85
    folder = arguments.out / "pictures"
    folder.mkdir(exist_ok=True)
    shots: list[Path] = []
    for yaw in YAWS:
        look_at_face(camera, math.radians(yaw))
        shots.append(render(scene, folder / f"yaw_{yaw:+d}.png"))
    look_at_face(camera, math.radians(12))
    for name in EXPRESSIONS:
        bpy.ops.facewright.expression(name=name)
        shots.append(render(scene, folder / f"{name}.png"))
    blink = {"eyeBlinkLeft": 1.0, "eyeBlinkRight": 1.0}
    bpy.ops.facewright.expression(name="neutral")
    for key, value in blink.items():
        face.data.shape_keys.key_blocks[key].value = value
    shots.append(render(scene, folder / "eyes_closed.png"))
    bpy.ops.facewright.expression(name="neutral")
    sheet(shots, folder / "sheet.png")
    overlay(scene, camera, arguments, folder)


def set_up_studio() -> bpy.types.Scene:
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 16
    scene.cycles.max_bounces = 3
    # On two cores the denoiser takes longer than the picture.
    scene.cycles.use_denoising = False
    scene.render.use_persistent_data = True
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.view_settings.view_transform = "Standard"
    world = bpy.data.worlds.new("Studio")
    scene.world = world
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    background = next(n for n in world.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.5, 0.5, 0.5, 1.0)
    background.inputs["Strength"].default_value = 1.3
    lamp = bpy.data.objects.new("Key", bpy.data.lights.new("Key", "AREA"))
    lamp.data.energy, lamp.data.size = 14.0, 1.0
    lamp.location = (0.6, -1.0, 0.6)
    lamp.rotation_euler = (Vector((0, 0, 0)) - lamp.location).to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(lamp)
    return scene


def look_at_face(camera: bpy.types.Object, yaw: float) -> None:
    """From 0.85 m, turned about the head: positive yaw shows the subject's right side."""
    target = Vector((0.0, 0.05, -0.035))
    direction = Vector((-math.sin(yaw), -math.cos(yaw), 0.03))
    camera.location = target + direction * 0.85
    camera.rotation_euler = (target - camera.location).to_track_quat("-Z", "Y").to_euler()


def render(scene: bpy.types.Scene, path: Path) -> Path:
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    return path


def overlay(scene: bpy.types.Scene, camera: bpy.types.Object, arguments: argparse.Namespace, folder: Path) -> None:
    """The head through the solved camera, beside the frame nearest to each side."""
    report = json.loads((arguments.out / "report.json").read_text())
    lens = report["camera"]
    used = [f for f in report["frames"] if f["used"]]
    used.sort(key=lambda f: f["cam_from_head"][0][2])
    scene.render.resolution_x, scene.render.resolution_y = lens["width"], lens["height"]
    data = camera.data
    data.sensor_fit, data.sensor_width = "HORIZONTAL", 36.0
    data.lens = lens["fx"] * 36.0 / lens["width"]
    data.shift_x = (lens["width"] / 2 - 0.5 - lens["cx"]) / lens["width"]
    data.shift_y = (lens["cy"] - lens["height"] / 2 + 0.5) / lens["width"]
    data.clip_start = 0.01
    # Even light all round on dull skin shows the texture as it is.
    bpy.data.objects["Key"].hide_render = True
    for material in bpy.data.materials:
        shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
        shader.inputs["Specular IOR Level"].default_value = 0.0
    background = next(n for n in scene.world.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    background.inputs["Strength"].default_value = 1.0
    scene.render.film_transparent = True
    from_head = Matrix(((1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 0, 0, 1)))
    camera_axes = Matrix.Diagonal((1, -1, -1, 1))
    rows = []
    for frame in (used[0], used[len(used) // 2], used[-1]):
        head_from_cam = Matrix(frame["cam_from_head"]).inverted()
        camera.matrix_world = from_head @ head_from_cam @ camera_axes
        drawn = pixels(render(scene, folder / f"overlay_{frame['name']}.png"))
        filmed = frame_picture(arguments, frame["name"], folder)
        alpha = drawn[..., 3:]
        rows.append(np.hstack([filmed, drawn * alpha + filmed * (1 - alpha)]))
    save(np.vstack(rows), folder / "overlay.png")


def frame_picture(arguments: argparse.Namespace, name: str, folder: Path) -> np.ndarray:
    if arguments.clip.is_dir():
        return pixels(next(p for p in arguments.clip.iterdir() if p.stem == name))
    import importlib

    video = importlib.import_module(f"{PACKAGE}.scene.video")
    jobs = importlib.import_module(f"{PACKAGE}.jobs")
    with jobs.wait(video.decode(str(arguments.clip), [int(name.removeprefix("frame_"))])) as decoded:
        (picture,) = Path(decoded).iterdir()
        return pixels(picture)


def pixels(path: Path) -> np.ndarray:
    """(height, width, 4) floats, top row first."""
    picture = bpy.data.images.load(str(path))
    width, height = picture.size
    values = np.empty(width * height * 4, np.float32)
    picture.pixels.foreach_get(values)
    bpy.data.images.remove(picture)
    return values.reshape(height, width, 4)[::-1].copy()


def save(values: np.ndarray, path: Path) -> None:
    height, width = values.shape[:2]
    picture = bpy.data.images.new(path.stem, width, height, alpha=False)
    values[..., 3] = 1.0
    picture.pixels.foreach_set(np.ascontiguousarray(values[::-1], np.float32).ravel())
    picture.filepath_raw, picture.file_format = str(path), "PNG"
    picture.save()


def sheet(paths: list[Path], out: Path) -> None:
    pictures = [pixels(path) for path in paths]
    while len(pictures) % 4:
        pictures.append(np.ones_like(pictures[0]))
    rows = [np.hstack(pictures[i : i + 4]) for i in range(0, len(pictures), 4)]
    save(np.vstack(rows), out)


if __name__ == "__main__":
    main()
