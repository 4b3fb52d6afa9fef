"""`blender -b --command facewright …`: the commands of the `facewright` program, from Blender's shell.

Of `reconstruct`, `calibrate`, `track` and `motion` Blender decodes the clip and shows the result in a scene; what is
Blender's is read here, everything else by the library, as for the program itself.
"""

import argparse
import os
import re
import sys
from pathlib import Path
from typing import Any

import bpy

from .calibrate import actions as camera_actions
from .engine import Command, FacewrightError, Tracks, UsageError, check_folder, parse_command, run_command
from .engine.report import parse as parse_report
from .engine.report import summary
from .jobs import wait
from .motion import actions as motion_actions
from .reconstruct import actions
from .scene import footage
from .track import actions as track_actions

PROGRAM = "blender -b --command facewright"
# How a motion is shown.
KINDS = {"camera": "CAMERA", "head": "HEAD", "cameras": "CAMERAS"}

# What is to be said, and the result as JSON.
Said = tuple[list[str], str]

_handle: Any = None


def register() -> None:
    global _handle
    _handle = bpy.utils.register_cli_command("facewright", run)


def unregister() -> None:
    global _handle
    bpy.utils.unregister_cli_command(_handle)
    _handle = None


def own_arguments(command: str) -> argparse.ArgumentParser:
    """What Blender adds to a command; all else is left to the library."""
    own = argparse.ArgumentParser(
        prog=f"{PROGRAM} {command}", usage=argparse.SUPPRESS, add_help=False, allow_abbrev=False
    )
    own.add_argument("--blend", metavar="FILE", help="save the scene with the result here")
    if command in {"reconstruct", "track"}:
        own.add_argument("--frames", type=span, metavar="A-B", help="first and last frame, counted from 0: 480-660")
    if command == "motion":
        own.add_argument("--tracks", metavar="FILE", help="existing tracks of the clip")
        own.add_argument("--show", choices=list(KINDS), default="camera", help="what moves in the scene")
    return own


def span(text: str) -> tuple[int, int]:
    """`480-660` as numbers."""
    first, dash, last = text.partition("-")
    if not (dash and first.isdigit() and last.isdigit()):
        raise argparse.ArgumentTypeError("two frame numbers like 480-660")
    return int(first), int(last)


def run(arguments: list[str]) -> int:
    """The exit code: 0 done, 1 a clear error, 2 usage."""
    if not arguments or arguments[0] not in COMMANDS or "--rig" in arguments:
        return run_command(arguments, PROGRAM)
    own = own_arguments(arguments[0])
    try:
        wanted, rest = own.parse_known_args(arguments[1:])
        command = parse_command([arguments[0], *map(with_colon, rest)], program=PROGRAM)
        said, text = COMMANDS[arguments[0]](wanted, command)
    except SystemExit as stop:
        return int(stop.code or 0)
    except UsageError as usage:
        print(f"{usage}\nOf Blender's own:\n{own.format_help()}", file=sys.stderr if usage.exit_code else sys.stdout)
        return usage.exit_code
    except FacewrightError as error:
        print(f"facewright: {error}", file=sys.stderr)
        return 1
    print(text if command.json else "\n".join(said))
    return 0


def warn(warnings: list[str]) -> None:
    """As the program does it: apart from the result."""
    for warning in warnings:
        print(f"warning: {warning}", file=sys.stderr)


def with_colon(argument: str) -> str:
    """A length as the library spells it, `12:40=61.5`, of how Blender's shell used to: `12-40=61.5`."""
    return re.sub(r"^((?:--length=)?\d+)-(\d+=)", r"\1:\2", argument)


def reconstruct(wanted: argparse.Namespace, command: Command) -> Said:
    """Write a head."""
    files = command.files
    use_assets(command)
    settings = actions.Settings(
        camera=camera_actions.read_camera(files["camera"]) if files["camera"] else None,
        faces=read(files["faces"]),
        tracks=Tracks.read(files["tracks"]) if files["tracks"] else None,
        motion=read(files["motion"]),
        options=command.options,
        output=files["output"],
    )
    result = wait(actions.reconstructed(actions.Source(clip_of(command), wanted.frames), settings))
    result.write(files["output"])
    if wanted.blend:
        actions.place(bpy.context.scene, result, str(Path(clip_of(command)).resolve()))
        save(wanted.blend)
    warn(actions.warnings(result.report))
    return summary(parse_report(result.report)), result.report


def calibrate(wanted: argparse.Namespace, command: Command) -> Said:
    """Write a camera."""
    files = command.files
    output = files["output"] or "camera.json"
    check_folder(str(Path(output).resolve().parent))
    text = wait(camera_actions.calibrated(list(files["pictures"]), command.options, files["picture"]))
    camera_actions.save_camera(output, text)
    if wanted.blend:
        camera_actions.set_camera(bpy.context.scene, text)
        camera_actions.show_boards(bpy.context.scene)
        save(wanted.blend)
    warn(camera_actions.warnings(text))
    return camera_actions.summary(text), text


def track(wanted: argparse.Namespace, command: Command) -> Said:
    """Write tracks."""
    files = command.files
    use_assets(command)
    camera = camera_actions.read_camera(files["camera"]) if files["camera"] else None
    check_folder(str(Path(files["output"]).resolve().parent))
    clip = footage.load(str(Path(clip_of(command)).resolve()))
    try:
        source = footage.of_clip(clip)
        source = source.part(wanted.frames[0] + 1, wanted.frames[1] + 1) if wanted.frames else source
        tracks = wait(
            track_actions.tracked(source, track_actions.Settings(camera, read(files["faces"]), command.options))
        )
        lines = track_actions.save_text(files["output"], tracks)
        if wanted.blend:
            track_actions.place(clip, tracks)
            # Blender saves no clip that nothing uses.
            bpy.context.scene.active_clip = clip
            save(wanted.blend)
        return lines, tracks.to_json()
    finally:
        bpy.data.movieclips.remove(clip)


def motion(wanted: argparse.Namespace, command: Command) -> Said:
    """Write a motion."""
    files, options, scene = command.files, command.options, bpy.context.scene
    use_assets(command)
    camera = camera_actions.read_camera(files["camera"]) if files["camera"] else None
    check_folder(str(Path(files["output"]).resolve().parent))
    clip = footage.load(str(Path(clip_of(command)).resolve()))
    try:
        if wanted.tracks:
            track_actions.open_file(wanted.tracks, clip)
        else:
            settings = track_actions.Settings(camera)
            track_actions.place(clip, wait(track_actions.tracked(footage.of_clip(clip), settings)))
        settings = motion_actions.Settings(camera, options.interocular_mm)
        tracks = track_actions.read(clip)
        found = wait(motion_actions.solved_text(tracks, settings, list(options.lengths)))
        lines = motion_actions.save_text(files["output"], found)
        if wanted.blend:
            scene.facewright_motion.kind = KINDS[wanted.show]
            motion_actions.place(scene, clip, found)
            scene.active_clip = clip
            save(wanted.blend)
        return lines, found.to_json()
    finally:
        bpy.data.movieclips.remove(clip)


def clip_of(command: Command) -> str:
    """The one clip that Blender decodes."""
    frames = command.files["frames"]
    if len(frames) != 1:
        raise FacewrightError("give one clip: a video, a folder of frames, or one frame of an image sequence")
    return frames[0]


def read(path: str | None) -> str | None:
    """The text of a file, where one is given."""
    try:
        return Path(path).read_text(encoding="utf-8") if path else None
    except (OSError, ValueError) as error:
        raise FacewrightError(f"{path} cannot be read: {error}") from error


def use_assets(command: Command) -> None:
    """Let this Blender take the assets that the command line names."""
    if command.assets:
        os.environ["FACEWRIGHT_ASSETS"] = str(command.assets)


def save(path: str) -> None:
    bpy.ops.wm.save_as_mainfile(filepath=bpy.path.abspath(path))


COMMANDS = {"reconstruct": reconstruct, "calibrate": calibrate, "track": track, "motion": motion}
