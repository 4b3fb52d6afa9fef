"""Which pictures a clip in Blender stands for."""

import shutil
import subprocess
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from conftest import ROOT
from tracking import module

FRAME = ROOT / "tests/data/clip/frames/frame_00.jpg"


def folder_of(folder: Path, names: list[str]) -> Path:
    """The same picture under many names."""
    for name in names:
        shutil.copy(FRAME, folder / name)
    return folder


def track(path: Path, library: Any) -> list[str]:
    """The names of the pictures that *Track Face* hands to the library for a clip."""
    asked = library()
    clip = module("scene.footage").load(str(path))
    message = module("track.actions").place(clip, _tracked(clip))
    assert message.startswith("12 tracks in "), message
    return [Path(frame).name for frame in asked[0]["frames"]]


def _tracked(clip: bpy.types.MovieClip) -> Any:
    actions, jobs = module("track.actions"), module("jobs")
    return jobs.wait(actions.tracked(actions.shown(clip, bpy.context.scene), actions.Settings()))


def test_numbered_pictures_with_gaps_are_all_tracked(tmp_path: Path, library: Any) -> None:
    names = [f"shot_{number:03d}.jpg" for number in range(3, 93, 3)]
    assert track(folder_of(tmp_path, names), library) == names
    clip = bpy.data.movieclips[-1]
    face = clip.tracking.objects["Face"]
    frames = {mark.frame for track in face.tracks for mark in track.markers if not mark.mute}
    assert frames <= set(range(1, 89, 3)), "Blender's frames are the pictures' numbers, counted from the first"


@pytest.mark.parametrize(
    "names",
    [
        ["anna.jpg", "ben.jpg", "cleo.jpg", "dora.jpg", "emil.jpg", "fritz.jpg"],
        ["anna.jpg", "ben_2.jpg", "cleo_7.jpg", "dora.jpeg", "emil.jpg", "shot 7.jpg"],
        ["1.jpg", "2.jpeg", "3.jpg", "9.jpeg", "10.jpg", "12.jpg"],
    ],
)
def test_pictures_without_numbers_and_of_mixed_kinds_are_all_tracked(
    tmp_path: Path, library: Any, names: list[str]
) -> None:
    assert track(folder_of(tmp_path, names), library) == names


def test_a_folder_with_the_name_of_a_video_is_a_folder(tmp_path: Path, library: Any) -> None:
    folder = tmp_path / "clip.mp4"
    folder.mkdir()
    folder_of(folder, [f"shot_{number}.jpg" for number in range(1, 13)])
    footage = module("scene.footage")
    clip = footage.load(str(folder))
    assert len(footage.of_clip(clip).frames) == 12 and footage.shows(clip, str(folder))


def test_what_systems_put_beside_pictures_is_left_out(tmp_path: Path, library: Any) -> None:
    names = [f"shot_{number}.jpg" for number in range(1, 13)]
    folder_of(tmp_path, names)
    for other in ["._shot_1.jpg", "._shot_2.jpg", ".DS_Store", "Thumbs.db", "desktop.ini"]:
        (tmp_path / other).write_bytes(b"Mac OS X")
    assert track(tmp_path / "shot_1.jpg", library) == names
    footage = module("scene.footage")
    clip = footage.load(str(tmp_path))
    assert [Path(file).name for file in footage.clip_files(clip)] == names, "a folder begins with its first picture"


@pytest.mark.parametrize(("aspect", "width"), [("2/1", 128), ("1/1", 64), ("8/9", 57)])
def test_the_pixels_of_a_decoded_video_are_square(tmp_path: Path, aspect: str, width: int) -> None:
    ffmpeg, film = shutil.which("ffmpeg"), tmp_path / "film.mp4"
    if ffmpeg is None:
        pytest.skip("needs ffmpeg to make a film")
    bar = "color=black:s=64x48:r=5:d=1,drawbox=x=32:y=0:w=32:h=48:color=white:t=fill"
    made = [ffmpeg, "-nostdin", "-loglevel", "error", "-f", "lavfi", "-i", f"{bar},setsar={aspect}", "-c:v", "mpeg4"]
    subprocess.run([*made, str(film)], check=True)
    footage, video, jobs = module("scene.footage"), module("scene.video"), module("jobs")
    assert footage.of_clip(footage.load(str(film))).size == (width, 48)
    with jobs.wait(video.decode(str(film), [2])) as folder:
        image = bpy.data.images.load(str(Path(folder) / "frame_000002.bmp"))
        assert tuple(image.size) == (width, 48)
        row = np.array(image.pixels).reshape(48, width, -1)[24, :, 0]
    assert row[: width // 2 - 3].max() < 0.1 and row[width // 2 + 3 :].min() > 0.9, "the whole width is filled"


def test_other_sequences_of_a_folder_are_left_alone(tmp_path: Path, library: Any) -> None:
    folder_of(tmp_path, [f"left_{k}.jpg" for k in range(6)] + [f"right_{k}.jpg" for k in range(6)])
    assert track(tmp_path / "right_0.jpg", library) == [f"right_{k}.jpg" for k in range(6)]
