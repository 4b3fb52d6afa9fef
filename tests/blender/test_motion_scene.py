"""A motion as objects: what Blender sees through its cameras is what the library's camera saw."""

import bpy
import numpy as np
import pytest
from moving import KINDS, LEFT_OUT, keyed, posed, projected, seen, show, solution
from tracking import NAMES, REGIONS, module

TOLERANCE_PX = 0.01


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("start", [1, 101])
def test_points_are_seen_where_the_library_projects_them(clip: bpy.types.MovieClip, kind: str, start: int) -> None:
    clip.frame_start, content = start, solution()
    show(clip, content, kind, key_turn=0.0)
    worst = max(np.abs(seen(k + start) - projected(content, k)).max() for k in posed(content))
    print(f"{kind} from {start}: {worst:.5f} px")
    assert worst < TOLERANCE_PX


@pytest.mark.parametrize("kind", KINDS)
def test_through_pixels_that_are_not_square_points_are_seen_right(clip: bpy.types.MovieClip, kind: str) -> None:
    content = solution(lens=False)
    content["camera"] |= {"fy": 610.0, "cx": 190.0, "cy": 160.0}
    show(clip, content, kind, key_turn=0.0)
    assert max(np.abs(seen(k + 1) - projected(content, k)).max() for k in posed(content)) < TOLERANCE_PX


@pytest.mark.parametrize("kind", KINDS)
def test_the_whole_may_be_moved(clip: bpy.types.MovieClip, kind: str) -> None:
    """What stands carries what moves, also when it is moved, turned and made larger; a further run keeps that."""
    content = solution()
    show(clip, content, kind, key_turn=0.0)
    anchor = bpy.data.objects["Face Camera" if kind == "HEAD" else "Face Head"]
    anchor.location, anchor.rotation_euler, anchor.scale = (0.3, -1.2, 0.5), (0.2, -0.4, 1.0), (2.0, 2.0, 2.0)
    for _ in range(2):
        assert max(np.abs(seen(k + 1) - projected(content, k)).max() for k in (0, 9, 20)) < TOLERANCE_PX
        show(clip, content, kind, key_turn=0.0)
    assert anchor.location[:] == pytest.approx((0.3, -1.2, 0.5))


def test_the_reconstructed_head_is_where_the_points_are(
    clip: bpy.types.MovieClip, generic_face: bpy.types.Object
) -> None:
    generic_face.location = (1.0, 2.0, 0.5)
    bpy.context.view_layer.update()
    show(clip, solution())
    assert bpy.data.objects["Face Head"].location[:] == pytest.approx((1.0, 2.0, 0.5))
    show(clip, solution(), "HEAD")
    assert generic_face.constraints[0].name == "Facewright Motion" and generic_face.parent is None
    for frame in (1, 12):
        bpy.context.scene.frame_set(frame)
        assert np.allclose(generic_face.matrix_world, bpy.data.objects["Face Points"].matrix_world, atol=1e-6)
    mean = np.mean([moved_to(frame) for frame in range(1, 22)], axis=0)
    assert mean == pytest.approx((1.0, 2.0, 0.5), abs=0.01), "about its own place"
    bpy.context.scene.facewright_motion.follow = False
    bpy.context.view_layer.update()
    assert len(generic_face.constraints) == 0 and generic_face.matrix_world.translation[:] == pytest.approx((1, 2, 0.5))


def moved_to(frame: int) -> list[float]:
    bpy.context.scene.frame_set(frame)
    return list(bpy.data.objects["Face Head"].matrix_world.translation)


@pytest.mark.parametrize("kind", ["CAMERA", "HEAD"])
def test_frames_without_a_pose_have_no_key(clip: bpy.types.MovieClip, kind: str) -> None:
    content = solution()
    show(clip, content, kind)
    curves = keyed(bpy.data.objects["Face Camera" if kind == "CAMERA" else "Face Head"])
    assert sorted(curves) == [*(f"location {k}" for k in range(3)), *(f"rotation_quaternion {k}" for k in range(4))]
    for keys in curves.values():
        assert [frame for frame, _ in keys] == [k + 1 for k in posed(content)]
    still = bpy.data.objects["Face Head" if kind == "CAMERA" else "Face Camera"]
    assert keyed(still) == {}


def test_rotations_keep_their_half(clip: bpy.types.MovieClip) -> None:
    """A head that turns by more than a whole turn."""
    content = solution(lens=False)
    for k, frame in enumerate(content["frames"]):
        c, s = np.cos(0.4 * k), np.sin(0.4 * k)
        frame["cam_from_head"] = [[c, 0, s, 0], [0, -1, 0, 0], [s, 0, -c, 0.6], [0, 0, 0, 1]]
    show(clip, content)
    curves = keyed(bpy.data.objects["Face Camera"])
    turns = np.array([[value for _, value in curves[f"rotation_quaternion {k}"]] for k in range(4)])
    assert np.abs(np.diff(turns, axis=1)).max() < 0.41 and turns.min() < 0.0


def test_key_cameras_have_markers_that_switch_to_them(clip: bpy.types.MovieClip) -> None:
    clip.frame_start = 11
    show(clip, solution(), "CAMERAS", key_turn=np.radians(8.0))
    scene = bpy.context.scene
    cameras = [obj.name for obj in scene.objects if obj.type == "CAMERA"]
    bound = {marker.frame: marker.camera.name for marker in scene.timeline_markers}
    assert sorted(cameras) == sorted(bound.values()) and cameras[0] == "Face Camera 0011" and 4 < len(cameras) < 12
    assert all(name == f"Face Camera {frame:04d}" for frame, name in bound.items())
    for frame in range(11, 32):
        scene.frame_set(frame)
        assert scene.camera.name == bound[max(number for number in bound if number <= frame)]
    assert len({scene.objects[name].data for name in cameras}) == 1, "one lens"


@pytest.mark.parametrize("lens", [False, True])
def test_the_clip_is_behind_what_the_camera_sees(clip: bpy.types.MovieClip, lens: bool) -> None:
    clip.frame_start = 101
    show(clip, solution(lens=lens))
    data = bpy.data.objects["Face Camera"].data
    (background,) = data.background_images
    assert data.show_background_images and background.source == "MOVIE_CLIP" and background.clip == clip
    assert background.alpha == 1.0 and background.display_depth == "BACK" and not background.use_camera_clip
    assert background.clip_user.use_render_undistorted == lens
    # The clip's own start puts its first frame there; the keys say the same.
    assert (
        background.clip.frame_start == 101
        and min(f for f, _ in keyed(bpy.data.objects["Face Camera"])["location 0"]) == 101
    )
    assert clip.tracking.camera.k1 == pytest.approx(-0.12 if lens else 0.0)


def test_a_clip_with_an_offset_has_its_poses_at_the_frames_that_it_shows(clip: bpy.types.MovieClip) -> None:
    clip.frame_offset = 5
    content = solution(names=NAMES)
    content["frames"] = content["frames"][5:]
    show(clip, content)
    assert [frame for frame, _ in keyed(bpy.data.objects["Face Camera"])["location 0"]] == list(range(1, 17))
    assert np.abs(seen(1) - projected(content, 0)).max() < TOLERANCE_PX


def test_points_have_their_numbers_and_colours(clip: bpy.types.MovieClip) -> None:
    content = solution()
    show(clip, content)
    obj = bpy.data.objects["Face Points"]
    for name, key in (
        ("track_id", "id"),
        ("sigma_mm",) * 2,
        ("frames",) * 2,
        ("rms_px", "reprojection_rms_px"),
        ("moves",) * 2,
    ):
        values = [entry.value for entry in obj.data.attributes[name].data]
        assert values == pytest.approx([point[key] for point in content["points"]])
    regions = [REGIONS[entry.value] for entry in obj.data.attributes["region"].data]
    assert regions == [point["region"] for point in content["points"]]
    assert len({tuple(entry.color) for entry in obj.data.attributes["region_color"].data}) == 4
    assert obj.hide_render and len(obj.data.vertices) == 60


def test_each_point_is_shown_as_a_ball_of_its_regions_colour(clip: bpy.types.MovieClip) -> None:
    show(clip, solution())
    graph = bpy.context.evaluated_depsgraph_get()
    points = bpy.data.objects["Face Points"]
    shown = {}
    for ball in graph.object_instances:
        if ball.is_instance and ball.parent.original == points:
            mesh = ball.object.data
            look = mesh.materials[mesh.polygons[0].material_index]
            shown[tuple(np.round(ball.matrix_world.translation, 5))] = look.diffuse_color[:]
    assert len(shown) == 60
    for vertex, entry in zip(points.data.vertices, points.data.attributes["region"].data):
        place = tuple(np.round(points.matrix_world @ vertex.co, 5))
        assert shown[place] == pytest.approx(module("scene.motion_cloud").linear(REGIONS[entry.value]), abs=1e-5)


def test_a_new_scene_gets_camera_size_and_frames_and_a_used_one_keeps_its_own(clip: bpy.types.MovieClip) -> None:
    scene = bpy.context.scene
    clip.frame_start = 50
    show(clip, solution())
    assert scene.camera.name == "Face Camera" and (scene.render.resolution_x, scene.render.resolution_y) == (400, 300)
    assert (scene.frame_start, scene.frame_end) == (50, 70)
    bpy.ops.facewright.remove_motion()
    mine = bpy.data.objects.new("Mine", bpy.data.cameras.new("Mine"))
    scene.collection.objects.link(mine)
    scene.camera, scene.frame_start, scene.frame_end, scene.render.resolution_x = mine, 3, 99, 1000
    show(clip, solution())
    assert scene.camera == mine and (scene.frame_start, scene.frame_end, scene.render.resolution_x) == (3, 99, 1000)
    assert mine.animation_data is None and mine.data.lens == 50.0


def test_a_frame_that_is_left_out_is_passed_through(clip: bpy.types.MovieClip) -> None:
    content = solution()
    show(clip, content)
    middle = (projected(content, LEFT_OUT - 1) + projected(content, LEFT_OUT + 1)) / 2
    assert np.abs(seen(LEFT_OUT + 1) - middle).max() < 1.0
