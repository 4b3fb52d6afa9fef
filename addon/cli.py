"""`blender -b --command facewright reconstruct …`, and `calibrate`, `track`, `motion`: the same work, from a shell."""

import argparse
import sys
from pathlib import Path
from typing import Any

import bpy

from .calibrate import actions as camera_actions
from .engine import FacewrightError, check_folder
from .jobs import wait
from .motion import actions as motion_actions
from .reconstruct import actions
from .scene import footage
from .track import actions as track_actions

# How a motion is shown.
KINDS = {"camera": "CAMERA", "head": "HEAD", "cameras": "CAMERAS"}

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
    commands = top.add_subparsers(dest="command", required=True)
    reconstruct_arguments(commands.add_parser("reconstruct", help="reconstruct a head"))
    calibrate_arguments(commands.add_parser("calibrate", help="calibrate a camera from pictures of a printed board"))
    track_arguments(commands.add_parser("track", help="track points of a face through a clip"))
    motion_arguments(commands.add_parser("motion", help="find how the camera moves about a tracked face"))
    return top


def reconstruct_arguments(command: argparse.ArgumentParser) -> None:
    command.add_argument("clip", help="a video, a folder of frames, or a frame of an image sequence")
    command.add_argument("-o", "--output", required=True, help="result folder")
    command.add_argument("--blend", help="save the scene with the head here")
    command.add_argument("--camera", help="camera.json of a calibrated camera")
    command.add_argument("--method", choices=["default", "paper"], default="default")
    command.add_argument("--texture-size", type=int, default=2048)
    command.add_argument("--interocular-mm", type=float)
    command.add_argument("--frames", type=span, help="first and last frame, counted from 0: 480-660")


def calibrate_arguments(command: argparse.ArgumentParser) -> None:
    command.add_argument("pictures", nargs="+", help="board pictures, a folder of them, or one video")
    command.add_argument("-o", "--output", default="camera.json", help="camera file to write (default: camera.json)")
    command.add_argument("--picture", help="picture of boards, corners and errors to write: SVG, PDF or PNG")
    command.add_argument("--blend", help="save the scene with the camera and its boards here")
    pattern = command.add_mutually_exclusive_group()
    pattern.add_argument("--inner", type=grid, default=(9, 6), help="inner corners of a checkerboard: 9x6")
    pattern.add_argument("--squares", type=grid, help="black squares apart from each other instead: 8x8")
    command.add_argument("--square-mm", type=float, default=25.5, help="side of a square (default: 25.5)")
    command.add_argument("--gap-mm", type=float, help="white between separate squares (default: the side of a square)")


def track_arguments(command: argparse.ArgumentParser) -> None:
    command.add_argument("clip", help="a video, a folder of numbered frames, or a frame of an image sequence")
    command.add_argument("-o", "--output", default="tracks.json", help="tracks to write (default: tracks.json)")
    command.add_argument("--blend", help="save the scene with the clip and its markers here")
    command.add_argument("--camera", help="camera.json of a calibrated camera")
    command.add_argument("--method", choices=["default", "paper"], default="default")
    command.add_argument("--points", type=int, default=200, help="points wanted in a frame of reference (default: 200)")
    command.add_argument("--window", type=int, help="side of the pattern, pixels (default: fits the face)")
    command.add_argument("--frames", type=span, help="first and last frame, counted from 0: 480-660")


def motion_arguments(command: argparse.ArgumentParser) -> None:
    command.add_argument("clip", help="a video, a folder of numbered frames, or a frame of an image sequence")
    command.add_argument("--tracks", help="tracks.json of the clip (default: the face is tracked first)")
    command.add_argument("-o", "--output", default="motion.json", help="motion to write (default: motion.json)")
    command.add_argument("--blend", help="save the scene with the clip, the camera and the points here")
    command.add_argument("--camera", help="camera.json of a calibrated camera")
    command.add_argument("--interocular-mm", type=float, help="distance between the pupils")
    command.add_argument(
        "--length",
        type=length,
        action="append",
        default=[],
        help="measured distance in mm between two tracks: 12-40=61.5; may be given again",
    )
    command.add_argument("--show", choices=list(KINDS), default="camera", help="what moves in the scene")


def length(text: str) -> tuple[int, int, float]:
    """`12-40=61.5` as two tracks and millimetres."""
    tracks, _, size = text.partition("=")
    try:
        return *span(tracks), float(size)
    except (argparse.ArgumentTypeError, ValueError) as error:
        raise argparse.ArgumentTypeError("two tracks and millimetres like 12-40=61.5") from error


def span(text: str) -> tuple[int, int]:
    """`480-660` as numbers."""
    first, dash, last = text.partition("-")
    if not (dash and first.isdigit() and last.isdigit()):
        raise argparse.ArgumentTypeError("two frame numbers like 480-660")
    return int(first), int(last)


def grid(text: str) -> tuple[int, int]:
    """`9x6` as numbers."""
    columns, cross, rows = text.partition("x")
    if not (cross and columns.isdigit() and rows.isdigit()):
        raise argparse.ArgumentTypeError("columns and rows like 9x6")
    return int(columns), int(rows)


def run(arguments: list[str]) -> int:
    """The exit code: 0 done, 1 a clear error, 2 usage."""
    try:
        wanted = parser().parse_args(arguments)
    except SystemExit as stop:
        return int(stop.code or 0)
    try:
        lines = COMMANDS[wanted.command](wanted)
    except FacewrightError as error:
        print(f"facewright: {error}", file=sys.stderr)
        return 1
    print("\n".join(lines))
    return 0


def reconstruct(wanted: argparse.Namespace) -> list[str]:
    """What is to be said of a head that was written."""
    settings = actions.Settings(
        camera=camera_actions.read_camera(wanted.camera) if wanted.camera else None,
        method=wanted.method,
        texture_size=wanted.texture_size,
        interocular_mm=wanted.interocular_mm,
        output=wanted.output,
    )
    result = wait(actions.reconstructed(actions.Source(wanted.clip, wanted.frames), settings))
    result.write(wanted.output)
    if wanted.blend:
        actions.place(bpy.context.scene, result, str(Path(wanted.clip).resolve()))
        bpy.ops.wm.save_as_mainfile(filepath=bpy.path.abspath(wanted.blend))
    return [*actions.report_lines(result.report), *actions.warnings(result.report)]


def calibrate(wanted: argparse.Namespace) -> list[str]:
    """What is to be said of a camera that was written."""
    columns, rows = wanted.squares or wanted.inner
    gap_mm = wanted.gap_mm or wanted.square_mm if wanted.squares else None
    board = camera_actions.BoardSettings(columns, rows, wanted.square_mm, gap_mm)
    check_folder(str(Path(wanted.output).resolve().parent))
    text = wait(camera_actions.calibrated(wanted.pictures, board, wanted.picture))
    camera_actions.save_camera(wanted.output, text)
    if wanted.blend:
        camera_actions.set_camera(bpy.context.scene, text)
        camera_actions.show_boards(bpy.context.scene)
        bpy.ops.wm.save_as_mainfile(filepath=bpy.path.abspath(wanted.blend))
    return [*camera_actions.summary(text), *camera_actions.warnings(text)]


def track(wanted: argparse.Namespace) -> list[str]:
    """What is to be said of tracks that were written."""
    settings = track_actions.Settings(
        camera=camera_actions.read_camera(wanted.camera) if wanted.camera else None,
        method=wanted.method,
        points=wanted.points,
        window=wanted.window,
    )
    check_folder(str(Path(wanted.output).resolve().parent))
    clip = footage.load(str(Path(wanted.clip).resolve()))
    try:
        source = footage.of_clip(clip)
        source = source.part(wanted.frames[0] + 1, wanted.frames[1] + 1) if wanted.frames else source
        text = wait(track_actions.tracked(source, settings))
        lines = track_actions.save_text(wanted.output, text)
        if wanted.blend:
            track_actions.place(clip, text)
            # Blender saves no clip that nothing uses.
            bpy.context.scene.active_clip = clip
            bpy.ops.wm.save_as_mainfile(filepath=bpy.path.abspath(wanted.blend))
        return lines
    finally:
        bpy.data.movieclips.remove(clip)


def motion(wanted: argparse.Namespace) -> list[str]:
    """What is to be said of a motion that was written."""
    camera = camera_actions.read_camera(wanted.camera) if wanted.camera else None
    check_folder(str(Path(wanted.output).resolve().parent))
    clip, scene = footage.load(str(Path(wanted.clip).resolve())), bpy.context.scene
    try:
        if wanted.tracks:
            track_actions.open_file(wanted.tracks, clip)
        else:
            settings = track_actions.Settings(camera=camera)
            track_actions.place(clip, wait(track_actions.tracked(footage.of_clip(clip), settings)))
        settings = motion_actions.Settings(camera, wanted.interocular_mm)
        tracks = track_actions.read(clip)
        text = wait(motion_actions.solved_text(tracks, settings, wanted.length))
        lines = motion_actions.save_text(wanted.output, text)
        if wanted.blend:
            scene.facewright_motion.kind = KINDS[wanted.show]
            motion_actions.place(scene, clip, text)
            scene.active_clip = clip
            bpy.ops.wm.save_as_mainfile(filepath=bpy.path.abspath(wanted.blend))
        return lines
    finally:
        bpy.data.movieclips.remove(clip)


COMMANDS = {"reconstruct": reconstruct, "calibrate": calibrate, "track": track, "motion": motion}
