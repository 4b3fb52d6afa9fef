"""A motion that is there already: brought up to date, shown in another way, removed; the artist's own stays."""

import json
from pathlib import Path

import bpy
import numpy as np
import pytest
from conftest import snapshot
from moving import KINDS, keyed, posed, projected, saved, seen, show, solution
from tracking import CLIP, module, same, written


def data() -> dict[str, int]:
    """What `snapshot` counts, and what only a motion makes."""
    return snapshot() | {
        "node groups": len(bpy.data.node_groups),
        "timeline": len(bpy.context.scene.timeline_markers),
        "constraints": sum(len(obj.constraints) for obj in bpy.data.objects),
    }


@pytest.mark.parametrize("kind", KINDS)
def test_a_further_run_changes_no_counts_and_keeps_names(clip: bpy.types.MovieClip, kind: str) -> None:
    show(clip, solution(), kind)
    before = data()
    bpy.data.collections["Face Motion"].name = "Match Move"
    objects = list(bpy.data.collections["Match Move"].objects)
    for number, obj in enumerate(objects):
        obj.name = f"renamed {number}"
    content = solution(lens=False)
    for frame in content["frames"]:
        if frame["cam_from_head"] is not None:
            frame["cam_from_head"][2][3] += 0.1
    content["points"] = content["points"][:40]
    show(clip, content, kind)
    assert data() == before
    assert {obj.name for obj in bpy.data.collections["Match Move"].objects} == {
        f"renamed {k}" for k in range(len(objects))
    }
    cloud = module("scene.motion_cloud").cloud(bpy.context.scene)
    assert len(cloud.data.vertices) == 40 and len(cloud.data.attributes["sigma_mm"].data) == 40
    frame = posed(content)[0]
    assert np.abs(seen(frame + 1, cloud.name) - projected(content, frame)).max() < 0.01


def test_what_the_artist_adds_stays(clip: bpy.types.MovieClip) -> None:
    show(clip, solution())
    scene, eye = bpy.context.scene, bpy.data.objects["Face Camera"]
    home = bpy.data.collections["Face Motion"]
    lamp, mine = bpy.data.objects.new("Lamp", None), bpy.data.objects.new("Mine", bpy.data.cameras.new("Mine"))
    for obj in (lamp, mine):
        home.objects.link(obj)
    mine.location = (3.0, 0.0, 0.0)
    mine.keyframe_insert("location", frame=5)
    scene.timeline_markers.new("cut", frame=9).camera = mine
    eye.keyframe_insert("scale", frame=4)
    eye.data.background_images[0].alpha, eye.data.sensor_width = 0.3, 24.0
    bpy.data.objects["Face Points"].modifiers.clear()
    show(clip, solution())
    assert len(keyed(eye)["scale 0"]) == 1 and eye.data.background_images[0].alpha == pytest.approx(0.3)
    assert len(eye.data.background_images) == 1 and not bpy.data.objects["Face Points"].modifiers
    for kind in (*KINDS, "CAMERA"):
        show(clip, solution(), kind)
    bpy.ops.facewright.remove_motion()
    assert {obj.name for obj in home.objects} == {"Lamp", "Mine"} and len(keyed(mine)["location 0"]) == 1
    assert [marker.camera for marker in scene.timeline_markers] == [mine]
    show(clip, solution())
    assert len(home.objects) == 5, "the collection that stayed is used again"


@pytest.mark.parametrize("other", KINDS)
@pytest.mark.parametrize("kind", KINDS)
def test_it_is_shown_in_another_way_as_if_it_were_the_first(clip: bpy.types.MovieClip, kind: str, other: str) -> None:
    settings, content = bpy.context.scene.facewright_motion, solution()
    show(clip, content, other, key_turn=0.0)
    before = data()
    show(clip, content, kind)
    settings.kind = other
    assert data() == before
    assert max(np.abs(seen(k + 1) - projected(content, k)).max() for k in posed(content)) < 0.01


def test_fewer_key_frames_take_their_cameras_and_markers_away(clip: bpy.types.MovieClip) -> None:
    show(clip, solution(), "CAMERAS", key_turn=0.0)
    cameras = [obj for obj in bpy.context.scene.objects if obj.type == "CAMERA"]
    assert len(cameras) == len(bpy.context.scene.timeline_markers) == 20
    bpy.context.scene.facewright_motion.key_turn = np.radians(15.0)
    cameras = [obj for obj in bpy.context.scene.objects if obj.type == "CAMERA"]
    assert len(cameras) == len(bpy.context.scene.timeline_markers) == 4
    assert bpy.context.scene.camera in cameras and len(bpy.data.cameras) == 1


def test_a_clip_that_was_moved_takes_its_keys_along(clip: bpy.types.MovieClip) -> None:
    show(clip, solution())
    clip.frame_start = 1001
    show(clip, solution())
    assert keyed(bpy.data.objects["Face Camera"])["location 0"][0][0] == 1001.0


def test_without_its_clip_a_motion_is_still_shown(clip: bpy.types.MovieClip) -> None:
    content = solution()
    show(clip, content, key_turn=0.0)
    clip.filepath = str(CLIP / "board/board_0.png")
    bpy.context.scene.facewright_motion.kind = "HEAD"
    assert np.abs(seen(10) - projected(content, 9)).max() < 0.01
    bpy.data.movieclips.remove(clip)
    bpy.context.scene.facewright_motion.kind = "CAMERAS"
    assert np.abs(seen(10) - projected(content, 9)).max() < 0.01


@pytest.mark.parametrize("kind", KINDS)
def test_removing_removes_exactly_ours(clip: bpy.types.MovieClip, generic_face: bpy.types.Object, kind: str) -> None:
    before = data()
    show(clip, solution(), kind)
    assert data() != before
    assert bpy.ops.facewright.remove_motion() == {"FINISHED"}
    assert data() == before and not bpy.ops.facewright.remove_motion.poll()


def test_what_was_deleted_is_made_again(clip: bpy.types.MovieClip) -> None:
    content = solution()
    for kind in KINDS:
        for name in ("Face Head", "Face Points", "Face Camera"):
            show(clip, content, kind, key_turn=0.0)
            for obj in [obj for obj in bpy.data.objects if obj.name.startswith(name)]:
                bpy.data.objects.remove(obj)
            show(clip, content, kind)
            assert np.abs(seen(10) - projected(content, 9)).max() < 0.01


def test_a_saved_motion_is_opened_again(clip: bpy.types.MovieClip, tmp_path: Path) -> None:
    content, path = solution(), str(tmp_path / "saved.json")
    show(clip, content)
    assert bpy.ops.facewright.save_motion(filepath=path) == {"FINISHED"}
    assert same(json.loads(Path(path).read_text()), written(content))
    bpy.ops.facewright.remove_motion()
    assert bpy.ops.facewright.open_motion(filepath=path) == {"FINISHED"}
    assert np.abs(seen(10) - projected(content, 9)).max() < 0.01
    (tmp_path / "none").touch()
    with pytest.raises(RuntimeError, match="cannot be written"):
        bpy.ops.facewright.save_motion(filepath=str(tmp_path / "none/motion.json"))


def test_a_saved_file_shows_the_same(clip: bpy.types.MovieClip, tmp_path: Path) -> None:
    content = solution()
    show(clip, content)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    assert np.abs(seen(10) - projected(content, 9)).max() < 0.01
    before = data()
    bpy.context.scene.facewright_motion.kind = "HEAD"
    bpy.context.scene.facewright_motion.kind = "CAMERA"
    assert data() == before and bpy.data.movieclips[0].users > 0


def test_opening_is_one_undo_step(clip: bpy.types.MovieClip, tmp_path: Path) -> None:
    path = saved(solution(), tmp_path)
    bpy.ops.ed.undo_push(message="Before")
    before = data()
    bpy.ops.facewright.open_motion("EXEC_DEFAULT", True, filepath=path)
    made = data()
    bpy.ops.facewright.remove_motion("EXEC_DEFAULT", True)
    assert data() == before
    bpy.ops.ed.undo()
    assert data() == made
    bpy.ops.ed.undo()
    assert data() == before
