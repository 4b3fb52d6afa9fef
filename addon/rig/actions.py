"""What the rig's buttons do."""

from pathlib import Path
from typing import Any
from zlib import crc32

from ..engine import CalibrateOptions, Camera, FacewrightError, Rig, calibrate_rig
from ..engine.rig import parse
from ..jobs import Work, watch

# A rig has at least so many cameras.
FEWEST = 2


def calibrated(folders: list[tuple[str, str]], options: dict[str, Any]) -> Work[Rig]:
    """Calibrate cameras from folders of pictures of one board, given by their names."""
    if len(folders) < FEWEST:
        raise FacewrightError("a rig needs two or more cameras: add a folder of pictures for each")
    names = [name for name, _ in folders]
    for name, path in folders:
        if not name:
            raise FacewrightError(f"the camera of {path} has no name: give it one")
        if names.count(name) > 1:
            raise FacewrightError(f"two cameras are named {name}: give each a name of its own")
        if not Path(path).is_dir():
            raise FacewrightError(f"{path} is not a folder: choose the pictures of camera {name} again")
    cameras = [(name, [path]) for name, path in folders]
    return watch(calibrate_rig(cameras, options=CalibrateOptions(**options)))


def known(text: str) -> Rig | None:
    """The rig that a scene holds; None without one, or with text that is none."""
    try:
        return parse(text) if text else None
    except FacewrightError:
        return None


def set_rig(scene: Any, rig: Rig) -> str:
    """Let a scene have this rig; gives it in a line. The camera that it uses stays until one is chosen."""
    scene.facewright_rig.text = rig.to_json()
    return ", ".join(summary(scene.facewright_rig.text))


def forget(scene: Any) -> None:
    """Take the rig out of a scene; the camera that was chosen stays."""
    scene.facewright_rig.text = scene.facewright_rig.camera = scene.facewright_rig.fingerprint = ""


def choose(scene: Any, name: str) -> Camera:
    """The rig's camera of that name, noted as the one that filmed the clip."""
    settings = scene.facewright_rig
    camera = parse(settings.text).camera(name)
    settings.camera, settings.fingerprint = name, _fingerprint(camera.to_json())
    return camera


def chosen(scene: Any) -> str:
    """The name of the rig's camera that the scene uses; empty where it uses another one."""
    settings = scene.facewright_rig
    same = settings.fingerprint == _fingerprint(scene.facewright_camera.text)
    return settings.camera if settings.camera and same else ""


def _fingerprint(text: str) -> str:
    return f"{crc32(text.encode()):08x}"


def summary(text: str) -> list[str]:
    """A rig in a line for all, and one for each camera; empty without one."""
    rig = known(text)
    if rig is None:
        return []
    lines = [f"{len(rig)} cameras, error {rig.rms_px:.3f} px"]
    for camera in rig.cameras:
        away = f", {camera.baseline:.3f} m away" if camera.baseline > 0.0 else ""
        lines.append(f"{camera.name}: focal {camera.camera.fx:.1f} px{away}")
    return lines


def names(text: str) -> list[str]:
    """The names of the rig's cameras; empty without one."""
    rig = known(text)
    return rig.names if rig else []


def warnings(text: str) -> list[str]:
    """What to photograph next, and what to distrust."""
    rig = known(text)
    return rig.warnings if rig else []


def save(path: str, text: str) -> str:
    """Write a rig.json; gives the message."""
    rig = parse(text)
    rig.write(path)
    return f"{path} saved with {len(rig)} cameras"


def add_folder(settings: Any, path: str) -> str:
    """Add a folder of pictures, named as it is; gives the name."""
    folder = Path(path)
    if not folder.is_dir():
        raise FacewrightError(f"{path} is not a folder: choose one with a camera's pictures of the board")
    row = settings.folders.add()
    row.name, row.path = folder.name, str(folder)
    return row.name
