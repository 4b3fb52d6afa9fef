"""Choosing a clip: a file browser, a drop, several pictures, the clips of before, paths relative to the file."""

import json
import os
import shutil
import warnings
from pathlib import Path
from typing import Any

import bpy
import pytest
from conftest import PACKAGE, ROOT
from tracking import module

FRAME = ROOT / "tests/data/clip/frames/frame_00.jpg"
NAMES = ["f1.jpg", "f2.jpg", "f9.jpg", "f10.jpg"]


@pytest.fixture(autouse=True)
def forgotten() -> None:
    """No clip was opened before."""
    (Path(bpy.utils.extension_path_user(PACKAGE, create=True)) / "recent_clips.json").unlink(missing_ok=True)


@pytest.fixture
def settings() -> Any:
    return bpy.context.scene.facewright_clip


@pytest.fixture
def pictures(tmp_path: Path) -> Path:
    folder = tmp_path / "pictures"
    folder.mkdir()
    for name in NAMES:
        shutil.copy(FRAME, folder / name)
    return folder


def opened(folder: Path, *names: str, **more: Any) -> set[str]:
    files = [{"name": name} for name in names]
    return bpy.ops.facewright.open_clip(directory=str(folder) + os.sep, files=files, **more)


def test_of_several_pictures_only_those_are_used_in_their_order(settings: Any, pictures: Path) -> None:
    assert opened(pictures, "f10.jpg", "f2.jpg") == {"FINISHED"}
    assert [picture.name for picture in settings.pictures] == ["f2.jpg", "f10.jpg"]
    assert (settings.frames, settings.first, settings.last) == (2, 0, 1)
    assert module("reconstruct.actions").length_line(settings) == ("2 pictures", True)
    source = module("scene.source")
    used = [Path(file).name for file in source.images(source.source_of(settings))]
    assert used == ["f2.jpg", "f10.jpg"]
    assert Path(bpy.path.abspath(settings.path)).parent == pictures


def test_a_path_that_is_set_means_all_pictures_again(settings: Any, pictures: Path) -> None:
    opened(pictures, "f10.jpg", "f2.jpg")
    settings.path = str(pictures / "f1.jpg")
    assert not settings.pictures and settings.frames == 4


def test_one_picture_stands_for_its_folder_and_a_folder_for_itself(settings: Any, pictures: Path) -> None:
    assert opened(pictures, "f2.jpg") == {"FINISHED"}
    assert (settings.path, settings.frames, len(settings.pictures)) == (str(pictures / "f2.jpg"), 4, 0)
    assert opened(pictures) == {"FINISHED"}
    assert (Path(settings.path), settings.frames) == (pictures, 4)


def test_chosen_pictures_and_their_relative_path_are_in_the_file(settings: Any, pictures: Path, tmp_path: Path) -> None:
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "file.blend"))
    assert opened(pictures, "f1.jpg", "f9.jpg", relative_path=True) == {"FINISHED"}
    bpy.ops.wm.save_mainfile()
    assert str(tmp_path).encode() not in bytes(str([settings.path, *(p.name for p in settings.pictures)]), "utf-8")
    moved = tmp_path / "moved"
    moved.mkdir()
    shutil.move(pictures, moved / "pictures")
    shutil.move(tmp_path / "file.blend", moved / "file.blend")
    bpy.ops.wm.open_mainfile(filepath=str(moved / "file.blend"))
    source = module("scene.source")
    used = source.images(source.source_of(bpy.context.scene.facewright_clip))
    assert used == [str(moved / "pictures" / name) for name in ("f1.jpg", "f9.jpg")] and Path(used[0]).exists()


def test_what_is_no_clip_is_refused_and_nothing_is_changed(settings: Any, pictures: Path) -> None:
    (pictures / "film.mp4").touch()
    (pictures / "notes.txt").touch()
    opened(pictures, "f1.jpg", "f2.jpg")
    for names, said in [
        (("film.mp4", "f1.jpg"), "one video, or pictures"),
        (("notes.txt", "f1.jpg"), "notes.txt is no video and no picture"),
        (("notes.txt",), "notes.txt is no video"),
    ]:
        with pytest.raises(RuntimeError, match=said):
            opened(pictures, *names)
        assert [picture.name for picture in settings.pictures] == ["f1.jpg", "f2.jpg"] and settings.frames == 2
    with pytest.raises(RuntimeError, match="choose a video"):
        bpy.ops.facewright.open_clip()


def test_files_can_be_dropped_by_their_kinds() -> None:
    handler = bpy.types.FACEWRIGHT_FH_clip
    assert handler.bl_import_operator == "facewright.open_clip"
    kinds = set(handler.bl_file_extensions.split(";"))
    assert {".mp4", ".mov", ".gif", ".jpg", ".png", ".webp"} <= kinds and all(kind[0] == "." for kind in kinds)


def test_the_clips_of_before_are_kept_for_the_user_and_in_no_file(settings: Any, pictures: Path) -> None:
    recent = module("scene.recent_clips")
    opened(pictures, "f1.jpg", "f9.jpg")
    opened(pictures)
    first = (str(pictures / "f1.jpg"), ("f1.jpg", "f9.jpg"))
    assert recent.recent() == [(str(pictures) + os.sep, ()), first]
    assert bpy.ops.facewright.open_recent_clip(number=1) == {"FINISHED"}
    assert [picture.name for picture in settings.pictures] == ["f1.jpg", "f9.jpg"]
    assert recent.recent()[0] == first, "the last one comes first, once"
    assert len(recent.recent()) == 2
    (pictures / "f1.jpg").unlink()
    assert [path for path, _ in recent.recent()] == [str(pictures) + os.sep], "what is gone is left out"


def test_at_most_ten_clips_are_kept_and_a_broken_list_is_none(tmp_path: Path) -> None:
    recent = module("scene.recent_clips")
    for number in range(14):
        (tmp_path / str(number)).mkdir()
        recent.remember(str(tmp_path / str(number)))
    assert [Path(path).name for path, _ in recent.recent()] == [str(number) for number in range(13, 3, -1)]
    file = Path(bpy.utils.extension_path_user(PACKAGE)) / "recent_clips.json"
    for text in ("", "{", "[3]", json.dumps([{"path": 5}])):
        file.write_text(text)
        assert recent.recent() == []


def test_paths_relative_to_the_file_give_no_warning(settings: Any, tmp_path: Path) -> None:
    scene = bpy.context.scene
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "file.blend"))
    shutil.copytree(FRAME.parent, tmp_path / "frames")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        settings.path = "//frames"
        settings.output = "//out"
        scene.facewright_rig.folders.add().path = "//frames"
        bpy.ops.facewright.open_clip(directory="//frames")
    assert settings.frames == 21


def test_all_paths_may_be_relative_to_the_file() -> None:
    if "is_path_supports_blend_relative" not in bpy.types.Property.bl_rna.properties:
        pytest.skip("this Blender does not ask")
    scene = bpy.context.scene
    groups = [scene.facewright_clip, scene.facewright_rig.folders.add()]
    operators = [getattr(bpy.ops.facewright, name).get_rna_type() for name in dir(bpy.ops.facewright)]
    paths = [
        (kind.identifier, prop.identifier, prop.is_path_supports_blend_relative)
        for kind in [*(group.bl_rna for group in groups), *operators]
        for prop in kind.properties
        if prop.type == "STRING" and prop.subtype in {"FILE_PATH", "DIR_PATH"}
    ]
    assert len(paths) >= 12 and [path for path in paths if not path[2]] == []
