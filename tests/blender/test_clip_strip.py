"""The clip as it was looked at: its frames, what is said of it before a run, and what of it is used."""

import shutil
import subprocess
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import bpy
import numpy as np
import pytest
from conftest import ROOT, snapshot
from tracking import Finished, Layout, drawn, module

FRAMES = ROOT / "tests/data/clip/frames"


@pytest.fixture
def settings() -> Any:
    module("clip.actions").stop_looking()
    return bpy.context.scene.facewright_clip


@pytest.fixture
def looked(settings: Any) -> Any:
    """The synthetic person's frames, looked at."""
    settings.path = str(FRAMES)
    assert bpy.ops.facewright.survey() == {"FINISHED"}
    return module("clip.actions").strip_of(settings)


@pytest.fixture
def film(tmp_path: Path) -> Path:
    """The same as a film, with a gap of one frame so that it has forty."""
    if shutil.which("ffmpeg") is None:
        pytest.skip("a film is made with ffmpeg")
    path = tmp_path / "film.mp4"
    source = ["-framerate", "10", "-i", FRAMES / "frame_%02d.jpg", "-vf", "fps=20", "-c:v", "libx264", "-qp", "10"]
    subprocess.run(["ffmpeg", "-v", "error", *source, path], check=True)
    return path


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """What the library is asked to reconstruct."""
    from people import ANNA, result

    found: list[dict[str, Any]] = []

    def reconstruct(frames: list[str], **given: Any) -> Finished:
        found.append({"frames": frames} | given)
        return Finished(result(ANNA))

    monkeypatch.setattr(module("reconstruct.actions"), "reconstruct", reconstruct)
    return found


def pick(number: int, click: str) -> None:
    bpy.context.scene.facewright_clip.click = click
    assert bpy.ops.facewright.pick_frame(number=number) == {"FINISHED"}


def checked(settings: Any) -> Any:
    return module("clip.actions").strip_of(settings).part(module("scene.source").source_of(settings))


def test_looking_shows_frames_of_the_whole_clip_and_changes_nothing(settings: Any) -> None:
    settings.path = str(FRAMES)
    before = snapshot()
    assert bpy.ops.facewright.survey() == {"FINISHED"}
    strip = module("clip.actions").strip_of(settings)
    assert snapshot() == before
    numbers = [strip.number(look) for look in strip.shown()]
    assert len(numbers) == 15 and numbers[0] == 0 and numbers[-1] == 20 and numbers == sorted(set(numbers))
    assert all(look.usable and look.thumbnail.shape == (72, 96, 3) for look in strip.looks)
    yaws = [look.turn_deg[0] for look in strip.looks]
    assert yaws[0] < -18 and yaws[-1] > 18 and np.all(np.diff(yaws) > -1.0)


@pytest.mark.parametrize("click", ["FIRST", "LAST", "OUT"])
def test_a_frame_beyond_the_clip_cannot_be_picked(settings: Any, click: str) -> None:
    settings.path = str(FRAMES)
    settings.click = click
    before = snapshot()
    with pytest.raises(RuntimeError, match="this frame is not shown: look at the clip again"):
        bpy.ops.facewright.pick_frame(number=21)
    assert snapshot() == before and not settings.use_range and not settings.left_out


def test_the_panel_says_what_the_clip_shows_and_what_it_lacks(looked: Any, settings: Any) -> None:
    said = shown()
    assert "21 frames looked at can be used" in said and "to the left and" in said
    settings.use_range, settings.first, settings.last = True, 0, 8
    assert "To the right too" in shown().replace("to the right", "To the right")
    settings.first, settings.last = 9, 11
    assert "over" in shown() and "15° or more to each side" in shown()


def shown() -> str:
    """What the panel of the frames says."""
    layout = Strips()
    preferences = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))
    region = SimpleNamespace(width=2000)
    context = SimpleNamespace(scene=bpy.context.scene, region=region, preferences=preferences)
    bpy.types.FACEWRIGHT_PT_frames.draw(SimpleNamespace(layout=layout), context)
    return " ".join([*layout.said, *layout.numbers])


class Strips(Layout):
    """A layout that also takes frames."""

    def __init__(self) -> None:
        super().__init__()
        self.numbers: list[str] = []

    def operator(self, name: str, **more: Any) -> Any:
        self.numbers.append(more.get("text", ""))
        return super().operator(name, **more)

    def template_icon(self, icon_value: int, scale: float) -> None:
        assert scale > 1.0

    def panel_prop(self, data: Any, name: str) -> tuple["Strips", "Strips | None"]:
        assert name in data.bl_rna.properties
        return self, self if getattr(data, name) else None

    def grid_flow(self, **_more: Any) -> "Strips":
        return self


def test_before_a_look_the_panel_offers_one(settings: Any) -> None:
    settings.path = str(FRAMES)
    assert "Look at Clip" in shown()


def test_the_frames_fold_when_a_head_is_made_and_unfold_with_another_clip(
    looked: Any, settings: Any, asked: list[dict[str, Any]]
) -> None:
    assert "First" not in shown() and "Frames" in shown() and "looked at" in shown()
    assert bpy.ops.facewright.reconstruct() == {"FINISHED"}
    assert shown() == "Frames"
    settings.path = str(FRAMES)
    assert "looked at" in shown()


def test_a_click_sets_the_first_and_the_last_frame(looked: Any, settings: Any) -> None:
    pick(4, "FIRST")
    assert (settings.use_range, settings.first, settings.last) == (True, 4, 20)
    pick(16, "LAST")
    assert (settings.first, settings.last) == (4, 16)
    pick(20, "FIRST")
    assert (settings.first, settings.last) == (20, 20), "the other end gives way"
    pick(8, "LAST")
    assert (settings.first, settings.last) == (8, 8)


def test_a_click_leaves_out_the_stretch_of_a_frame_and_takes_it_in_again(
    looked: Any, settings: Any, asked: list[dict[str, Any]]
) -> None:
    stretches = [looked.stretch(looked.number(look)) for look in looked.shown()]
    every = [number for first, last in stretches for number in range(first, last + 1)]
    assert every == list(range(21)), "the stretches are the clip"
    first, last = looked.stretch(4)
    pick(4, "OUT")
    assert module("reconstruct.actions").length_line(settings) == (f"{20 - (last - first)} of 21 frames", True)
    assert bpy.ops.facewright.reconstruct() == {"FINISHED"}
    names = [Path(frame).stem for frame in asked[0]["frames"]]
    assert names == [f"frame_{n:02}" for n in range(21) if not first <= n <= last]
    pick(4, "OUT")
    assert settings.left_out == "" and module("reconstruct.actions").length_line(settings) == ("21 frames", True)


def test_frames_left_out_of_a_film_are_not_asked_for(settings: Any, film: Path, asked: list[dict[str, Any]]) -> None:
    settings.path = str(film)
    settings.left_out = "3-9, 12"
    settings.use_range, settings.first, settings.last = True, 2, 14
    assert bpy.ops.facewright.reconstruct() == {"FINISHED"}
    assert asked[0]["numbers"] == [2, 10, 11, 13, 14] and asked[0]["frames"] == [str(film)]
    assert module("reconstruct.actions").length_line(settings)[0].startswith("5 of ")


def test_what_is_left_out_stays_with_its_clip_and_in_the_file(looked: Any, settings: Any, tmp_path: Path) -> None:
    pick(4, "OUT")
    out = settings.left_out
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "file.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "file.blend"))
    settings = bpy.context.scene.facewright_clip
    assert out and settings.left_out == out
    settings.path = str(FRAMES.parent / "board")
    assert settings.left_out == ""


def test_everything_left_out_is_said_before_a_run(settings: Any) -> None:
    settings.path, settings.left_out = str(FRAMES), "0-20"
    said = module("reconstruct.actions").length_line(settings)
    assert said == ("Every frame is left out: take some of them in again", False)
    with pytest.raises(RuntimeError, match="every frame is left out"):
        bpy.ops.facewright.reconstruct()
    settings.left_out = "3-x"
    with pytest.raises(RuntimeError, match="numbers and stretches like 12-40,77, not 3-x"):
        bpy.ops.facewright.reconstruct()
    assert "like 12-40,77, not 3-x" in drawn("FACEWRIGHT_PT_clip")
    assert not bpy.types.FACEWRIGHT_PT_frames.poll(SimpleNamespace(scene=bpy.context.scene))


def test_all_frames_are_used_again_by_one_click(looked: Any, settings: Any) -> None:
    assert not bpy.ops.facewright.use_all_frames.poll()
    pick(4, "OUT")
    pick(8, "FIRST")
    assert bpy.ops.facewright.use_all_frames() == {"FINISHED"}
    assert (settings.left_out, settings.use_range) == ("", False)


def test_frames_have_the_timelines_numbers_where_a_movie_clip_shows_the_file(
    settings: Any, film: Path, looked: Any
) -> None:
    actions = module("clip.actions")
    settings.path = str(film)
    assert actions.shown_number(settings, 5) == 5, "as the panel counts, from 0"
    clip = bpy.data.movieclips.load(str(film))
    clip.frame_start, clip.frame_offset = 101, 3
    assert actions.shown_number(settings, 5) == 103 and actions.number_at(settings, 103) == 5
    assert bpy.ops.facewright.survey() == {"FINISHED"}
    assert "98" in shown().split(), "the first frame"
    scene = bpy.context.scene
    scene.frame_current = 103
    assert bpy.ops.facewright.frames_from_timeline(which="FIRST") == {"FINISHED"}
    scene.frame_current = 110
    assert bpy.ops.facewright.frames_from_timeline(which="LAST") == {"FINISHED"}
    assert (settings.first, settings.last, settings.use_range) == (5, 12, True)
    assert (settings.shown_first, settings.shown_last) == (103, 110)
    settings.shown_first, settings.shown_last = 104, 99999
    assert (settings.first, settings.last) == (6, settings.frames - 1), "no farther than the clip"
    scene.use_preview_range, scene.frame_preview_start, scene.frame_preview_end = True, 100, 120
    assert bpy.ops.facewright.frames_from_timeline() == {"FINISHED"}
    assert (settings.first, settings.last) == (2, 22)
    scene.frame_preview_start, scene.frame_preview_end = 5000, 6000
    with pytest.raises(RuntimeError, match="no two frames of the clip"):
        bpy.ops.facewright.frames_from_timeline()


def test_a_part_is_looked_at_closer(settings: Any, film: Path) -> None:
    settings.path = str(film)
    settings.use_range, settings.first, settings.last = True, 10, 20
    assert bpy.ops.facewright.survey(part=True) == {"FINISHED"}
    strip = module("clip.actions").strip_of(settings)
    assert [strip.number(look) for look in strip.looks] == list(range(10, 21))
    assert checked(settings).frames == 11


def test_without_ffmpeg_a_film_is_looked_at_too(
    settings: Any, film: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path / "nothing"))
    settings.path = str(film)
    before = snapshot()
    assert bpy.ops.facewright.survey() == {"FINISHED"}
    strip = module("clip.actions").strip_of(settings)
    numbers = [strip.number(look) for look in strip.looks]
    assert len(numbers) == 16 and numbers[0] == 0 and numbers[-1] == settings.frames - 1
    assert snapshot() == before and checked(settings).findings == []


def test_a_clip_without_a_face_is_told_in_one_sentence(settings: Any, tmp_path: Path) -> None:
    for number in range(3):
        shutil.copy(ROOT / "tests/data/clip/no_face.jpg", tmp_path / f"{number}.jpg")
    settings.path = str(tmp_path)
    assert bpy.ops.facewright.survey() == {"FINISHED"}
    assert [kind for kind, _ in checked(settings).findings] == ["no_face"]
    assert "No face was found in any of the 3 frames" in shown()


def test_thumbnails_are_square_with_the_face_in_the_middle_and_what_is_left_out_is_pale() -> None:
    thumbnails = module("scene.thumbnails")
    picture = np.zeros((40, 100, 3), np.uint8)
    picture[:, 70:90] = (200, 100, 50)
    cut = thumbnails.square(picture, (0.8, 0.5))
    assert cut.shape == (40, 40, 3) and cut[20, 20].tolist() == [200, 100, 50]
    assert thumbnails.square(picture, (1.0, 0.0)).shape == (40, 40, 3)
    used, out = (thumbnails.framed(cut, fate) for fate in (thumbnails.Fate.USED, thumbnails.Fate.LEFT_OUT))
    assert used[20, 20, :3] == pytest.approx(np.array([200, 100, 50]) / 255)
    assert np.ptp(out[20, 20, :3]) < 0.2 * np.ptp(used[20, 20, :3]) and used[0, 0, 1] > 0.6 > out[0, 0, 1]


def test_the_panel_of_the_clip_leads_to_the_choice_of_one(settings: Any) -> None:
    assert drawn("FACEWRIGHT_PT_clip") == ""
    assert not bpy.types.FACEWRIGHT_PT_frames.poll(SimpleNamespace(scene=bpy.context.scene))
