"""A filmed head's motion by the library itself: from a clip's pictures to the camera in the scene."""

import json

import bpy
import numpy as np
import pytest
from tracking import TRUTH, module


def test_a_clip_is_tracked_and_its_motion_solved(clip: bpy.types.MovieClip) -> None:
    bpy.context.scene.facewright_camera.text = json.dumps(TRUTH["camera"] | {"source": "board"})
    assert bpy.ops.facewright.track(clip=clip.name) == {"FINISHED"}
    assert bpy.ops.facewright.motion(clip=clip.name) == {"FINISHED"}
    motion = module("motion.actions").known(bpy.context.scene)
    assert len(motion.posed) == len(TRUTH["frames"]) and motion.reprojection_rms_px < 0.35 and len(motion.points) > 60
    ours = motion.poses[motion.posed, :3, :3]
    truth = np.array([frame["cam_from_head"] for frame in TRUTH["frames"]])[:, :3, :3]
    # How far it turned since the middle of the film does not depend on the head's own frame but for its tilt.
    turns = [np.einsum("kij,lj->kil", poses, poses[10]) for poses in (ours, truth)]
    cosines = (np.einsum("kij,kij->k", *turns) - 1.0) / 2.0
    assert np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0))).max() < 0.5
    eye, face_points = bpy.data.objects["Face Camera"], bpy.data.objects["Face Points"]
    assert bpy.context.scene.camera == eye and len(face_points.data.vertices) == len(motion.points)
    assert eye.data.background_images[0].clip == clip


def test_measured_pupils_reach_the_library_by_way_of_the_person(clip: bpy.types.MovieClip) -> None:
    scene = bpy.context.scene
    assert bpy.ops.facewright.track(clip=clip.name) == {"FINISHED"}
    depths = []
    for measured in (57.0, 68.4):
        scene.facewright_person.use_interocular, scene.facewright_person.interocular_mm = True, measured
        assert bpy.ops.facewright.motion(clip=clip.name) == {"FINISHED"}
        motion = module("motion.actions").known(scene)
        assert f"given as {measured:.1f} mm" in motion.scale.source
        depths.append(motion.frames[10].cam_from_head[2][3])
    assert abs(depths[1] / depths[0] - 1.2) < 1e-6


def test_films_of_a_rig_are_refused_in_words_where_it_has_no_such_camera(clip: bpy.types.MovieClip) -> None:
    import facewright

    assert bpy.ops.facewright.track(clip=clip.name) == {"FINISHED"}
    tracks = module("scene.track_reading").collect(clip)
    with pytest.raises(facewright.FacewrightError, match=r"rig\.json"):
        facewright.motion_on_rig([("left", tracks), ("right", tracks)], "{}")
    empty = json.dumps({"cameras": [], "rms_px": 0.0, "hold_out_rms_px": None, "warnings": []})
    job = facewright.motion_on_rig([("left", tracks), ("right", tracks)], empty)
    with pytest.raises(facewright.FacewrightError, match="the rig has no camera left"):
        job.result()
