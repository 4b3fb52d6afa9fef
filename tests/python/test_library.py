"""The library's options, errors and signatures, as Python sees them; skipped where the wheel is not installed."""

import copy
import inspect
import pickle
import shutil
import signal
import subprocess
from pathlib import Path
from typing import Any

import pytest

facewright: Any = pytest.importorskip("facewright")

OPTIONS = [name for name in dir(facewright) if name.endswith("Options")]
FUNCTIONS = [name for name in facewright.__all__ if inspect.isbuiltin(getattr(facewright, name))]


@pytest.mark.parametrize("name", OPTIONS)
def test_options_tell_of_each_of_their_fields(name: str) -> None:
    made = getattr(facewright, name)
    fields = inspect.signature(made).parameters
    assert fields and all(field.kind is inspect.Parameter.KEYWORD_ONLY for field in fields.values())
    assert {field: getattr(made(), field) for field in fields} == {k: v.default for k, v in fields.items()}
    for field in fields:
        line = next(line for line in made.__doc__.splitlines() if line.strip().startswith(f"{field}:"))
        assert len(line.split(":", 1)[1].strip()) > 3, line
    assert set(fields) <= set(dir(made())) and repr(made()).startswith(f"{name}({next(iter(fields))}=")


@pytest.mark.parametrize("name", OPTIONS)
def test_options_are_copied_and_compared_by_their_fields(name: str) -> None:
    options = getattr(facewright, name)()
    assert copy.copy(options) == options == pickle.loads(pickle.dumps(options)) and options != 3
    with pytest.raises((AttributeError, TypeError)):
        options.anything = 1


def test_options_are_read_as_they_were_given() -> None:
    made = facewright.ReconstructOptions(texture_size=512, method="paper", lengths=[(1, 2, 63.5)], interocular_mm=60)
    assert (made.texture_size, made.method, made.lengths, made.interocular_mm) == (512, "paper", ((1, 2, 63.5),), 60.0)
    assert made.replace(method="default") != made and made.replace() == made
    assert facewright.TrackOptions(from_="frame_3").from_ == "frame_3"
    assert facewright.CalibrateOptions(inner=(8, 5), bend="always").inner == ((8, 5),)


@pytest.mark.parametrize(
    ("field", "value", "kind", "sentence"),
    [
        ("texture", 3, TypeError, "has no option texture: it has .*texture_size"),
        ("texture_size", "large", TypeError, "texture_size: invalid type"),
        ("texture_size", 12.5, TypeError, "texture_size: invalid type"),
        ("texture_size", -1, ValueError, "texture_size: invalid value"),
        ("method", "other", ValueError, "method: unknown variant `other`, expected `paper` or `default`"),
        ("lengths", [(1, 2)], (TypeError, ValueError), "lengths: "),
        ("lengths", [(1, 2, -3.0)], ValueError, "a measured length must be longer than 0 mm"),
        ("interocular_mm", 620.0, ValueError, "the distance between the eyes must be 40 to 90 mm"),
        ("interocular_mm", {}, TypeError, "dict is not a number"),
    ],
)
def test_an_option_that_cannot_be_is_refused(field: str, value: Any, kind: Any, sentence: str) -> None:
    with pytest.raises(kind, match=sentence):
        facewright.ReconstructOptions(**{field: value})


@pytest.mark.parametrize(
    ("options", "field", "value", "sentence"),
    [
        ("ReconstructOptions", "texture_size", 8, "the texture size must be 64 to 8192 pixels"),
        ("MotionOptions", "interocular_mm", 6.3, "the distance between the eyes must be 40 to 90 mm"),
        ("TrackOptions", "points", 3, "the number of points must be 8 to 5000"),
        ("TrackOptions", "window", 8, "the tracking window is 8 pixels: choose an odd number from 3 to 31"),
        ("MatchOptions", "points", 100000, "the number of points must be 8 to 5000"),
        ("MatchOptions", "window", 33, "the tracking window is 33 pixels"),
        ("MatchOptions", "epipolar_px", 0.0, "the distance from an epipolar line must be more than 0 pixels"),
        ("CalibrateOptions", "distortion_terms", 4, "the number of distortion terms must be 0 to 3"),
        ("SheetOptions", "dpi", 0.0, "the resolution must be more than 0 dots per inch"),
        ("BoardOptions", "square_mm", -1.0, "the board's square must be longer than 0 mm"),
    ],
)
def test_a_senseless_value_fails_where_it_is_written(options: str, field: str, value: Any, sentence: str) -> None:
    made = getattr(facewright, options)
    with pytest.raises(facewright.OptionError, match=sentence):
        made(**{field: value})
    with pytest.raises(facewright.OptionError, match=sentence):
        made().replace(**{field: value})


def test_functions_take_options_and_their_fields(tmp_path: Path) -> None:
    small = facewright.SheetOptions(inner=(5, 4), square_mm=20.0)
    facewright.save_board(tmp_path / "board.svg", options=small, mark=False)
    drawn = (tmp_path / "board.svg").read_text()
    assert "5x4 inner corners, squares of 20 mm" in drawn and "circle" not in drawn
    with pytest.raises(TypeError, match="SheetOptions has no option size"):
        facewright.save_board(tmp_path / "none.svg", size=3)
    with pytest.raises(TypeError):
        facewright.save_board(tmp_path / "none.svg", options=facewright.TrackOptions())
    assert not (tmp_path / "none.svg").exists()


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_says_what_it_does(name: str) -> None:
    function = getattr(facewright, name)
    assert function.__doc__ and function.__text_signature__ and inspect.signature(function)


def test_errors_are_told_apart(tmp_path: Path) -> None:
    with pytest.raises(facewright.OptionError) as wrong:
        facewright.save_board(tmp_path / "board.svg", inner=(30, 30), square_mm=200.0)
    assert wrong.value.kind == "board" and isinstance(wrong.value, ValueError)
    with pytest.raises(facewright.OutputError) as unwritten:
        facewright.save_board(tmp_path / "board.doc")
    assert unwritten.value.kind == "drawing"
    with pytest.raises(facewright.InputError) as unread:
        facewright.calibrate([tmp_path / "none.png"]).result()
    assert unread.value.kind == "read" and isinstance(unread.value, facewright.FacewrightError)
    with pytest.raises(facewright.InputError, match="camera.json"):
        facewright.undistort(["a.png"], tmp_path, camera="{}")


def test_assets_are_one_handle_and_missing_ones_are_told(tmp_path: Path) -> None:
    assets = facewright.Assets(tmp_path)
    assert str(assets.folder) == str(tmp_path)
    for given in (assets, tmp_path):
        with pytest.raises(facewright.SetupError) as missing:
            facewright.generic_head(given)
        assert missing.value.kind == "no_assets"


def test_a_job_tells_how_far_it_is(tmp_path: Path) -> None:
    job = facewright.calibrate([tmp_path])
    stage, fraction, left = job.progress()
    assert isinstance(stage, str) and 0.0 <= fraction <= 1.0 and (left is None or left >= 0.0)
    assert job.step() is None or 1 <= job.step()[0] <= job.step()[1]
    assert job.sketch() is None, "a camera has no shape"
    with pytest.raises(facewright.InputError, match="no pictures"):
        job.result()


def test_an_interrupt_cancels_a_job_while_its_result_is_waited_for(tmp_path: Path) -> None:
    film, ffmpeg = tmp_path / "film.mp4", shutil.which("ffmpeg")
    if ffmpeg is None or not hasattr(signal, "setitimer"):
        pytest.skip("needs ffmpeg to make a film, and a timer")
    make = [ffmpeg, "-nostdin", "-loglevel", "error", "-f", "lavfi", "-i", "testsrc2=s=1280x720:r=30:d=20"]
    subprocess.run([*make, "-c:v", "mpeg4", "-q:v", "31", str(film)], check=True)
    before = signal.signal(signal.SIGALRM, signal.default_int_handler)
    try:
        job = facewright.calibrate([film])
        signal.setitimer(signal.ITIMER_REAL, 0.5)
        with pytest.raises(KeyboardInterrupt):
            job.result()
    finally:
        signal.signal(signal.SIGALRM, before)
    assert job.progress()[1] < 1.0 and job.finished()


def test_some_frames_of_a_video_are_taken_by_their_numbers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    film, ffmpeg = tmp_path / "film.mp4", shutil.which("ffmpeg")
    if ffmpeg is None:
        pytest.skip("needs ffmpeg to make a film")
    make = [ffmpeg, "-nostdin", "-loglevel", "error", "-f", "lavfi", "-i", "color=gray:s=64x48:r=5:d=2,setsar=2/1"]
    subprocess.run([*make, "-c:v", "mpeg4", str(film)], check=True)
    assert facewright.video_size(film) == (128, 48)
    with pytest.raises(facewright.CameraError, match="the board was found in 0 of 3 pictures"):
        facewright.calibrate([film], numbers=[2, 4, 9]).result()
    with pytest.raises(facewright.OptionError, match="the numbers of the frames must be one or more, ascending"):
        facewright.calibrate([film], numbers=[4, 2]).result()
    with pytest.raises(facewright.InputError, match="it ends before frame 70"):
        facewright.calibrate([film], numbers=[70]).result()
    with pytest.raises(facewright.InputError, match=r"none.mp4 cannot be read"):
        facewright.video_size(tmp_path / "none.mp4")
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(facewright.SetupError, match="install ffmpeg"):
        facewright.video_size(film)


def test_a_command_line_becomes_files_and_options() -> None:
    line = ["reconstruct", "clip", "-o", "out", "--length", "1:2=63.5", "--tracks", "t.json", "--texture-size", "256"]
    command = facewright.parse_command(line)
    assert command.name == "reconstruct" and command.assets is None and not command.json
    expected = {"frames": ("clip",), "camera": None, "tracks": "t.json", "output": "out"}
    assert expected.items() <= command.files.items() and "options" not in command.files
    assert command.options == facewright.ReconstructOptions(texture_size=256, lengths=[(1, 2, 63.5)])
    assert facewright.parse_command(["calibrate", "a", "--tangential"]).options.tangential
    assert facewright.parse_command(["overlay", "out", "clip", "-o", "x"]).options is None


def test_wrong_usage_and_help_have_their_exit_codes() -> None:
    with pytest.raises(facewright.UsageError, match="blender --command") as wrong:
        facewright.parse_command(["track"], program="blender --command facewright")
    assert wrong.value.exit_code == 2
    with pytest.raises(facewright.UsageError, match="Tracks points") as asked:
        facewright.parse_command(["track", "--help"])
    assert asked.value.exit_code == 0


def test_the_program_runs(tmp_path: Path) -> None:
    board = tmp_path / "board.pdf"
    assert facewright.run(["board", "-o", str(board), "--quiet"]) == 0 and board.exists()
    assert facewright.run(["calibrate", str(tmp_path), "--quiet", "-o", str(tmp_path / "camera.json")]) == 1
    assert facewright.run(["board", "--inner", "1x1"]) == 2
    assert not (tmp_path / "camera.json").exists()


def test_pictures_of_a_folder_are_in_their_natural_order_without_hidden_ones(tmp_path: Path) -> None:
    for name in ["f10.png", "f9.png", "._f9.png", "notes.txt"]:
        (tmp_path / name).touch()
    assert [picture.name for picture in facewright.pictures_in(tmp_path)] == ["f9.png", "f10.png"]
    with pytest.raises(facewright.FacewrightError):
        facewright.pictures_in(tmp_path / "none")
