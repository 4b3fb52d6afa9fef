"""Reads the head back that the hour's test has exported: in Blender without a window, and in three.js.

    python read_back.py RESULTS [--three FOLDER]        (a Python that has bpy)

RESULTS holds hour.glb, and hour.json: for each frame and part the box around it in the scene, metres. Every part must
be in the same box at every frame, and must have moved from the first to the last.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

# By frames, then parts: least and greatest x, y and z, metres, z up.
Boxes = dict[str, dict[str, list[float]]]
# The most that a part may be off, and the least that it has moved from the first frame to the last.
ALLOWED_METRES, MOVED_METRES = 5e-5, 5e-3
SCRIPT = Path(__file__).parents[1] / "blender/three.mjs"


def in_blender(file: Path, frames: list[str]) -> Boxes:
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=str(file))
    found: Boxes = {}
    for frame in frames:
        bpy.context.scene.frame_set(int(frame))
        graph = bpy.context.evaluated_depsgraph_get()
        meshes = [obj for obj in bpy.data.objects if obj.type == "MESH"]
        found[frame] = {obj.data.name: box(corners(obj.evaluated_get(graph))) for obj in meshes}
    return found


def corners(shown: bpy.types.Object) -> NDArray[np.float64]:
    """(n, 3) vertices in the world."""
    mesh = shown.to_mesh()
    flat = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", flat)
    place = np.array(shown.matrix_world, np.float64)
    return flat.reshape(-1, 3) @ place[:3, :3].T + place[:3, 3]


def in_three(file: Path, frames: list[str], folder: Path) -> Boxes:
    # The scene's frames per second, Blender's usual.
    command = ["node", str(SCRIPT), str(folder), str(file), "24", *frames]
    told = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
    # y up there: its y is our z, its z our -y.
    to_ours = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], np.float64)
    at = {
        part["name"]: [np.array(flat, np.float64).reshape(-1, 3) @ to_ours.T for flat in part["frames"]]
        for part in told
    }
    return {frame: {name: box(places[i]) for name, places in at.items()} for i, frame in enumerate(frames)}


def box(points: NDArray[np.float64]) -> list[float]:
    return [*points.min(axis=0).tolist(), *points.max(axis=0).tolist()]


def complaints(truth: Boxes, found: Boxes) -> list[str]:
    """What is not as in the scene; empty if all is."""
    said = []
    first, *_, last = truth
    for name in truth[first]:
        if name not in found[first]:
            said.append(f"{name} is missing among {', '.join(found[first])}")
            continue
        apart = max(distance(truth[frame][name], found[frame][name]) for frame in truth)
        if apart > ALLOWED_METRES:
            said.append(f"{name} is up to {1e3 * apart:.2f} mm away from where it was")
        if distance(found[first][name], found[last][name]) < MOVED_METRES:
            said.append(f"{name} does not move")
    return said


def distance(one: list[float], other: list[float]) -> float:
    return max(abs(a - b) for a, b in zip(one, other))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", type=Path)
    parser.add_argument("--three", type=Path, help="the folder of three's npm package; skipped without it")
    given = parser.parse_args()
    file, truth = given.results / "hour.glb", json.loads((given.results / "hour.json").read_text())
    readers = {"Blender": lambda: in_blender(file, list(truth))}
    if given.three:
        readers["three.js"] = lambda: in_three(file, list(truth), given.three)
    failed = False
    for name, read in readers.items():
        said = complaints(truth, read())
        failed |= bool(said)
        moving = f"all {len(truth['1'])} parts are where they are in the scene, at {len(truth)} frames"
        print(f"{'FAILED' if said else 'ok     '} the exported head in {name}: {'; '.join(said) or moving}", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
