"""What runs: one bar with its steps, a head that grows, and what was said, which stays in the panel."""

from types import ModuleType, SimpleNamespace
from typing import Any

import bpy
import numpy as np
import pytest
from conftest import PACKAGE
from mathutils import Euler, Quaternion, Vector
from tracking import SHAPE, Finished, drawn, module


@pytest.fixture
def running(addon: ModuleType) -> Any:
    """What runs, nothing at first and at last."""
    yield module("running")
    module("running").Running.end()
    module("running").Running.said.clear()


def worker(work: Any, message: str = "made", fails: Exception | None = None) -> Any:
    """An operator of a window that does some work; what it reported, drew and made is remembered."""
    modal = module("modal")

    class Worker(modal.WorkOperator):
        def __init__(self) -> None:
            self.reported: list[str] = []
            self.drawn: list[Any] = []
            self.hidden: list[bool] = []

        def report(self, kind: set[str], text: str) -> None:
            self.reported.append(f"{next(iter(kind))} {text}")

        def start(self, _context: Any) -> Any:
            return work

        def finish(self, _context: Any, _result: Any) -> str:
            if fails is not None:
                raise fails
            return message

        def show(self, _context: Any, sketch: Any) -> None:
            self.drawn.append(sketch)

        def hide(self, _context: Any, cancelled: bool) -> None:
            self.hidden.append(cancelled)

    operator = Worker()
    operator._work, operator._scene = work, bpy.context.scene.session_uid
    module("running").Running.begin(Worker)
    return operator


def test_the_bar_counts_steps_and_never_falls(running: Any) -> None:
    progress = module("engine").Progress
    running.Running.begin(object)
    running.Running.advance(progress("track", 0.5, 12.0, (3, 8)))
    running.Running.advance(progress("texture: fill", 0.4, None, (8, 8)))
    assert running.Running.progress.fraction == 0.5
    assert running.bar_text(running.Running.progress) == "8 of 8: Texture: fill"
    assert running.bar_text(progress("calibrate", 0.1)) == "Calibrate"
    assert running.time_left(12.2) == "13 s left, Esc cancels" and running.time_left(None) == "Esc cancels"


def test_a_job_s_shapes_are_told_once_each() -> None:
    seen = [progress.sketch for progress in module("jobs").watch(Finished("a head"))]
    assert np.array_equal(seen[0], SHAPE) and seen[1:] == [None]


def test_an_operator_draws_what_there_is_and_hides_it_when_the_result_comes(running: Any) -> None:
    operator = worker(module("jobs").watch(Finished("a head")))
    results = [operator.modal(bpy.context, SimpleNamespace(type="TIMER", value="")) for _ in range(3)]
    assert results == [{"RUNNING_MODAL"}, {"RUNNING_MODAL"}, {"FINISHED"}]
    assert len(operator.drawn) == 1 and operator.hidden == [False]
    assert operator.reported == ["INFO made"] and not running.Running.active


def test_esc_hides_what_was_drawn_as_cancelled(running: Any) -> None:
    operator = worker(module("jobs").watch(Finished("a head")))
    operator.modal(bpy.context, SimpleNamespace(type="TIMER", value=""))
    assert operator.modal(bpy.context, SimpleNamespace(type="ESC", value="PRESS")) == {"CANCELLED"}
    assert operator.hidden == [True] and operator.reported == ["INFO Cancelled; nothing was changed"]


@pytest.mark.parametrize(
    ("fails", "expected"), [(None, "Made of 3 frames"), ("it is no film", "It is no film")], ids=["made", "failed"]
)
def test_what_was_said_stays_until_the_next_work_or_file(running: Any, fails: str | None, expected: str) -> None:
    error = module("engine").FacewrightError(fails) if fails else None
    operator = worker(module("jobs").watch(Finished("a head")), "made of 3 frames", error)
    for _ in range(3):
        operator.modal(bpy.context, SimpleNamespace(type="TIMER", value=""))
    assert said(running, type(operator)) == expected
    running.Running.begin(type(operator))
    assert said(running, type(operator)) == ""
    running.Running.said[type(operator)] = running.Said("INFO", "made")
    bpy.ops.facewright.dismiss(work=type(operator).__name__)
    assert said(running, type(operator)) == "", "a click has put it away"
    running.Running.said[type(operator)] = running.Said("INFO", "made")
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    assert said(running, type(operator)) == ""


def said(running: Any, operator: type) -> str:
    """What the panel shows of an operator's last work."""
    lines: list[str] = []
    layout = SimpleNamespace(alignment="EXPAND")
    layout.operator = lambda _name, text, **_more: lines.append(text) or SimpleNamespace()
    layout.column = layout.row = lambda **_more: layout
    shown = SimpleNamespace(
        region=SimpleNamespace(width=400), preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))
    )
    running.draw_said(layout, shown, operator)
    return " ".join(lines)


def test_a_refused_clip_is_told_in_the_panel_too(running: Any) -> None:
    bpy.context.scene.facewright_clip.path = "/nowhere/film.mp4"
    with pytest.raises(RuntimeError):
        bpy.ops.facewright.reconstruct()
    assert "/nowhere/film.mp4 does not exist: choose the clip again" in drawn("FACEWRIGHT_PT_clip")


def test_views_look_at_a_growing_head_and_back_when_it_is_cancelled(addon: ModuleType) -> None:
    window, view = view_of_window()
    before = look(view)
    glance = module("scene.view").Glance()
    glance.turn(window, Vector((1.0, 2.0, 3.0)), 0.3)
    assert view.view_location == Vector((1.0, 2.0, 3.0)) and view.view_distance == pytest.approx(0.75)
    assert seen_from(view) == pytest.approx((20.0, 10.0), abs=0.01)
    glance.back(window)
    assert look(view) == pytest.approx(before, abs=1e-6)
    glance.turn(window, Vector((1.0, 2.0, 3.0)), 0.3)
    view.view_location = (9.0, 9.0, 9.0)
    glance.back(window)
    assert view.view_location == Vector((9.0, 9.0, 9.0)), "the artist has looked elsewhere meanwhile"


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
def test_a_new_face_is_seen_from_its_left_and_above_however_the_head_is_turned(addon: ModuleType, kind: str) -> None:
    window, view = view_of_window()
    view.view_perspective = kind
    heading = Quaternion((0.0, 0.0, 1.0), np.radians(50.0))
    module("scene.view").Glance().face(window, heading)
    assert seen_from(view, heading) == pytest.approx((20.0, 10.0), abs=0.01)
    nodding = Quaternion((0.0, 1.0, 0.0), np.radians(25.0)) @ Quaternion((1.0, 0.0, 0.0), np.radians(15.0))
    module("scene.view").Glance().face(window, nodding)
    assert seen_from(view, nodding) == pytest.approx((20.0, 10.0), abs=0.01)
    assert abs((view.view_rotation @ Vector((1.0, 0.0, 0.0))).z) < 1e-5, "the horizon stays level"


def test_a_view_that_the_artist_turned_meanwhile_or_along_an_axis_keeps_its_angle(addon: ModuleType) -> None:
    window, view = view_of_window()
    glance = module("scene.view").Glance()
    glance.turn(window, Vector(), 0.3)
    glance.face(window, Quaternion((0.0, 0.0, 1.0), 0.5))
    assert seen_from(view)[0] == pytest.approx(20.0 + np.degrees(0.5), abs=0.01), "nobody has moved it"
    view.view_rotation = orbited = Euler((1.0, 0.0, 2.0)).to_quaternion()
    glance.face(window, Quaternion())
    assert look(view)[4:] == pytest.approx(orbited[:], abs=1e-6)
    # Blender's own way to say so: it turns the view to the nearest axis.
    view.view_perspective, view.is_orthographic_side_view = "ORTHO", True
    aligned = look(view)[4:]
    assert aligned != pytest.approx(orbited[:], abs=1e-3)
    module("scene.view").Glance().turn(window, Vector(), 0.3)
    assert look(view)[4:] == aligned and view.view_distance == pytest.approx(0.75)


def look(view: Any) -> tuple[float, ...]:
    return (*view.view_location, view.view_distance, *view.view_rotation)


def seen_from(view: Any, head: Any = None) -> tuple[float, float]:
    """From where a view sees a face: degrees to the head's own left of its front, and above it."""
    towards = (head or Quaternion()).inverted() @ (view.view_rotation @ Vector((0.0, 0.0, 1.0)))
    return float(np.degrees(np.arctan2(towards.x, -towards.y))), float(np.degrees(np.arcsin(towards.z)))


def view_of_window() -> tuple[Any, Any]:
    window = bpy.context.window_manager.windows[0]
    window.screen.areas[0].type = "VIEW_3D"
    view = window.screen.areas[0].spaces.active.region_3d
    view.view_perspective, view.view_location, view.view_distance = "PERSP", (0.5, 0.0, 0.0), 10.0
    view.is_orthographic_side_view, view.view_rotation = False, Euler((1.1, 0.0, 0.8)).to_quaternion()
    return window, view


def test_a_sketch_is_drawn_until_the_extension_is_turned_off(addon: ModuleType, monkeypatch: Any) -> None:
    sketch, drawing = module("scene.sketch"), []
    views = SimpleNamespace(
        draw_handler_add=lambda *given: drawing.append(given[0]) or given[0],
        draw_handler_remove=lambda handle, _region: drawing.remove(handle),
    )
    monkeypatch.setattr(sketch, "bpy", SimpleNamespace(types=SimpleNamespace(SpaceView3D=views)))
    positions = np.zeros((3, 3), np.float32)
    generic = SimpleNamespace(positions=positions, quads=np.zeros((1, 4), np.int64), parts=[("skin", (0, 3), (0, 1))])
    made = sketch.Sketch(bpy.context.scene, generic, Vector())
    made.show(positions)
    made.show(positions)
    assert len(drawing) == 1 and sketch.Sketch.drawn is made
    bpy.ops.preferences.addon_disable(module=PACKAGE)
    assert not drawing and sketch.Sketch.drawn is None
    bpy.ops.preferences.addon_enable(module=PACKAGE)


def test_what_faces_the_light_is_brighter(addon: ModuleType) -> None:
    sketch = module("scene.sketch")
    # Two triangles, one towards the light and one away from it.
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1]] * 2, np.float32)
    triangles = np.array([[0, 1, 2], [3, 5, 4]], np.int32)
    colours = sketch.lit(positions, triangles, np.ones((6, 3), np.float32))
    assert colours.shape == (6, 4) and np.all(colours[:, 3] == 1.0)
    assert np.all(colours[:3, :3] > 0.8) and np.allclose(colours[3:, :3], sketch.AMBIENT)
