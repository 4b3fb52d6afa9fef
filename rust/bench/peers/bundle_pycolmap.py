"""Ceres' side of the bench `bundle`, by way of pycolmap."""

import statistics
import time
from pathlib import Path
from typing import Any

import numpy as np
import pycolmap
from common import ENOUGH_S, ROUNDS, Run, write_runs

LOSSES = {"squared": "TRIVIAL", "huber": "HUBER", "cauchy": "CAUCHY"}
# The solver, and the part of the cost below which a decrease ends the descent: COLMAP's own choice with the usual
# tolerance and with one at which the costs of all sides agree, and the solvers that may be faster.
SETTINGS = {
    "auto": (None, 1e-6),
    "auto, tight": (None, 1e-12),
    "dense Schur": ("DENSE_SCHUR", 1e-6),
    "sparse Schur": ("SPARSE_SCHUR", 1e-6),
    "iterative Schur": ("ITERATIVE_SCHUR", 1e-6),
}
# Where one descent takes seconds only these are measured, and once: the turns of the bench are the rounds.
SLOW = 15_000
SLOW_SETTINGS = {"squared": ("auto", "dense Schur", "iterative Schur"), "huber": ("auto",), "cauchy": ("auto",)}


def measure(case: dict[str, Any], _folder: Path) -> list[Run]:
    """Every loss in every setting."""
    slow = len(case["observations"]) > SLOW
    chosen = {task: SLOW_SETTINGS[task] if slow else tuple(SETTINGS) for task in LOSSES}
    return [run(case, task, name, *SETTINGS[name]) for task, names in chosen.items() for name in names]


def run(case: dict[str, Any], task: str, setting: str, solver: str | None, tolerance: float) -> Run:
    """One loss in one setting. The time is that of the descent alone: the peer's tables are made before."""
    options = solver_options(case, task, solver, tolerance)
    rounds: list[float] = []
    while not rounds or (sum(rounds) < 1e3 * ENOUGH_S and len(rounds) < ROUNDS[1]):
        found, adjuster = prepare(case, options)
        before = time.process_time()
        summary = adjuster.solve()
        rounds.append(1e3 * (time.process_time() - before))
    ceres = summary.ceres_summary
    answer = {
        "steps": ceres.num_successful_steps + ceres.num_unsuccessful_steps,
        "poses": [pose_rows(found.images[k]) for k in sorted(found.images)],
        "points": [found.points3D[k].xyz.tolist() for k in sorted(found.points3D)],
    }
    return Run(case["name"], task, setting, {"adjust": statistics.median(rounds)}, answer)


def solver_options(
    case: dict[str, Any], task: str, solver: str | None, tolerance: float
) -> pycolmap.BundleAdjustmentOptions:
    """One thread, camera kept."""
    options = pycolmap.BundleAdjustmentOptions()
    options.print_summary = False
    options.refine_focal_length = options.refine_principal_point = options.refine_extra_params = False
    options.ceres.loss_function_type = getattr(pycolmap.LossFunctionType, LOSSES[task])
    options.ceres.loss_function_scale = case["limit_px"]
    ceres = options.ceres.solver_options
    ceres.num_threads, ceres.function_tolerance, ceres.max_num_iterations = 1, tolerance, 50
    if solver is not None:
        options.ceres.auto_select_solver_type = False
        ceres.linear_solver_type = getattr(type(ceres.linear_solver_type), solver)
    return options


def prepare(case: dict[str, Any], options: pycolmap.BundleAdjustmentOptions) -> tuple[pycolmap.Reconstruction, Any]:
    """The case as COLMAP's tables; the first pose and the scale are held, as ours are."""
    lens = case["camera"]
    camera = pycolmap.Camera.create_from_model_name(1, "PINHOLE", lens["fx"], lens["width"], lens["height"])
    camera.params = [lens["fx"], lens["fy"], lens["cx"], lens["cy"]]
    found = pycolmap.Reconstruction()
    found.add_camera_with_trivial_rig(camera)
    pixels: list[list[np.ndarray]] = [[] for _ in case["poses"]]
    tracks = [pycolmap.Track() for _ in case["points"]]
    for frame, point, pixel in case["observations"]:
        tracks[point].add_element(frame + 1, len(pixels[frame]))
        pixels[frame].append(np.array(pixel))
    for k, rows in enumerate(case["poses"]):
        image = pycolmap.Image()
        image.image_id, image.camera_id, image.name = k + 1, 1, str(k)
        image.points2D = pycolmap.Point2DList([pycolmap.Point2D(pixel) for pixel in pixels[k]])
        pose = np.array(rows)
        found.add_image_with_trivial_frame(image, pycolmap.Rigid3d(pycolmap.Rotation3d(pose[:3, :3]), pose[:3, 3]))
    for place, track in zip(case["points"], tracks, strict=True):
        found.add_point3D(np.array(place), track)
    config = pycolmap.BundleAdjustmentConfig()
    for image_id in found.images:
        config.add_image(image_id)
    config.fix_gauge(pycolmap.BundleAdjustmentGauge.TWO_CAMS_FROM_WORLD)
    return found, pycolmap.create_default_bundle_adjuster(options, config, found)


def pose_rows(image: pycolmap.Image) -> list[list[float]]:
    """The four rows of `cam_from_head`."""
    return [*image.cam_from_world().matrix().tolist(), [0.0, 0.0, 0.0, 1.0]]


if __name__ == "__main__":
    write_runs(f"Ceres (pycolmap {pycolmap.__version__})", measure)
