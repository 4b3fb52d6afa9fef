"""`blender -b --command facewright reconstruct …`: the same operator, from a shell."""

import argparse
import sys
from typing import Any

import bpy

from .calibrate import actions as camera_actions
from .engine import FacewrightError
from .jobs import wait
from .reconstruct import actions
from .scene import head as scene_head

_handle: Any = None


def register() -> None:
    global _handle
    _handle = bpy.utils.register_cli_command("facewright", run)


def unregister() -> None:
    global _handle
    bpy.utils.unregister_cli_command(_handle)
    _handle = None


def parser() -> argparse.ArgumentParser:
    top = argparse.ArgumentParser(prog="blender -b --command facewright", description=__doc__)
    command = top.add_subparsers(dest="command", required=True).add_parser("reconstruct", help="reconstruct a head")
    command.add_argument("clip", help="a video, a folder of frames, or a frame of an image sequence")
    command.add_argument("-o", "--output", required=True, help="result folder")
    command.add_argument("--blend", help="save the scene with the head here")
    command.add_argument("--camera", help="camera.json of a calibrated camera")
    command.add_argument("--method", choices=["default", "paper"], default="default")
    command.add_argument("--texture-size", type=int, default=2048)
    command.add_argument("--interocular-mm", type=float)
    command.add_argument("--frames", type=span, help="first and last frame, counted from 0: 480-660")
    return top


def span(text: str) -> tuple[int, int]:
    """`480-660` as numbers."""
    first, dash, last = text.partition("-")
    if not (dash and first.isdigit() and last.isdigit()):
        raise argparse.ArgumentTypeError("two frame numbers like 480-660")
    return int(first), int(last)


def run(arguments: list[str]) -> int:
    """The exit code: 0 done, 1 a clear error, 2 usage."""
    try:
        wanted = parser().parse_args(arguments)
    except SystemExit as stop:
        return int(stop.code or 0)
    try:
        settings = actions.Settings(
            camera=camera_actions.read_camera(wanted.camera) if wanted.camera else None,
            method=wanted.method,
            texture_size=wanted.texture_size,
            interocular_mm=wanted.interocular_mm,
            output=wanted.output,
        )
        result = wait(actions.reconstructed(actions.Source(wanted.clip, wanted.frames), settings))
        result.write(wanted.output)
    except FacewrightError as error:
        print(f"facewright: {error}", file=sys.stderr)
        return 1
    if wanted.blend:
        scene_head.place(bpy.context.scene, result)
        bpy.ops.wm.save_as_mainfile(filepath=bpy.path.abspath(wanted.blend))
    print("\n".join([*actions.report_lines(result.report), *actions.warnings(result.report)]))
    return 0
