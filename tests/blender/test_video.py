"""Videos: decoded by the library as Blender would, by Blender where there is no ffmpeg; the bar, Esc, no face."""

import ctypes
import json
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from conftest import snapshot
from numpy.typing import NDArray
from tracking import Finished, module

# Frame n of a film is of the level 30 + 2 n.
LEVELS = "color=black:s=64x48:r=30:d=3,geq=lum='30+2*N':cb=128:cr=128"
# Frames are left out, and the others come late by 0, 13 and 26 ms in turn.
UNSTEADY = f"{LEVELS},select='lt(mod(n\\,7)\\,4)+lt(n\\,20)',settb=1/3000,setpts='PTS+40*mod(N\\,3)'"
# A clock of 90 kHz whose ticks jitter about those of the rate.
JITTER = f"{LEVELS},settb=1/90000,setpts='N*3003+mod(N*37\\,11)*60'"
# Four colours, which move to the side.
COLOURS = (
    "color=0xc02040:s=96x64:r=10:d=1,drawbox=x=48:y=0:w=48:h=32:color=0x20a050:t=fill,"
    "drawbox=x=0:y=32:w=48:h=32:color=0x3040c0:t=fill,drawbox=x=48:y=32:w=48:h=32:color=0xe0d0b0:t=fill"
)
H264 = ["-c:v", "libx264", "-qp", "4", "-pix_fmt", "yuv420p"]
MATRIX = "scale=out_color_matrix={0}:out_range=tv,setparams=colorspace={0}:range=tv"
FILMS = {
    "steady.mp4": (LEVELS, H264),
    "steady.mkv": (LEVELS, H264),
    "steady.avi": (LEVELS, ["-c:v", "mjpeg", "-q:v", "1"]),
    "steady.ts": (LEVELS, ["-c:v", "mpeg2video", "-q:v", "2"]),
    "unsteady.mp4": (UNSTEADY, [*H264, "-enc_time_base", "1:90000"]),
    "unsteady.mkv": (UNSTEADY, H264),
    "jitter.mp4": (JITTER, [*H264, "-enc_time_base", "1:90000"]),
    "bt601.mp4": (f"{COLOURS},{MATRIX.format('smpte170m')}", H264),
    "bt709.mp4": (f"{COLOURS},{MATRIX.format('bt709')}", H264),
    "full_range.mp4": (f"{COLOURS},scale=out_range=pc,setparams=range=pc", [*H264[:-1], "yuvj420p"]),
    "wide_pixels.mp4": (f"{COLOURS},setsar=3/2", H264),
    "turned.mp4": (COLOURS, H264),
}


def ffmpeg(source: str, path: Path, options: list[str]) -> None:
    program = shutil.which("ffmpeg")
    if program is None:
        pytest.skip("needs ffmpeg to make a film")
    command = [program, "-nostdin", "-loglevel", "error", "-f", "lavfi", "-i", source, "-fps_mode", "passthrough"]
    subprocess.run([*command, *options, str(path)], check=True)


def film(folder: Path, name: str) -> Path:
    path, (source, options) = folder / name, FILMS[name]
    ffmpeg(source, path, options)
    if name == "turned.mp4":
        turn(path)
    return path


def turn(path: Path) -> None:
    """Let a film say that it is shown turned by 90°, as a phone's does."""
    content = bytearray(path.read_bytes())
    # The matrix of the track's header, 44 bytes after its name.
    at = content.index(b"tkhd") + 44
    height = struct.unpack(">I", content[at + 40 : at + 44])[0]
    content[at : at + 36] = struct.pack(">9i", 0, 1 << 16, 0, -(1 << 16), 0, 0, height, 0, 1 << 30)
    path.write_bytes(content)


@pytest.fixture
def no_ffmpeg(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[[], None]:
    """From then on there is no ffmpeg."""
    (tmp_path / "empty").mkdir()
    return lambda: monkeypatch.setenv("PATH", str(tmp_path / "empty"))


def by_library(path: Path, numbers: list[int], out: Path) -> dict[str, NDArray[np.int64]]:
    """The frames of a film as the library decodes them: brought through a camera without distortion."""
    import facewright

    width, height = facewright.video_size(path)
    camera = {"width": width, "height": height, "fx": 100.0, "fy": 100.0, "cx": width / 2, "cy": height / 2}
    facewright.undistort([path], out, camera=json.dumps(camera), numbers=numbers).result()
    return {file.stem: pixels(file) for file in sorted(out.glob("*.png"))}


def by_blender(path: Path, numbers: list[int]) -> dict[str, NDArray[np.int64]]:
    with module("jobs").wait(module("scene.video").decode(str(path), numbers)) as folder:
        return {file.stem: pixels(file) for file in sorted(Path(folder).iterdir())}


def pixels(path: Path) -> NDArray[np.int64]:
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    found = np.array(image.pixels).reshape(image.size[1], image.size[0], -1)[:, :, :3]
    bpy.data.images.remove(image)
    return np.rint(255.0 * found).astype(np.int64)


@pytest.mark.parametrize("name", FILMS)
def test_the_library_decodes_the_pictures_that_blender_shows(tmp_path: Path, name: str) -> None:
    path = film(tmp_path, name)
    video = module("scene.video")
    count = video.frame_count(str(path))
    numbers = [0, *range(2, count - 1, 3), count - 1]
    assert video.is_decoded_by_library(str(path))
    mine, blenders = by_library(path, numbers, tmp_path / "out"), by_blender(path, numbers)
    assert list(mine) == list(blenders) == [video.frame_name(number) for number in numbers]
    # Where pixels are made square, each has its own way with the edges of colours.
    share = 0.9 if name == "wide_pixels.mp4" else 1.0
    for frame, picture in mine.items():
        assert picture.shape == blenders[frame].shape
        # Both round to levels on the way; those of neighbours in time differ by 2.3.
        assert np.quantile(abs(picture - blenders[frame]), share) <= 3, frame
        assert abs(picture.mean() - blenders[frame].mean()) < 1.5, frame


def test_a_film_whose_pixels_the_library_takes_for_others_is_decoded_by_blender(tmp_path: Path) -> None:
    source, options = FILMS["wide_pixels.mp4"]
    ffmpeg(source, tmp_path / "wide_pixels.mkv", options)
    video = module("scene.video")
    assert not video.is_decoded_by_library(str(tmp_path / "wide_pixels.mkv")), "Blender's clip has square ones there"
    frames = module("jobs").wait(video.opened(str(tmp_path / "wide_pixels.mkv"), [1, 2]))
    with frames:
        assert frames.numbers is None and [Path(path).stem for path in frames.paths] == ["frame_000001", "frame_000002"]
        assert pixels(Path(frames.paths[0])).shape == (64, 96, 3)


def test_a_video_that_the_library_decodes_leaves_no_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = film(tmp_path, "steady.mp4")
    (tmp_path / "temporary").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "temporary"))
    frames = module("jobs").wait(module("scene.video").opened(str(path), range(3, 9)))
    assert frames.paths == [str(path)] and frames.numbers == [3, 4, 5, 6, 7, 8]
    by_library(path, frames.numbers, tmp_path / "out")
    assert not list((tmp_path / "temporary").iterdir())


def test_without_ffmpeg_blender_decodes_and_says_nothing(
    tmp_path: Path, no_ffmpeg: Callable[[], None], capfd: pytest.CaptureFixture[str]
) -> None:
    path = film(tmp_path, "steady.mp4")
    no_ffmpeg()
    before = snapshot()
    capfd.readouterr()
    # Kept back by C, as it goes to no terminal.
    ctypes.CDLL("ucrtbase" if sys.platform == "win32" else None).printf(b"said before\n")
    with module("jobs").wait(module("scene.video").opened(str(path), range(5, 8))) as frames:
        assert capfd.readouterr().out == "said before\n"
        levels = [pixels(Path(file)).mean() for file in frames.paths]
        assert [Path(file).stem for file in frames.paths] == ["frame_000005", "frame_000006", "frame_000007"]
    print("heard again", flush=True)
    assert capfd.readouterr().out == "heard again\n"
    assert np.diff(levels) == pytest.approx(2 * 255 / 219, abs=1.1)
    assert not any(Path(file).exists() for file in frames.paths) and snapshot() == before


@pytest.mark.parametrize("is_there", [True, False])
def test_decoding_is_part_of_the_one_bar(tmp_path: Path, no_ffmpeg: Callable[[], None], is_there: bool) -> None:
    ffmpeg("testsrc2=s=640x360:r=50:d=6", tmp_path / "film.mp4", [*H264[:2], "-preset", "ultrafast"])
    if not is_there:
        no_ffmpeg()
    actions, last = module("reconstruct.actions"), -1.0
    seen: dict[str, list[float]] = {}
    with pytest.raises(module("engine").FacewrightError, match="no face was found in any of the 200 frames"):
        work = actions.reconstructed(actions.Source(str(tmp_path / "film.mp4"), (90, 289)), actions.Settings())
        while True:
            progress = next(work)
            assert progress.fraction >= last, "the bar falls"
            last = progress.fraction
            seen.setdefault(progress.stage, []).append(last)
            time.sleep(0.001)
    assert len(set(seen["decode"])) >= 3 and max(seen["decode"]) < 0.3
    # Blender's frames are looked at as they are decoded.
    assert min(seen.get("faces", [1.0])) >= max(seen["decode"]) and is_there == ("faces" in seen)


@pytest.mark.parametrize("command", ["reconstruct", "track"])
@pytest.mark.parametrize("is_there", [True, False])
def test_cancelled_at_any_moment_decoding_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, no_ffmpeg: Callable[[], None], command: str, is_there: bool
) -> None:
    path = tmp_path / "film.mp4"
    ffmpeg("testsrc2=s=640x360:r=50:d=10", path, [*H264[:2], "-preset", "ultrafast"])
    if not is_there:
        no_ffmpeg()
    (tmp_path / "temporary").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "temporary"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    clip = bpy.data.movieclips.load(str(path))
    before = snapshot()
    for moment in (0.0, 0.1, 0.3):
        work = started(command, clip)
        until = time.monotonic() + moment
        while next(work)[0] != "decode" or time.monotonic() < until:
            time.sleep(0.002)
        began = time.monotonic()
        work.close()
        assert time.monotonic() - began < 1.0, "Esc takes too long"
        assert not list((tmp_path / "temporary").iterdir()) and not children() and snapshot() == before


def started(command: str, clip: bpy.types.MovieClip) -> Any:
    if command == "track":
        actions = module("track.actions")
        return actions.tracked(module("scene.footage").of_clip(clip), actions.Settings())
    actions = module("reconstruct.actions")
    return actions.reconstructed(actions.Source(clip.filepath), actions.Settings())


def children() -> list[str]:
    """What this process has started and not ended, where the system tells."""
    found = []
    for place in Path("/proc").glob("[0-9]*/stat"):
        try:
            name, _, rest = place.read_text().partition("(")[2].rpartition(")")
        except OSError:
            continue
        if int(rest.split()[1]) == os.getpid() and name == "ffmpeg":
            found.append(name)
    return found


@pytest.mark.parametrize("command", ["reconstruct", "track"])
def test_a_long_film_without_a_face_is_refused_before_it_is_kept(tmp_path: Path, command: str) -> None:
    path = tmp_path / "film.mp4"
    ffmpeg("testsrc2=s=320x240:r=50:d=26", path, [*H264[:2], "-preset", "ultrafast"])
    work, stages, began = started(command, bpy.data.movieclips.load(str(path))), set(), time.process_time()
    with pytest.raises(module("engine").FacewrightError, match="no face was found in any of the 1300 frames: film"):
        while True:
            stages.add(next(work)[0])
            time.sleep(0.01)
    assert stages <= {"", "faces"}, "nothing is decoded but what is looked at"
    taken = time.process_time() - began
    print(f"1300 frames refused in {taken:.1f} s of work")
    assert taken < 30.0


def test_without_ffmpeg_a_film_without_a_face_is_refused_by_some_of_its_frames(
    tmp_path: Path, no_ffmpeg: Callable[[], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "film.mp4"
    ffmpeg("testsrc2=s=64x48:r=50:d=15", path, [*H264[:2], "-preset", "ultrafast"])
    no_ffmpeg()
    video, decoded = module("scene.video"), []
    write = video._write
    monkeypatch.setattr(video, "_write", lambda scene, n, folder: (decoded.append(n), write(scene, n, folder)))
    clip = bpy.data.movieclips.load(str(path))
    before = snapshot()
    with pytest.raises(module("engine").FacewrightError, match="no face was found in any of the 750 frames: film"):
        module("jobs").wait(started("reconstruct", clip))
    assert decoded == list(range(0, 750, 6)), "no more than the library would glance at"
    assert snapshot() == before


def test_without_ffmpeg_frames_are_decoded_once_though_a_face_is_sought_first(
    tmp_path: Path, no_ffmpeg: Callable[[], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "film.mp4"
    ffmpeg("testsrc2=s=64x48:r=50:d=4", path, [*H264[:2], "-preset", "ultrafast"])
    no_ffmpeg()
    video, decoded, asked = module("scene.video"), [], []
    write = video._write
    monkeypatch.setattr(video, "_write", lambda scene, n, folder: (decoded.append(n), write(scene, n, folder)))

    def check_face(pictures: list[str], frames: int) -> Finished:
        asked.append((pictures, frames))
        is_any = any(picture.endswith("frame_000040.bmp") for picture in pictures)
        return Finished(fails=None if is_any else error)

    error = module("engine").FacewrightError("no face")
    error.kind = "no_face"
    monkeypatch.setattr(video, "check_face", check_face)
    with module("jobs").wait(video.opened(str(path), range(4, 200), of_face=True)) as frames:
        assert [Path(file).stem for file in frames.paths] == [video.frame_name(number) for number in range(4, 200)]
    assert sorted(decoded) == list(range(4, 200)) and decoded[:49] == [*range(4, 100, 2), 5]
    assert [count for _, count in asked] == [196, 196]
