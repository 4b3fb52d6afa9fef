"""Every test starts in an empty scene with the extension installed from its zip, as a user would."""

import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import bpy
import pytest

PACKAGE = "bl_ext.user_default.facewright"
ROOT = Path(os.environ["FACEWRIGHT_ROOT"])


def pytest_sessionstart() -> None:
    resources = Path(os.environ["BLENDER_USER_RESOURCES"])
    shutil.rmtree(resources / "extensions", ignore_errors=True)
    result = bpy.ops.extensions.package_install_files(
        filepath=os.environ["FACEWRIGHT_ZIP"], repo="user_default", enable_on_install=True, overwrite=True
    )
    assert result == {"FINISHED"}


@pytest.fixture(autouse=True)
def empty_scene() -> Iterator[None]:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
    yield


@pytest.fixture
def addon() -> ModuleType:
    import importlib

    return importlib.import_module(PACKAGE)


@pytest.fixture
def scene_head() -> ModuleType:
    import importlib

    return importlib.import_module(f"{PACKAGE}.scene.head")


@pytest.fixture
def heads() -> ModuleType:
    import importlib

    return importlib.import_module(f"{PACKAGE}.scene.heads")


@pytest.fixture
def engine() -> ModuleType:
    import importlib

    return importlib.import_module(f"{PACKAGE}.engine")


@pytest.fixture
def generic_face(scene_head: ModuleType, engine: ModuleType) -> bpy.types.Object:
    """The generic head in the scene."""
    return scene_head.place(bpy.context.scene, engine.generic_head())


@pytest.fixture
def clips(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> SimpleNamespace:
    """A clip of each of two people whom the library then knows."""
    from people import ANNA, BEN, clip_of, library

    library(monkeypatch)
    return SimpleNamespace(anna=clip_of(tmp_path, ANNA), ben=clip_of(tmp_path, BEN))


@pytest.fixture
def grown(monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """From then on, Anna's clip shows her a little older."""
    from people import BEN, OLDER_ANNA, library

    return lambda: library(monkeypatch, (OLDER_ANNA, BEN))


@pytest.fixture
def clip() -> bpy.types.MovieClip:
    """The synthetic person's frames."""
    return bpy.data.movieclips.load(str(ROOT / "tests/data/clip/frames/frame_00.jpg"))


@pytest.fixture
def tracked(clip: bpy.types.MovieClip) -> bpy.types.MovieClip:
    """The same with made-up tracks."""
    from tracking import made_up, place

    place(clip, made_up())
    return clip


@pytest.fixture
def library(monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[dict[str, Any]]]:
    """Lets the library's tracking give made-up tracks of the frames it is asked for; tells what it was asked."""
    from tracking import Finished, made_up, module, parsed

    def install(fails: Exception | None = None, **more: Any) -> list[dict[str, Any]]:
        asked: list[dict[str, Any]] = []

        def track(frames: list[str], **settings: Any) -> Finished:
            asked.append({"frames": frames} | settings)
            numbers = settings.get("numbers")
            names = [f"frame_{k:06d}" for k in numbers] if numbers else [Path(frame).stem for frame in frames]
            return Finished(parsed(made_up(names=names, **more)), fails)

        monkeypatch.setattr(module("track.actions"), "track", track)
        return asked

    return install


def snapshot() -> dict[str, int]:
    """How much of each kind of data there is: what a failed or cancelled operator must not change."""
    kinds = (
        "objects",
        "meshes",
        "cameras",
        "materials",
        "collections",
        "scenes",
        "shape_keys",
        "actions",
        "movieclips",
    )
    counts = {name: len(getattr(bpy.data, name)) for name in kinds}
    # Blender keeps one "Render Result" once anything was rendered; it is never saved.
    counts["images"] = sum(image.type != "RENDER_RESULT" for image in bpy.data.images)
    faces = [face for clip in bpy.data.movieclips for face in clip.tracking.objects]
    tracks = [track for face in faces for track in face.tracks]
    counts |= {"tracking objects": len(faces), "tracks": len(tracks)}
    counts |= {"markers": sum(len(track.markers) for track in tracks)}
    return counts | {"clip properties": sum(len(clip.keys()) for clip in bpy.data.movieclips)}
