"""The examples do what they say, on the synthetic person whose truth is known."""

import json
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

ROOT = Path(os.environ["FACEWRIGHT_ROOT"])
CLIP = ROOT / "tests/data/clip"


@pytest.fixture
def truth(tmp_path: Path) -> dict:
    """The clip's truth; its camera is left as camera.json."""
    truth = json.loads((CLIP / "truth.json").read_text())
    (tmp_path / "camera.json").write_text(json.dumps(truth["camera"]))
    return truth


def example(name: str, facewright: ModuleType, assets: Path, folder: Path, frames: Path) -> subprocess.CompletedProcess:
    script = ROOT / "rust/python/examples" / name
    options = ["--assets", str(assets), "--camera", str(folder / "camera.json")]
    library = str(Path(facewright.__file__ or "").parents[1])
    return subprocess.run(
        [sys.executable, str(script), str(frames), str(folder / "out"), *options],
        env=os.environ | {"PYTHONPATH": library},
        capture_output=True,
        text=True,
    )


def test_a_head_is_made_and_its_report_told(facewright: ModuleType, assets: Path, tmp_path: Path, truth: dict) -> None:
    done = example("reconstruct.py", facewright, assets, tmp_path, CLIP / "frames")
    assert done.returncode == 0, done.stderr
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "head.glb",
        "texture.png",
        "eyes.png",
        "displacement.png",
        "report.json",
    }
    assert "67 shape keys" in done.stdout and f"of {len(truth['frames'])} frames used" in done.stdout


def test_an_error_is_a_sentence(facewright: ModuleType, assets: Path, tmp_path: Path, truth: dict) -> None:
    empty = tmp_path / "empty"
    empty.mkdir()
    done = example("reconstruct.py", facewright, assets, tmp_path, empty)
    assert done.returncode == 1 and "no pictures in" in done.stderr and "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()


def test_a_motion_becomes_a_table_of_true_poses(
    facewright: ModuleType, assets: Path, tmp_path: Path, truth: dict
) -> None:
    done = example("motion.py", facewright, assets, tmp_path, CLIP / "frames")
    assert done.returncode == 0, done.stderr
    assert "are fixed to the head" in done.stdout
    table = np.loadtxt(tmp_path / "out/poses.csv", delimiter=",")
    poses = np.array([frame["cam_from_head"] for frame in truth["frames"]])
    true_yaw = np.degrees(np.arctan2(poses[:, 0, 2], -poses[:, 2, 2]))
    assert len(table) == len(poses)
    # The head's axes are those of the head that was fitted: they may differ by the same small angle in all frames.
    yaw_error = table[:, 1] - true_yaw
    assert np.abs(yaw_error - np.median(yaw_error)).max() < 1.0 and abs(np.median(yaw_error)) < 5.0
    # Without a measured length the size is that of usual eyes.
    distance, true_distance = (np.linalg.norm(at, axis=1) for at in (table[:, 2:], poses[:, :3, 3]))
    assert np.abs(distance / true_distance - 1.0).max() < 0.15
