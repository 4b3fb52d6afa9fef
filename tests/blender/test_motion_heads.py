"""A motion in a scene with two heads: it moves the one that its own clip has made, and never the other."""

from pathlib import Path

import bpy
import numpy as np
import pytest
from moving import FOLLOW, assert_follows, show, solution
from people import BEN, Person, clip_of, head_of, library, run, select
from tracking import CLIP

FILMED = Person("frames", 0.9, 200)
OWN = str(CLIP / "frames")


@pytest.fixture(autouse=True)
def people(monkeypatch: pytest.MonkeyPatch) -> None:
    library(monkeypatch, (FILMED, BEN))


def place(skin: bpy.types.Object, frame: int) -> list[float]:
    bpy.context.scene.frame_set(frame)
    return np.array(skin.matrix_world).ravel().tolist()


@pytest.mark.parametrize("first", ["motion", "heads"])
def test_the_head_of_the_motions_clip_follows_and_the_other_stands(
    clip: bpy.types.MovieClip, tmp_path: Path, first: str
) -> None:
    if first == "motion":
        show(clip, solution(), "HEAD")
    filmed, ben = run(OWN), run(clip_of(tmp_path, BEN))
    if first == "heads":
        show(clip, solution(), "HEAD")
    assert_follows(filmed)
    assert len(ben.constraints) == 0, "the other has nothing to follow"
    assert place(ben, 1) == place(ben, 12)


def test_a_run_of_another_clip_moves_neither(clip: bpy.types.MovieClip, tmp_path: Path) -> None:
    filmed, ben = run(OWN), run(clip_of(tmp_path, BEN))
    show(clip, solution(), "HEAD")
    ben.location = (0.7, 0.2, 0.1)
    before = [place(skin, frame) for skin in (filmed, ben) for frame in (1, 12)]
    assert run(clip_of(tmp_path, BEN)) == ben
    assert [place(skin, frame) for skin in (filmed, ben) for frame in (1, 12)] == before
    assert run(OWN) == filmed
    assert [place(skin, frame) for skin in (filmed, ben) for frame in (1, 12)] == before


def test_a_new_head_of_another_clip_does_not_come_to_where_the_motion_stands(
    clip: bpy.types.MovieClip, tmp_path: Path
) -> None:
    show(clip, solution(), "CAMERA")
    bpy.data.objects["Face Head"].location = (0.0, -1.0, 0.0)
    filmed, ben = run(OWN), run(clip_of(tmp_path, BEN))
    assert filmed.location.y == pytest.approx(-1.0), "its own head does"
    assert ben.location[:] == pytest.approx((0.3, -1.0, 0.0)), "the other stands beside it"


def test_which_head_is_active_does_not_matter(clip: bpy.types.MovieClip, tmp_path: Path) -> None:
    filmed, ben = run(OWN), run(clip_of(tmp_path, BEN))
    select(ben)
    show(clip, solution(), "HEAD")
    assert_follows(filmed)
    assert len(ben.constraints) == 0


def test_follow_turned_off_lets_only_its_own_heads_go(clip: bpy.types.MovieClip, tmp_path: Path) -> None:
    filmed, ben = run(OWN), run(clip_of(tmp_path, BEN))
    show(clip, solution(), "HEAD")
    other = ben.constraints.new("COPY_TRANSFORMS")
    # As of a head that was appended with the motion of its own file.
    other.name, other.target = FOLLOW, bpy.data.objects.new("Face Head of Ben", None)
    bpy.context.scene.facewright_motion.follow = False
    assert len(filmed.constraints) == 0
    assert [constraint.name for constraint in ben.constraints] == [FOLLOW], "another motion's stays"


def test_a_motion_of_a_third_clip_moves_no_head(clip: bpy.types.MovieClip, tmp_path: Path) -> None:
    heads = [run(clip_of(tmp_path, BEN)), run(clip_of(tmp_path, BEN), head="NEW")]
    before = [place(skin, 1) for skin in heads]
    show(clip, solution(), "HEAD")
    assert [place(skin, 12) for skin in heads] == before
    assert all(len(skin.constraints) == 0 for skin in heads)


def test_of_a_head_and_its_copy_the_head_follows(clip: bpy.types.MovieClip) -> None:
    filmed = run(OWN)
    select(*head_of(filmed).objects)
    bpy.ops.object.duplicate()
    show(clip, solution(), "HEAD")
    assert_follows(filmed)
    assert len(bpy.data.objects["Face.001"].constraints) == 0


def test_a_head_that_follows_is_appended_with_what_it_follows(clip: bpy.types.MovieClip, tmp_path: Path) -> None:
    show(clip, solution(), "HEAD")
    filmed = run(OWN)
    before = [place(filmed, frame) for frame in (1, 12)]
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "filmed.blend"))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
    folder = f"{tmp_path}/filmed.blend/Collection/"
    assert bpy.ops.wm.append(filepath=f"{folder}Face", directory=folder, filename="Face") == {"FINISHED"}
    assert [place(bpy.data.objects["Face"], frame) for frame in (1, 12)] == before, "it moves as it did"
    ben = run(clip_of(tmp_path, BEN))
    assert len(ben.constraints) == 0, "a new head does not follow what another brought along"
    assert [place(bpy.data.objects["Face"], frame) for frame in (1, 12)] == before
