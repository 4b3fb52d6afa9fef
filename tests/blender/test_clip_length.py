"""How long the chosen clip is, before anything runs."""

import shutil
import subprocess
from pathlib import Path
from typing import Any

import bpy
import pytest
from conftest import ROOT
from tracking import drawn, module

FRAME = ROOT / "tests/data/clip/frames/frame_00.jpg"


@pytest.fixture
def settings() -> Any:
    return bpy.context.scene.facewright_clip


@pytest.fixture
def pictures(tmp_path: Path) -> Path:
    for number in range(12):
        shutil.copy(FRAME, tmp_path / f"frame_{number:02}.jpg")
    return tmp_path


def line(settings: Any) -> tuple[str, bool] | None:
    return module("reconstruct.actions").length_line(settings)


def test_a_folder_and_any_of_its_pictures_are_counted(settings: Any, pictures: Path) -> None:
    for path in (pictures, pictures / "frame_03.jpg"):
        settings.path = str(path)
        assert line(settings) == ("12 frames", True)
        assert (settings.first, settings.last) == (0, 11), "the part begins as all"
        assert "12 frames" in drawn("FACEWRIGHT_PT_clip")


def test_a_video_is_counted(settings: Any, pictures: Path) -> None:
    if shutil.which("ffmpeg") is None:
        pytest.skip("a video is made with ffmpeg")
    film = pictures / "film.mp4"
    made = ["ffmpeg", "-v", "error", "-framerate", "25", "-i", pictures / "frame_%02d.jpg", "-c:v", "mpeg4", film]
    subprocess.run(made, check=True)
    settings.path = str(film)
    assert line(settings) == ("12 frames", True)
    assert not bpy.data.movieclips, "nothing stays of counting"


def test_a_part_is_told_against_the_whole(settings: Any, pictures: Path) -> None:
    settings.path, settings.use_range = str(pictures), True
    settings.first, settings.last = 2, 250
    assert line(settings) == ("10 of 12 frames", True)
    settings.first = 40
    assert line(settings) == ("The clip has 12 frames, 0 to 11", False)


def test_a_part_that_was_chosen_stays_with_another_clip(settings: Any, pictures: Path) -> None:
    settings.use_range, settings.first, settings.last = True, 3, 7
    settings.path = str(pictures)
    assert (settings.first, settings.last) == (3, 7)
    assert line(settings) == ("5 of 12 frames", True)


def test_a_part_that_was_set_before_the_clip_stays(settings: Any, pictures: Path) -> None:
    settings.first, settings.last = 3, 7
    settings.path = str(pictures)
    settings.use_range = True
    assert line(settings) == ("5 of 12 frames", True)


def test_all_of_one_clip_becomes_all_of_another(settings: Any, pictures: Path) -> None:
    settings.path = str(pictures)
    shutil.copy(FRAME, pictures / "frame_12.jpg")
    settings.path = str(pictures / "frame_00.jpg")
    assert (settings.first, settings.last) == (0, 12)


def test_what_has_no_frames_is_said_before_a_run(settings: Any, tmp_path: Path) -> None:
    (tmp_path / "notes.txt").touch()
    (tmp_path / "broken.mp4").write_bytes(b"no film")
    for path in (tmp_path, tmp_path / "broken.mp4", tmp_path / "nowhere"):
        settings.path = str(path)
        said = line(settings)
        assert said is not None and not said[1] and said[0].startswith("No frames there")
        assert "No frames there" in drawn("FACEWRIGHT_PT_clip")


def test_a_clip_of_an_older_file_is_not_called_empty(settings: Any, pictures: Path) -> None:
    settings.path = str(pictures)
    settings.property_unset("frames")
    assert line(settings) is None
