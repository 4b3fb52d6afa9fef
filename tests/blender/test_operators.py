"""Operators: registration, bad input, cancelling, the shell command, video frames."""

import importlib
import subprocess
from pathlib import Path
from types import ModuleType, SimpleNamespace

import bpy
import numpy as np
import pytest
from conftest import PACKAGE, ROOT, snapshot


def message(error: pytest.ExceptionInfo[RuntimeError]) -> str:
    return str(error.value)


def test_registering_can_be_undone_and_done_again(addon: ModuleType) -> None:
    addon.unregister()
    assert not hasattr(bpy.types.Scene, "facewright_clip")
    addon.register()
    assert hasattr(bpy.types.Scene, "facewright_clip")


def test_without_a_clip_the_button_is_grey(addon: ModuleType) -> None:
    assert not bpy.ops.facewright.reconstruct.poll()
    assert not bpy.ops.facewright.expression.poll()


@pytest.mark.parametrize(
    ("name", "sentence"),
    [("missing.mp4", "does not exist"), ("empty", "holds no frames"), ("broken.mp4", "cannot be read as a video")],
)
def test_a_bad_clip_gets_a_sentence_and_changes_nothing(tmp_path: Path, name: str, sentence: str) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "broken.mp4").write_bytes(b"no video")
    bpy.context.scene.facewright_clip.path = str(tmp_path / name)
    before = snapshot()
    with pytest.raises(RuntimeError) as error:
        bpy.ops.facewright.reconstruct()
    assert sentence in message(error)
    assert snapshot() == before


def test_frames_without_a_face_get_a_sentence_and_change_nothing(tmp_path: Path) -> None:
    for i in range(3):
        picture = bpy.data.images.new("grey", 64, 64)
        picture.filepath_raw, picture.file_format = str(tmp_path / f"{i}.png"), "PNG"
        picture.save()
        bpy.data.images.remove(picture)
    bpy.context.scene.facewright_clip.path = str(tmp_path)
    before = snapshot()
    with pytest.raises(RuntimeError) as error:
        bpy.ops.facewright.reconstruct()
    assert "no face was found" in message(error)
    assert snapshot() == before


def test_a_file_that_is_no_camera_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "camera.json"
    path.write_text('{"width": 3}')
    with pytest.raises(RuntimeError) as error:
        bpy.ops.facewright.open_camera(filepath=str(path))
    assert "cannot be read: it has no height" in message(error)
    assert bpy.context.scene.facewright_camera.text == ""


def test_closing_the_work_cancels_the_native_job(tmp_path: Path) -> None:
    actions = importlib.import_module(f"{PACKAGE}.reconstruct.actions")
    for i in range(40):
        picture = bpy.data.images.new("grey", 640, 480)
        picture.filepath_raw, picture.file_format = str(tmp_path / f"{i:02}.png"), "PNG"
        picture.save()
        bpy.data.images.remove(picture)
    work = actions.reconstructed(actions.Source(str(tmp_path)), actions.Settings())
    next(work)
    work.close()
    with pytest.raises(StopIteration):
        next(work)


@pytest.mark.parametrize(("kind", "begin"), [("svg", b"<svg"), ("pdf", b"%PDF"), ("png", b"\x89PNG")])
def test_a_board_can_be_saved(tmp_path: Path, kind: str, begin: bytes) -> None:
    path = tmp_path / f"board.{kind}"
    assert bpy.ops.facewright.save_board(filepath=str(path)) == {"FINISHED"}
    assert path.read_bytes().startswith(begin)


def test_a_board_of_another_kind_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError) as error:
        bpy.ops.facewright.save_board(filepath=str(tmp_path / "board.txt"))
    assert ".svg, .pdf or .png" in message(error)
    assert not list(tmp_path.iterdir())


def numbered_clip(path: Path, frames: int) -> None:
    """A video whose grey level tells the frame's number."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 64, 64
    scene.render.resolution_percentage = 100
    scene.frame_start, scene.frame_end = 1, frames
    scene.view_settings.view_transform = "Standard"
    editor = scene.sequence_editor_create()
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences
    length = {"frame_end": frames + 1} if bpy.app.version < (5, 0, 0) else {"length": frames}
    strip = strips.new_effect("level", "COLOR", 1, 1, **length)
    for number in range(frames):
        strip.color = (number / frames,) * 3
        strip.keyframe_insert("color", frame=number + 1)
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "VIDEO"
    settings.file_format = "FFMPEG"
    scene.render.ffmpeg.format, scene.render.ffmpeg.codec = "MPEG4", "H264"
    scene.render.ffmpeg.constant_rate_factor = "PERC_LOSSLESS"
    scene.render.filepath = str(path)
    bpy.ops.render.render(animation=True)


def test_video_frames_have_their_numbers(tmp_path: Path) -> None:
    video = importlib.import_module(f"{PACKAGE}.scene.video")
    jobs = importlib.import_module(f"{PACKAGE}.jobs")
    clip = tmp_path / "clip.mp4"
    numbered_clip(clip, 24)
    bpy.ops.wm.read_homefile(use_empty=True)
    before = snapshot()
    assert video.frame_count(str(clip)) == 24
    with jobs.wait(video.decode(str(clip), [3, 9, 20])) as folder:
        names = sorted(p.name for p in Path(folder).iterdir())
        assert names == ["frame_000003.bmp", "frame_000009.bmp", "frame_000020.bmp"]
        levels = [level(Path(folder) / name) for name in names]
    steps = np.diff(levels) / np.array([6, 11])
    assert steps[0] == pytest.approx(steps[1], rel=0.35) and steps[0] > 0.01
    assert snapshot() == before, "the artist's data is as it was"


def level(path: Path) -> float:
    picture = bpy.data.images.load(str(path))
    picture.colorspace_settings.name = "Non-Color"
    values = np.empty(picture.size[0] * picture.size[1] * 4, np.float32)
    picture.pixels.foreach_get(values)
    bpy.data.images.remove(picture)
    return float(values.reshape(-1, 4)[:, 0].mean())


def test_the_shell_command_knows_its_arguments(addon: ModuleType, tmp_path: Path) -> None:
    cli = importlib.import_module(f"{PACKAGE}.cli")
    assert cli.run(["reconstruct"]) == 2
    assert cli.run(["reconstruct", str(tmp_path / "none.mp4"), "-o", str(tmp_path / "out")]) == 1
    assert not (tmp_path / "out").exists()
    wanted, rest = cli.own_arguments("reconstruct").parse_known_args(["clip.mp4", "-o", "out", "--frames", "480-660"])
    assert wanted.frames == (480, 660) and rest == ["clip.mp4", "-o", "out"]
    assert cli.run(["reconstruct", "--help"]) == 0 and cli.run(["--version"]) == 0
    out = tmp_path / "board.svg"
    assert cli.run(["board", "--inner", "8x5", "-o", str(out)]) == 0 and out.exists()


def test_the_shell_command_takes_every_option_of_the_program(
    addon: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cli, asked = importlib.import_module(f"{PACKAGE}.cli"), []
    actions = importlib.import_module(f"{PACKAGE}.reconstruct.actions")
    monkeypatch.setattr(actions, "reconstructed", lambda source, settings: asked.append(settings) or iter(()))
    monkeypatch.setattr(cli, "Tracks", SimpleNamespace(read=lambda path: f"what {path} holds"))
    line = ["reconstruct", str(tmp_path), "-o", str(tmp_path / "out"), "--tracks", "t.json", "--texture-size", "256"]
    more = ["--length", "1:2=63.5", "--length", "3-4=20", "--interocular-mm", "61", "--method", "paper"]
    with pytest.raises(AttributeError):
        cli.run(line + more)
    (settings,) = asked
    assert settings.options.lengths == ((1, 2, 63.5), (3, 4, 20.0)) and settings.options.interocular_mm == 61.0
    assert settings.options.texture_size == 256 and settings.options.method == "paper"
    assert settings.tracks == "what t.json holds" and settings.motion is None


def test_of_several_faces_a_pixel_chooses_one_while_that_is_switched_on(addon: ModuleType) -> None:
    actions, clip = importlib.import_module(f"{PACKAGE}.reconstruct.actions"), bpy.context.scene.facewright_clip
    clip.face = (320.0, 180.5)
    assert actions.options_of(clip).face is None
    clip.use_face = True
    assert actions.options_of(clip).face == (320.0, 180.5)


CLIP = ROOT / "tests/data/clip"


@pytest.mark.skipif(not CLIP.is_dir(), reason="tests/data/clip is not there")
def test_the_synthetic_person_is_reconstructed(tmp_path: Path) -> None:
    bpy.context.scene.facewright_clip.path = str(CLIP / "frames")
    bpy.context.scene.facewright_clip.texture_size = "1024"
    assert bpy.ops.facewright.reconstruct(output=str(tmp_path / "out")) == {"FINISHED"}
    face = bpy.context.object
    assert face.name == "Face" and len(face.data.shape_keys.key_blocks) == 68
    assert (tmp_path / "out/head.glb").stat().st_size > 100_000
    objects = set(bpy.data.objects)
    assert bpy.ops.facewright.reconstruct() == {"FINISHED"}
    assert set(bpy.data.objects) == objects
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "face.blend"))
    assert (
        str(tmp_path)
        not in subprocess.run(
            ["strings", "-n", "8", str(tmp_path / "out/report.json")], capture_output=True, text=True, check=True
        ).stdout
    )
