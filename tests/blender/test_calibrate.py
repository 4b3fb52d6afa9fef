"""Calibration: from pictures and clips, its table, the boards in the scene, Blender's cameras and clips."""

import importlib
import json
import time
from math import radians
from pathlib import Path
from types import ModuleType
from typing import Any

import blf
import bpy
import numpy as np
import pytest
from bpy_extras.object_utils import world_to_camera_view
from conftest import PACKAGE, ROOT, snapshot
from mathutils import Matrix, Vector
from tracking import drawn

CLIP = ROOT / "tests/data/clip"
TRUTH = json.loads((CLIP / "truth.json").read_text())
NAMES = [f"board_{k}" for k in range(8)]
NUMBERS = {"width": 640, "height": 480, "fx": 700.0, "fy": 700.0, "cx": 319.5, "cy": 239.5}


@pytest.fixture
def settings() -> Any:
    return bpy.context.scene.facewright_camera


@pytest.fixture(scope="module")
def camera_json(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The camera of the synthetic boards as a file."""
    bpy.ops.facewright.calibrate(directory=str(CLIP / "board"))
    path = tmp_path_factory.mktemp("camera") / "camera.json"
    assert bpy.ops.facewright.save_camera(filepath=str(path)) == {"FINISHED"}
    return path


@pytest.fixture
def calibrated(camera_json: Path, settings: Any) -> Any:
    """A scene with that camera."""
    assert bpy.ops.facewright.open_camera(filepath=str(camera_json)) == {"FINISHED"}
    return settings


def write(path: Path, **numbers: Any) -> str:
    """A camera file with other numbers."""
    path.write_text(json.dumps(NUMBERS | numbers))
    return str(path)


def board_objects() -> dict[str, bpy.types.Object]:
    bpy.context.view_layer.update()
    return {o.name: o for o in bpy.data.objects if o.type == "MESH"}


def test_pictures_of_a_board_give_the_camera_and_a_table(settings: Any) -> None:
    assert bpy.ops.facewright.calibrate(directory=str(CLIP / "board")) == {"FINISHED"}
    camera = json.loads(settings.text)
    assert camera["fx"] == pytest.approx(520.0, abs=0.5) and camera["cx"] == pytest.approx(203.2, abs=0.5)
    assert [row.name for row in settings.pictures] == NAMES
    for row, image in zip(settings.pictures, camera["images"], strict=True):
        assert row.found and row.used and not row.bad and not row.reason
        assert row.rms == pytest.approx(image["rms_px"]) and 0.0 < row.rms < row.worst < 0.2
        assert row.hold_out == pytest.approx(image["hold_out_rms_px"])


def test_chosen_files_are_used_alone(settings: Any) -> None:
    files = [{"name": f"{name}.png"} for name in NAMES[2:7]]
    assert bpy.ops.facewright.calibrate(directory=str(CLIP / "board"), files=files) == {"FINISHED"}
    assert [row.name for row in settings.pictures] == NAMES[2:7]


def test_a_picture_without_a_board_is_told_of(settings: Any, tmp_path: Path) -> None:
    for picture in (CLIP / "board").iterdir():
        (tmp_path / picture.name).symlink_to(picture)
    grey(tmp_path / "a_wall.png", 400, 300)
    assert bpy.ops.facewright.calibrate(directory=str(tmp_path)) == {"FINISHED"}
    wall = settings.pictures["a_wall"]
    assert wall.bad and not wall.found and not wall.used and wall.reason
    assert not any(row.bad for row in settings.pictures if row is not wall and row.name != "a_wall")


def test_a_picture_that_fits_badly_is_pointed_out(calibrated: Any, tmp_path: Path) -> None:
    camera = json.loads(calibrated.text)
    camera["images"][3]["rms_px"] *= 3.0
    camera["images"][5]["hold_out_rms_px"] *= 4.0
    path = tmp_path / "camera.json"
    path.write_text(json.dumps(camera))
    bpy.ops.facewright.open_camera(filepath=str(path))
    assert [row.name for row in calibrated.pictures if row.bad] == ["board_3", "board_5"]
    assert "times the median picture's" in calibrated.pictures["board_3"].reason


def grey(path: Path, width: int, height: int) -> None:
    picture = bpy.data.images.new("grey", width, height)
    picture.filepath_raw, picture.file_format = str(path), "PNG"
    picture.save()
    bpy.data.images.remove(picture)


def test_without_boards_there_is_a_sentence_and_nothing_changes(calibrated: Any, tmp_path: Path) -> None:
    for k in range(3):
        grey(tmp_path / f"{k}.png", 64, 64)
    bpy.ops.facewright.show_boards()
    before, text = snapshot(), calibrated.text
    with pytest.raises(RuntimeError, match="board"):
        bpy.ops.facewright.calibrate(directory=str(tmp_path))
    with pytest.raises(RuntimeError, match="does not exist"):
        bpy.ops.facewright.calibrate(filepath=str(tmp_path / "none.mp4"))
    (tmp_path / "broken.mp4").write_bytes(b"no video")
    with pytest.raises(RuntimeError, match="cannot be read as a video"):
        bpy.ops.facewright.calibrate(filepath=str(tmp_path / "broken.mp4"))
    assert snapshot() == before and calibrated.text == text and len(calibrated.pictures) == 8


@pytest.mark.parametrize(
    ("content", "sentence"),
    [("{", "is not JSON"), ("[]", "holds no camera"), ('{"cameras": []}', "rig"), ('{"width": 3}', "has no height")],
)
def test_a_file_that_is_no_camera_gets_a_sentence(settings: Any, tmp_path: Path, content: str, sentence: str) -> None:
    path = tmp_path / "camera.json"
    path.write_text(content)
    with pytest.raises(RuntimeError, match=sentence):
        bpy.ops.facewright.open_camera(filepath=str(path))
    with pytest.raises(RuntimeError, match="no camera has"):
        bpy.ops.facewright.open_camera(filepath=write(path, fx=-1.0))
    assert settings.text == ""


def board_film(path: Path, repeats: int) -> None:
    """A video of the synthetic boards, each for some frames."""
    scene = bpy.context.scene
    render = scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = 400, 300, 100
    scene.frame_start, scene.frame_end = 1, repeats * len(NAMES)
    scene.view_settings.view_transform = "Standard"
    editor = scene.sequence_editor_create()
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences
    for k, name in enumerate(NAMES):
        strip = strips.new_image(name, str(CLIP / f"board/{name}.png"), 1, 1 + repeats * k)
        strip.frame_final_duration = repeats
    if hasattr(render.image_settings, "media_type"):
        render.image_settings.media_type = "VIDEO"
    render.image_settings.file_format = "FFMPEG"
    render.ffmpeg.format, render.ffmpeg.codec = "MPEG4", "H264"
    render.ffmpeg.constant_rate_factor = "PERC_LOSSLESS"
    render.filepath = str(path)
    bpy.ops.render.render(animation=True)


def test_a_clip_of_a_board_gives_the_camera(tmp_path: Path, calibrated: Any) -> None:
    path = tmp_path / "boards.mp4"
    board_film(path, 3)
    bpy.ops.wm.read_homefile(use_empty=True)
    settings, before = bpy.context.scene.facewright_camera, snapshot()
    assert bpy.ops.facewright.calibrate(filepath=str(path)) == {"FINISHED"}
    assert snapshot() == before
    assert [row.name for row in settings.pictures] == [f"frame_{k:06d}" for k in range(24)]
    camera = json.loads(settings.text)
    assert camera["fx"] == pytest.approx(520.0, abs=2.0) and camera["rms_px"] < 0.2
    clip = bpy.data.movieclips.load(str(path))
    assert bpy.ops.facewright.calibrate(clip=clip.name) == {"FINISHED"}
    assert json.loads(settings.text) == camera


def test_of_a_long_clip_frames_are_spread_over_it(monkeypatch: pytest.MonkeyPatch) -> None:
    actions = importlib.import_module(f"{PACKAGE}.calibrate.actions")
    monkeypatch.setattr(actions.video, "frame_count", lambda _path: 5000)
    frames = actions.spread("film.mp4")
    assert len(frames) == actions.MAX_FRAMES and frames[0] == 0 and frames[-1] == 4999
    assert np.ptp(np.diff(frames)) <= 1


def test_a_sequence_clip_names_its_images(tmp_path: Path) -> None:
    footage = importlib.import_module(f"{PACKAGE}.scene.footage")
    clip = bpy.data.movieclips.load(str(CLIP / "board/board_0.png"))
    assert footage.clip_files(clip) == [str(CLIP / f"board/{name}.png") for name in NAMES]


def test_cancelling_while_a_clip_is_decoded_changes_nothing(tmp_path: Path) -> None:
    actions = importlib.import_module(f"{PACKAGE}.calibrate.actions")
    board_film(tmp_path / "boards.mp4", 2)
    bpy.ops.wm.read_homefile(use_empty=True)
    before = snapshot()
    work = actions.calibrated([str(tmp_path / "boards.mp4")], actions.BoardSettings(9, 6, 25.5))
    while next(work)[0] != "decode":
        time.sleep(0.001)
    work.close()
    assert snapshot() == before and bpy.context.scene.facewright_camera.text == ""


def test_the_boards_stand_where_they_were(calibrated: Any) -> None:
    assert bpy.ops.facewright.show_boards() == {"FINISHED"}
    objects = board_objects()
    assert sorted(objects) == NAMES and all(o.users_collection[0].name == "Calibration" for o in objects.values())
    for truth in TRUTH["boards"]:
        pose = np.array(truth["cam_from_board"])
        for x, y in ((0.0, 0.0), (8 * 0.0255, 0.0), (0.0, 5 * 0.0255)):
            right, down, ahead = (pose @ [x, y, 0.0, 1.0])[:3]
            there = objects[truth["name"]].matrix_world @ Vector((x, y, 0.0))
            assert there[:] == pytest.approx((right, ahead, -down), abs=0.001), "the camera looks along +y, z is up"


def test_the_boards_lie_over_their_photographs(calibrated: Any) -> None:
    """Black faces on black squares: poses, colours, camera and Blender's axes at once."""
    bpy.ops.facewright.show_boards()
    bpy.ops.facewright.set_scene_camera()
    scene, camera = bpy.context.scene, json.loads(calibrated.text)
    scene.camera.matrix_world = bpy.data.objects["Calibrated Camera"].matrix_world.copy()
    for name, obj in board_objects().items():
        photograph = levels(CLIP / f"board/{name}.png")
        dark, light = [], []
        size = 0.9 * 0.0255**2
        for face in (f for f in obj.data.polygons if f.area > size):
            seen = world_to_camera_view(scene, scene.camera, obj.matrix_world @ face.center)
            u, v = distorted(camera, seen.x * 400 - 0.5, (1.0 - seen.y) * 300 - 0.5)
            if 3 < u < 396 and 3 < v < 296:
                (dark if face.material_index else light).append(photograph[round(v), round(u)])
            facing = (obj.matrix_world.to_3x3() @ face.normal).dot(obj.matrix_world @ face.center)
            assert facing < 0.0, "the printed side looks at the camera"
        # The first black square may have a white mark.
        assert len(dark) > 20 and np.sort(dark)[-3] < np.median(light) - 0.3


def levels(path: Path) -> np.ndarray:
    """Grey levels of a picture, top row first."""
    picture = bpy.data.images.load(str(path))
    picture.colorspace_settings.name = "Non-Color"
    values = np.empty(picture.size[0] * picture.size[1] * 4, np.float32)
    picture.pixels.foreach_get(values)
    grey = np.flipud(values.reshape(picture.size[1], picture.size[0], 4)[..., 0])
    bpy.data.images.remove(picture)
    return grey


def distorted(camera: dict[str, float], u: float, v: float) -> tuple[float, float]:
    """Where the lens puts what a pinhole would show in a pixel; from the camera's own definition."""
    k1, k2, k3, p1, p2 = (camera.get(name, 0.0) for name in ("k1", "k2", "k3", "p1", "p2"))
    x, y = (u - camera["cx"]) / camera["fx"], (v - camera["cy"]) / camera["fy"]
    r2 = x * x + y * y
    rho = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    xd = x * rho + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    yd = y * rho + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return camera["fx"] * xd + camera["cx"], camera["fy"] * yd + camera["cy"]


def test_a_second_run_updates_the_boards_and_keeps_the_artists_camera(calibrated: Any) -> None:
    bpy.ops.facewright.show_boards()
    camera = bpy.data.objects["Calibrated Camera"]
    camera.location.z = 1.5
    before, objects = snapshot(), set(bpy.data.objects)
    files = [{"name": f"{name}.png"} for name in NAMES]
    assert bpy.ops.facewright.calibrate(directory=str(CLIP / "board"), files=files) == {"FINISHED"}
    assert bpy.ops.facewright.show_boards() == {"FINISHED"}
    assert snapshot() == before and set(bpy.data.objects) == objects and camera.location.z == 1.5
    assert bpy.ops.facewright.calibrate(directory=str(CLIP / "board"), files=files[:5]) == {"FINISHED"}
    assert sorted(board_objects()) == NAMES[:5], "shown boards follow a new calibration"
    assert len({o.data for o in board_objects().values()}) == 1


def test_removing_the_boards_removes_exactly_them(calibrated: Any) -> None:
    before = snapshot()
    bpy.ops.facewright.show_boards()
    assert bpy.ops.facewright.remove_boards() == {"FINISHED"}
    assert snapshot() == before
    assert not bpy.ops.facewright.remove_boards.poll()
    bpy.ops.facewright.show_boards()
    mine = bpy.data.objects.new("Mine", None)
    bpy.data.collections["Calibration"].objects.link(mine)
    bpy.ops.facewright.remove_boards()
    assert [o.name for o in bpy.data.objects] == ["Mine"]


def test_a_row_selects_its_board_and_wires_are_wires(calibrated: Any) -> None:
    calibrated.active = 2
    bpy.ops.facewright.show_boards()
    calibrated.active = 4
    assert bpy.context.view_layer.objects.active.name == "board_4"
    assert [o.name for o in bpy.context.selected_objects] == ["board_4"]
    board = bpy.data.objects["board_6"]
    board.select_set(True)
    bpy.context.view_layer.objects.active = board
    actions = importlib.import_module(f"{PACKAGE}.calibrate.actions")
    actions.follow_board(bpy.context.scene, board)
    assert calibrated.active == 6 and len(bpy.context.selected_objects) == 2, "a row follows; selections stay"
    calibrated.wire = True
    assert {o.display_type for o in board_objects().values()} == {"WIRE"}


def test_a_board_of_separate_squares_can_be_saved(settings: Any, tmp_path: Path) -> None:
    settings.pattern, settings.columns, settings.rows = "SQUARES", 5, 4
    settings.square_mm, settings.gap_mm = 25.0, 12.0
    paths = [tmp_path / "apart.svg", tmp_path / "wider.svg"]
    assert bpy.ops.facewright.save_board(filepath=str(paths[0])) == {"FINISHED"}
    settings.gap_mm = 14.0
    assert bpy.ops.facewright.save_board(filepath=str(paths[1])) == {"FINISHED"}
    assert paths[0].read_text() != paths[1].read_text()


def test_a_rig_is_calibrated_and_drawn(tmp_path: Path) -> None:
    """Twice the same camera: nothing lies between the two."""
    library = importlib.import_module("facewright")
    boards = [str(CLIP / "board")]
    rig = library.calibrate_rig([("left", boards), ("right", boards)]).result()
    assert rig.names == ["left", "right"] and rig.cameras[1].baseline < 1e-4
    for number, given in enumerate((rig, str(rig))):
        library.save_calibration_picture(given, str(tmp_path / f"{number}.svg"))
        assert (tmp_path / f"{number}.svg").read_bytes().startswith(b"<svg")
    with pytest.raises(library.FacewrightError, match="does not say which boards"):
        library.save_calibration_picture(json.dumps(NUMBERS), str(tmp_path / "none.svg"))


def test_separate_squares_are_drawn_apart(calibrated: Any) -> None:
    camera = json.loads(calibrated.text)
    camera["boards"] = [{"pattern": {"squares": {"gap": 0.5}}, "columns": 3, "rows": 4, "square": 0.03}]
    calibrated.text = json.dumps(camera)
    bpy.ops.facewright.show_boards()
    mesh = bpy.data.objects["board_0"].data
    black = [face for face in mesh.polygons if face.material_index == 1]
    assert len(black) == 12 and all(face.area == pytest.approx(0.03**2, rel=1e-4) for face in black)
    centres = sorted({round(face.center.x, 5) for face in black})
    assert centres == pytest.approx([0.015, 0.06, 0.105], abs=1e-5)


# Of Blender's side bar as wide as it is at first, pixels: a row of a list, and what a label and an icon take besides.
ROW_PX, AROUND_PX, ICON_PX = 206, 8, 20
FONT_PX = 11.0


def test_the_tables_numbers_and_headings_are_read_whole() -> None:
    panel = importlib.import_module(f"{PACKAGE}.calibrate.panel")
    blf.size(0, FONT_PX)
    room = ROW_PX * (1.0 - panel.PICTURES) / panel.COLUMNS - AROUND_PX
    assert blf.dimensions(0, "0.0234 px")[0] > room, "the measure tells what is too long"
    for text in [*(panel.pixels(value) for value in (0.0234, 0.8888, 8.888, 88.88, 8888.0)), *panel.HEADINGS]:
        assert blf.dimensions(0, text)[0] <= room, text
    name_room = ROW_PX * panel.PICTURES - ICON_PX - AROUND_PX
    assert blf.dimensions(0, "…" + "0" * (panel.LONG - 1))[0] <= name_room


def test_below_the_table_the_active_picture_has_all_its_numbers(calibrated: Any) -> None:
    calibrated.active = 3
    row = calibrated.pictures[3]
    row.reason = "its error is 3.0 times the median picture's"
    said = drawn("FACEWRIGHT_PT_pictures")
    assert "Error (px) RMS Worst" in said
    numbers = [f"{name} {value:.3f} px" for name, value in (("RMS", row.rms), ("Worst corner", row.worst))]
    assert f"board_3 {' '.join(numbers)} Held out {row.hold_out:.3f} px Its error is 3.0 times" in said


CAMERAS = {
    "landscape": {"cx": 301.3, "cy": 262.9, "fx": 715.0, "fy": 709.0},
    "wide pixels": {"cx": 301.3, "cy": 262.9, "fx": 500.0, "fy": 650.0},
    "portrait": {"width": 480, "height": 640, "cx": 251.7, "cy": 300.2, "fx": 702.0, "fy": 711.0},
    "portrait by its pixels": {"width": 500, "height": 480, "cx": 251.7, "cy": 230.2, "fx": 650.0, "fy": 500.0},
}


@pytest.mark.parametrize("fit", ["AUTO", "HORIZONTAL", "VERTICAL"])
@pytest.mark.parametrize("kind", CAMERAS)
def test_the_scene_camera_projects_as_the_library_does(tmp_path: Path, kind: str, fit: str) -> None:
    scene = bpy.context.scene
    scene.camera = bpy.data.objects.new("Mine", bpy.data.cameras.new("Mine"))
    scene.collection.objects.link(scene.camera)
    scene.camera.data.sensor_fit, scene.camera.data.sensor_width = fit, 23.5
    scene.camera.location, scene.camera.rotation_euler = (0.3, -0.2, 0.1), (0.2, 0.4, -0.3)
    bpy.context.view_layer.update()
    bpy.ops.facewright.open_camera(filepath=write(tmp_path / "camera.json", **CAMERAS[kind]))
    assert bpy.ops.facewright.set_scene_camera() == {"FINISHED"}
    camera = NUMBERS | CAMERAS[kind]
    assert scene.camera.data.sensor_width == pytest.approx(23.5)
    assert (scene.render.resolution_x, scene.render.resolution_y) == (camera["width"], camera["height"])
    place = np.array(scene.camera.matrix_world)
    for x, y, z in np.random.default_rng(1).uniform((-0.3, -0.3, 0.8), (0.3, 0.3, 3.0), (50, 3)):
        point = place @ [x, -y, -z, 1.0]
        seen = world_to_camera_view(scene, scene.camera, Vector(point[:3]))
        u, v = seen.x * camera["width"] - 0.5, (1.0 - seen.y) * camera["height"] - 0.5
        assert u == pytest.approx(camera["fx"] * x / z + camera["cx"], abs=0.002)
        assert v == pytest.approx(camera["fy"] * y / z + camera["cy"], abs=0.002)


def test_without_a_scene_camera_there_is_a_new_one(calibrated: Any) -> None:
    scene = bpy.context.scene
    assert scene.camera is None
    bpy.ops.facewright.set_scene_camera()
    camera: Any = scene.camera
    bpy.context.view_layer.update()
    ahead = camera.matrix_world.to_3x3() @ Vector((0.0, 0.0, -1.0))
    assert ahead[:] == pytest.approx((0.0, 1.0, 0.0), abs=1e-6)
    assert camera.data.lens == pytest.approx(520.0 * 36 / 400, abs=0.05)


LENSES = {
    "polynomial": {"k1": -0.21, "k2": 0.09, "k3": -0.02},
    "brown": {"k1": -0.21, "k2": 0.09, "k3": -0.02, "p1": 0.004, "p2": -0.007},
}


@pytest.mark.parametrize("lens", LENSES)
def test_the_clip_is_undistorted_as_the_library_does(tmp_path: Path, settings: Any, lens: str) -> None:
    """Blender's own undistortion, told by objects that follow undistorted markers."""
    grey(tmp_path / "picture.png", 640, 480)
    clip = settings.clip = bpy.data.movieclips.load(str(tmp_path / "picture.png"))
    camera = NUMBERS | {"fx": 712.0, "fy": 712.0, "cx": 301.3, "cy": 262.9} | LENSES[lens]
    bpy.ops.facewright.open_camera(filepath=write(tmp_path / "camera.json", **camera))
    assert bpy.ops.facewright.set_clip_lens() == {"FINISHED"}
    assert clip.tracking.camera.distortion_model == lens.upper()
    plain_camera(640, 480)
    for pinhole in [(40.0, 30.0), (600.0, 20.0), (330.0, 400.0), (100.0, 450.0), (610.0, 460.0), (320.0, 240.0)]:
        u, v = undistorted_by_blender(clip, *distorted(camera, *pinhole))
        assert (u, v) == pytest.approx(pinhole, abs=0.002)


def test_a_clips_lens_has_the_shape_of_its_pixels(tmp_path: Path, settings: Any) -> None:
    grey(tmp_path / "picture.png", 640, 480)
    clip = settings.clip = bpy.data.movieclips.load(str(tmp_path / "picture.png"))
    bpy.ops.facewright.open_camera(filepath=write(tmp_path / "camera.json", **CAMERAS["wide pixels"]))
    bpy.ops.facewright.set_clip_lens()
    lens = clip.tracking.camera
    assert lens.focal_length_pixels == pytest.approx(500.0) and lens.pixel_aspect == pytest.approx(1.3)
    assert lens.principal_point_pixels[:] == pytest.approx((301.8, 480 - 263.4), abs=1e-3)
    assert lens.focal_length == pytest.approx(500.0 * lens.sensor_width / 640)


def plain_camera(width: int, height: int) -> None:
    """A scene camera that looks straight; Follow Track mistakes a shifted one."""
    scene = bpy.context.scene
    scene.camera = bpy.data.objects.new("Plain", bpy.data.cameras.new("Plain"))
    scene.collection.objects.link(scene.camera)
    scene.render.resolution_x, scene.render.resolution_y = width, height


def undistorted_by_blender(clip: bpy.types.MovieClip, u: float, v: float) -> tuple[float, float]:
    scene = bpy.context.scene
    width, height = clip.size
    track = clip.tracking.tracks.new(name="Track", frame=1)
    track.markers[0].co = ((u + 0.5) / width, 1.0 - (v + 0.5) / height)
    follower = bpy.data.objects.new("Follower", None)
    scene.collection.objects.link(follower)
    place = scene.camera.matrix_world @ Matrix.Translation((0.0, 0.0, -1.0))
    follower.location = place.to_translation()
    constraint = follower.constraints.new("FOLLOW_TRACK")
    constraint.use_active_clip = False
    constraint.clip, constraint.track, constraint.use_undistorted_position = clip, track.name, True
    constraint.camera, constraint.frame_method = scene.camera, "STRETCH"
    scene.frame_set(1)
    seen = world_to_camera_view(scene, scene.camera, follower.matrix_world.to_translation())
    bpy.data.objects.remove(follower)
    return seen.x * width - 0.5, (1.0 - seen.y) * height - 0.5


def test_a_clip_of_another_size_is_refused(calibrated: Any, tmp_path: Path) -> None:
    assert not bpy.ops.facewright.set_clip_lens.poll()
    grey(tmp_path / "picture.png", 640, 480)
    clip = bpy.data.movieclips.load(str(tmp_path / "picture.png"))
    with pytest.raises(RuntimeError, match="choose the movie clip"):
        bpy.ops.facewright.set_clip_lens()
    calibrated.clip = clip
    with pytest.raises(RuntimeError, match="640 × 480, the camera was calibrated at 400 × 300"):
        bpy.ops.facewright.set_clip_lens()
    assert clip.tracking.camera.k1 == 0.0


def test_greyed_buttons(tmp_path: Path, settings: Any) -> None:
    operators = bpy.ops.facewright
    needing_boards = [operators.show_boards, operators.save_calibration_picture]
    needing_camera = [operators.set_scene_camera, operators.save_camera]
    assert not any(button.poll() for button in needing_boards + needing_camera)
    operators.open_camera(filepath=write(tmp_path / "camera.json"))
    assert all(button.poll() for button in needing_camera) and not any(button.poll() for button in needing_boards)
    assert len(settings.pictures) == 0


def test_the_camera_and_its_picture_can_be_saved(calibrated: Any, camera_json: Path, tmp_path: Path) -> None:
    assert json.loads(camera_json.read_text()) == json.loads(calibrated.text)
    for kind, begin in (("svg", b"<svg"), ("pdf", b"%PDF"), ("png", b"\x89PNG")):
        path = tmp_path / f"calibration.{kind}"
        assert bpy.ops.facewright.save_calibration_picture(filepath=str(path)) == {"FINISHED"}
        assert path.read_bytes().startswith(begin)
    with pytest.raises(RuntimeError, match="svg, .pdf or .png"):
        bpy.ops.facewright.save_calibration_picture(filepath=str(tmp_path / "calibration.txt"))
    (tmp_path / "none").touch()
    with pytest.raises(RuntimeError, match="cannot be written"):
        bpy.ops.facewright.save_camera(filepath=str(tmp_path / "none/camera.json"))


def test_each_button_is_one_undo_step(calibrated: Any, camera_json: Path) -> None:
    bpy.ops.ed.undo_push(message="Before")
    before = snapshot()
    bpy.ops.facewright.show_boards("EXEC_DEFAULT", True)
    assert len(board_objects()) == 8
    bpy.ops.ed.undo()
    assert snapshot() == before
    bpy.context.scene.facewright_camera.text = ""
    bpy.ops.ed.undo_push(message="Before")
    bpy.ops.facewright.calibrate("EXEC_DEFAULT", True, directory=str(CLIP / "board"))
    assert len(bpy.context.scene.facewright_camera.pictures) == 8
    bpy.ops.ed.undo()
    settings = bpy.context.scene.facewright_camera
    assert settings.text == "" and len(settings.pictures) == 0


def test_the_table_is_kept_in_the_file(calibrated: Any, tmp_path: Path) -> None:
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    settings = bpy.context.scene.facewright_camera
    assert [row.name for row in settings.pictures] == NAMES and settings.pictures[0].rms > 0.0


def test_the_shell_command_calibrates(addon: ModuleType, tmp_path: Path) -> None:
    cli = importlib.import_module(f"{PACKAGE}.cli")
    camera, picture, blend = (str(tmp_path / name) for name in ("camera.json", "picture.svg", "scene.blend"))
    boards = str(CLIP / "board")
    assert cli.run(["calibrate", boards, "-o", camera, "--picture", picture, "--blend", blend]) == 0
    assert json.loads(Path(camera).read_text())["fx"] == pytest.approx(520.0, abs=0.5)
    assert Path(picture).exists() and Path(blend).exists()
    assert cli.run(["calibrate", boards, "--inner", "9by6"]) == 2
    assert cli.run(["calibrate", str(CLIP / "frames"), "-o", str(tmp_path / "none.json")]) == 1
    assert cli.run(["calibrate", boards, "-o", str(tmp_path / "none.json"), "--picture", "picture.txt"]) == 1
    assert not (tmp_path / "none.json").exists()


def test_a_turned_camera_keeps_its_boards_before_it(calibrated: Any) -> None:
    bpy.ops.facewright.show_boards()
    camera, board = bpy.data.objects["Calibrated Camera"], board_objects()["board_0"]
    before = camera.matrix_world.inverted() @ board.matrix_world
    camera.rotation_euler.z = radians(40)
    bpy.context.view_layer.update()
    after = camera.matrix_world.inverted() @ board.matrix_world
    assert np.allclose(np.array(before), np.array(after), atol=1e-6)
