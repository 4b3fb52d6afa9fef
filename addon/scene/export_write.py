"""A copied head as a file of a format, by Blender's own exporters."""

import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import bpy

from ..engine import FacewrightError
from . import unkeyed
from .export_copy import Copy
from .export_glb import put_skinned_at_root

# Formats by their endings.
FORMATS = {
    ".glb": "glTF",
    ".fbx": "FBX",
    ".usd": "USD",
    ".usdc": "USD",
    ".usda": "USD",
    ".usdz": "USD",
    ".abc": "Alembic",
}
# An FBX file counts in centimetres: programs that do not read its unit take it for that.
SCALES = {"FBX": 100.0}
# Alembic has no shape keys: it gets the mesh of every frame.
EVALUATED = {"Alembic"}


def write(path: Path, copy: Copy, animated: bool) -> None:
    """Write a file whole or not at all: what stood there stays if the exporter fails."""
    writer = WRITERS[FORMATS[path.suffix.lower()]]
    try:
        folder = Path(tempfile.mkdtemp(prefix=".facewright-", dir=path.parent))
    except OSError as error:
        raise FacewrightError(f"{path} cannot be written: {error.strerror}") from error
    try:
        _run(path, lambda: writer(str(folder / path.name), copy, animated))
        if not (folder / path.name).is_file():
            raise FacewrightError(f"Blender wrote no {path.name}: see its console")
        _forget(folder, folder / path.name)
        _move(folder, path.parent)
    except OSError as error:
        raise FacewrightError(f"{path} cannot be written: {error.strerror}") from error
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _run(path: Path, writer: Callable[[], Any]) -> None:
    try:
        if writer() != {"FINISHED"}:
            raise FacewrightError(f"Blender could not write {path}: see its console")
    except RuntimeError as error:
        said = (str(error).strip().splitlines() or ["unknown"])[-1].removeprefix("Error: ")
        raise FacewrightError(f"Blender could not write {path}: {said}") from error


def _forget(folder: Path, file: Path) -> None:
    """Take the paths of this machine out of a file: where it was written, and the artist's own file.

    Texts in it have a length in front of them, so that what comes instead is as long.
    """
    content = written = file.read_bytes()
    for there in _spellings(f"{folder}{os.sep}"):
        content = content.replace(there, b"./" * (len(there) // 2) + b"/" * (len(there) % 2))
    for artists in _spellings(bpy.data.filepath):
        content = content.replace(artists, b"scene.blend"[: len(artists)].ljust(len(artists)))
    if content != written:
        file.write_bytes(content)


def _spellings(path: str) -> set[bytes]:
    """A path as exporters may write it: on Windows, some of them with slashes."""
    return {os.fsencode(spelled) for spelled in (path, path.replace(os.sep, "/")) if spelled}


def _move(source: Path, target: Path) -> None:
    """Move the files of a folder to another, pictures first."""
    files = [file for file in source.rglob("*") if file.is_file()]
    for file in sorted(files, key=lambda file: file.parent == source):
        place = target / file.relative_to(source)
        place.parent.mkdir(exist_ok=True)
        os.replace(file, place)


def check_exporter(kind: str) -> None:
    """Refuse a format whose exporter this Blender lacks: those of glTF and FBX are add-ons, Debian lacks others."""
    area, name = EXPORTERS[kind]
    if name not in dir(getattr(bpy.ops, area)):
        built_in = area == "wm"
        remedy = "export GLB or FBX" if built_in else f"turn on the {kind} add-on in the Preferences"
        raise FacewrightError(
            f"this Blender {'was built without its' if built_in else 'has no'} {kind} exporter: {remedy}"
        )


def _call(kind: str, **options: Any) -> set[str]:
    """Run an exporter with those options that this version of Blender has."""
    area, name = EXPORTERS[kind]
    exporter = getattr(getattr(bpy.ops, area), name)
    known = exporter.get_rna_type().properties.keys()
    return exporter(**{option: value for option, value in options.items() if option in known})


def _gltf(path: str, copy: Copy, animated: bool) -> set[str]:
    with _shown(copy.scene):
        _write_back(copy.scene)
        written = _call(
            "glTF",
            filepath=path,
            export_format="GLB",
            use_active_scene=True,
            export_animations=animated,
            export_animation_mode="SCENE",
            export_anim_scene_split_object=False,
            export_current_frame=not animated,
            # Without animation the pose is in the joints' places.
            export_rest_position_armature=animated,
            export_yup=True,
            check_existing=False,
        )
    if "FINISHED" in written:
        put_skinned_at_root(Path(path))
    return written


def _fbx(path: str, copy: Copy, animated: bool) -> set[str]:
    with _used(copy.scene):
        _write_back(copy.scene)
        return _call(
            "FBX",
            filepath=path,
            object_types={"MESH", "EMPTY", "ARMATURE"},
            add_leaf_bones=False,
            # The copy is in centimetres, and so says the file: no node needs a scale.
            apply_scale_options="FBX_SCALE_ALL",
            global_scale=0.01,
            axis_forward="-Z",
            axis_up="Y",
            mesh_smooth_type="FACE",
            bake_anim=animated,
            bake_anim_use_nla_strips=False,
            bake_anim_use_all_actions=False,
            bake_anim_simplify_factor=0.0,
            path_mode="COPY",
            embed_textures=True,
            check_existing=False,
        )


def _usd(path: str, copy: Copy, animated: bool) -> set[str]:
    with _used(copy.scene):
        return _call(
            "USD",
            filepath=path,
            # Values of shape keys are animation in USD, of one frame too.
            export_animation=True,
            export_shapekeys=True,
            export_armatures=True,
            export_uvmaps=True,
            export_normals=True,
            export_materials=True,
            generate_preview_surface=True,
            # Blender 4.3 and before; its later name.
            export_textures=True,
            export_textures_mode="NEW",
            overwrite_textures=True,
            relative_paths=True,
            convert_orientation=True,
            export_global_forward_selection="NEGATIVE_Z",
            export_global_up_selection="Y",
            export_custom_properties=False,
            author_blender_name=False,
            convert_world_material=False,
            check_existing=False,
        )


def _alembic(path: str, copy: Copy, animated: bool) -> set[str]:
    scene = copy.scene
    with _used(scene):
        return _call(
            "Alembic",
            filepath=path,
            start=scene.frame_start,
            end=scene.frame_end if animated else scene.frame_start,
            uvs=True,
            normals=True,
            face_sets=True,
            apply_subdiv=True,
            as_background_job=False,
            check_existing=False,
        )


def _write_back(scene: bpy.types.Scene) -> None:
    """Let evaluation write places into data, where exporters read them: it does once a context asked for the state."""
    bpy.context.evaluated_depsgraph_get()
    for obj in scene.objects:
        obj.update_tag()
    scene.view_layers[0].update()


EXPORTERS = {
    "glTF": ("export_scene", "gltf"),
    "FBX": ("export_scene", "fbx"),
    "USD": ("wm", "usd_export"),
    "Alembic": ("wm", "alembic_export"),
}
WRITERS = {"glTF": _gltf, "FBX": _fbx, "USD": _usd, "Alembic": _alembic}


def _used(scene: bpy.types.Scene) -> AbstractContextManager[Any]:
    """The scene as the one that operators work on."""
    return bpy.context.temp_override(scene=scene, view_layer=scene.view_layers[0])


@contextmanager
def _shown(scene: bpy.types.Scene) -> Iterator[None]:
    """The scene in the window, as the glTF exporter puts it there anyway; the artist's comes back."""
    window = bpy.context.window or next(iter(bpy.context.window_manager.windows), None)
    if window is None:
        raise FacewrightError("Blender's glTF exporter needs a window, and there is none: export another format")
    before, layer = window.scene, window.view_layer
    with unkeyed.kept():
        try:
            window.scene = scene
            with bpy.context.temp_override(window=window):
                yield
        finally:
            window.scene = before
            window.view_layer = layer
