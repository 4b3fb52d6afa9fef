"""Where a new head stands, and that it can be seen there."""

from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from mathutils import Vector
from people import ANNA, BEN, Clips, clip_of, library, run


@pytest.fixture
def clips(tmp_path: Path, monkeypatch: Any) -> Clips:
    library(monkeypatch)
    return Clips(anna=clip_of(tmp_path, ANNA), ben=clip_of(tmp_path, BEN))


def cube(size: float, place: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> bpy.types.Object:
    bpy.ops.mesh.primitive_cube_add(size=size, location=place)
    return bpy.context.object


def box(obj: bpy.types.Object) -> tuple[Any, Any]:
    bpy.context.view_layer.update()
    corners = np.array([obj.matrix_world @ Vector(corner) for corner in obj.bound_box])
    return corners.min(axis=0), corners.max(axis=0)


def test_a_head_stands_at_the_cursor(clips: Clips) -> None:
    bpy.context.scene.cursor.location = (1.0, 2.0, 0.5)
    assert run(clips.anna).location[:] == (1.0, 2.0, 0.5)


def test_a_head_stands_before_what_is_in_its_place(clips: Clips) -> None:
    block = cube(2.0)
    near = cube(0.5, (0.0, -1.3, 0.0))
    anna = run(clips.anna)
    assert anna.location.x == anna.location.z == 0.0
    assert box(anna)[1][1] < box(near)[0][1] < box(block)[0][1], "it looks to -y, away from both"
    assert box(anna)[1][1] > box(near)[0][1] - 0.3, "and is no farther than needed"


def test_rooms_floors_points_and_what_is_hidden_are_in_nobodys_way(clips: Clips) -> None:
    cube(8.0)
    points = cube(0.4)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.delete(type="EDGE_FACE")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert len(points.data.vertices) == 8
    bpy.ops.mesh.primitive_plane_add(size=20.0)
    cube(1.0).hide_set(True)
    assert run(clips.anna).location[:] == (0.0, 0.0, 0.0)


def test_a_second_head_stands_beside_the_first_wherever_that_is(clips: Clips) -> None:
    anna = run(clips.anna)
    anna.location = (0.5, -1.0, 1.5)
    assert run(clips.ben).location[:] == pytest.approx((0.8, -1.0, 1.5))


def test_an_updated_head_stays_where_it_is(clips: Clips) -> None:
    anna = run(clips.anna)
    anna.location = (0.5, 0.0, 0.0)
    bpy.context.scene.cursor.location = (2.0, 0.0, 0.0)
    cube(1.0, (0.5, 0.0, 0.0))
    run(clips.anna)
    assert anna.location[:] == (0.5, 0.0, 0.0)
