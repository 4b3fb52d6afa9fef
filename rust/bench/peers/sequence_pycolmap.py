"""COLMAP's side of the bench `sequence`: verified matches, then the incremental mapper."""

import tempfile
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pycolmap
from common import Run, timed, write_runs

SEED = 0
TABLES = "tables.db"
# Errors that COLMAP tolerates, pixels, by default: 4 and 12. The other setting tolerates what ours does by default.
SETTINGS = {"default": None, "within 1.5 px": 1.5}
# Pairs of frames are matched as COLMAP's matcher of films chooses them by default: each frame with the next ten and
# with those 16, 32 … frames later. A short film is matched exhaustively.
SHORT = 24
OVERLAP = 10


def measure(case: dict[str, Any], _folder: Path) -> list[Run]:
    """Both settings."""
    return [run(case, setting, error_px) for setting, error_px in SETTINGS.items()]


def run(case: dict[str, Any], setting: str, error_px: float | None) -> Run:
    """Every film. The time is COLMAP's alone: its tables are made before."""
    options = mapper_options(case["refine_focal"], error_px)
    with tempfile.TemporaryDirectory() as name:
        films = [Path(name) / str(k) for k, _ in enumerate(case["films"])]
        tracks = [
            write_tables(film, case, seen["observations"]) for film, seen in zip(films, case["films"], strict=True)
        ]
        verify_ms, _ = timed(lambda: [verify(film, error_px) for film in films])
        map_ms, found = timed(lambda: [map_film(film, options) for film in films])
    times = {"verify": verify_ms / len(films), "map": map_ms / len(films)}
    answers = [answer(case, *of_film) for of_film in zip(found, tracks, strict=True)]
    return Run(case["name"], "motion", setting, times, answers)


def write_tables(folder: Path, case: dict[str, Any], observations: list[Any]) -> list[np.ndarray]:
    """Camera, frames, observations and matches; the tracks that each frame's observations belong to."""
    frames = case["frames"]
    seen: list[list[tuple[int, list[float]]]] = [[] for _ in range(frames)]
    for frame, track, pixel in observations:
        seen[frame].append((track, pixel))
    tracks = [np.array([track for track, _ in of_frame]) for of_frame in seen]
    folder.mkdir()
    with pycolmap.Database.open(folder / TABLES) as tables:
        camera = write_camera(tables, case["camera"])
        rig = pycolmap.Rig()
        rig.add_ref_sensor(camera.sensor_id)
        rig_id = tables.write_rig(rig)
        for k, of_frame in enumerate(seen):
            write_frame(tables, k, camera.camera_id, rig_id)
            tables.write_keypoints(k + 1, np.array([pixel for _, pixel in of_frame], np.float32))
        for a, b in pairs(frames):
            _, in_a, in_b = np.intersect1d(tracks[a], tracks[b], assume_unique=True, return_indices=True)
            tables.write_matches(a + 1, b + 1, np.stack([in_a, in_b], axis=1).astype(np.uint32))
    return tracks


def write_camera(tables: pycolmap.Database, lens: dict[str, Any]) -> pycolmap.Camera:
    """The camera with one focal length, which is at least a good guess."""
    camera = pycolmap.Camera.create_from_model_name(1, "SIMPLE_PINHOLE", lens["fx"], lens["width"], lens["height"])
    camera.params = [lens["fx"], lens["cx"], lens["cy"]]
    camera.has_prior_focal_length = True
    tables.write_camera(camera, use_camera_id=True)
    return camera


def write_frame(tables: pycolmap.Database, k: int, camera_id: int, rig_id: int) -> None:
    """A picture without pixels."""
    image = pycolmap.Image(name=f"{k:03}", camera_id=camera_id, image_id=k + 1)
    tables.write_image(image, use_image_id=True)
    frame = pycolmap.Frame()
    frame.frame_id, frame.rig_id = k + 1, rig_id
    frame.add_data_id(image.data_id)
    tables.write_frame(frame, use_frame_id=True)


def pairs(frames: int) -> list[tuple[int, int]]:
    """The pairs of frames that are matched."""
    apart = set(range(1, OVERLAP + 1)) | {1 << k for k in range(OVERLAP)}
    every = combinations(range(frames), 2)
    return [(a, b) for a, b in every if frames <= SHORT or b - a in apart]


def verify(folder: Path, error_px: float | None) -> None:
    """Geometric verification of all matches."""
    verifier, geometry = pycolmap.GeometricVerifierOptions(), pycolmap.TwoViewGeometryOptions()
    verifier.num_threads = 1
    geometry.ransac.random_seed = SEED
    if error_px is not None:
        geometry.ransac.max_error = error_px
    with pycolmap.Database.open(folder / TABLES) as tables:
        tables.clear_two_view_geometries()
    pycolmap.geometric_verification(folder / TABLES, verifier, two_view_geometry_options=geometry)


def map_film(folder: Path, options: pycolmap.IncrementalPipelineOptions) -> dict[int, pycolmap.Reconstruction]:
    """All models of a film; of the pictures only the folder is asked for."""
    pycolmap.set_random_seed(SEED)
    return pycolmap.incremental_mapping(folder / TABLES, folder, folder, options)


def mapper_options(refine_focal: bool, error_px: float | None) -> pycolmap.IncrementalPipelineOptions:
    """One thread, no colours."""
    options = pycolmap.IncrementalPipelineOptions()
    mapper, points = options.mapper, options.triangulation
    options.num_threads = mapper.num_threads = 1
    options.random_seed = mapper.random_seed = points.random_seed = SEED
    options.extract_colors = False
    options.ba_refine_focal_length = mapper.abs_pose_refine_focal_length = refine_focal
    options.ba_refine_extra_params = mapper.abs_pose_refine_extra_params = False
    if error_px is not None:
        mapper.init_max_error = mapper.abs_pose_max_error = mapper.filter_max_reproj_error = error_px
        points.merge_max_reproj_error = points.complete_max_reproj_error = error_px
    return options


def answer(case: dict[str, Any], found: dict[int, pycolmap.Reconstruction], tracks: list[np.ndarray]) -> dict[str, Any]:
    """Focal length, poses and points by track, of which the longest part counts where the mapper has cut it."""
    poses: list[list[list[float]] | None] = [None] * len(tracks)
    points: list[list[float] | None] = [None] * case["points"]
    if not found:
        return {"focal_px": case["camera"]["fx"], "poses": poses, "points": points}
    model = max(found.values(), key=lambda model: model.num_reg_images())
    for image_id in model.reg_image_ids():
        pose = model.image(image_id).cam_from_world().matrix()
        poses[image_id - 1] = [*pose.tolist(), [0.0, 0.0, 0.0, 1.0]]
    for point in sorted(model.points3D.values(), key=lambda point: point.track.length()):
        first = point.track.elements[0]
        points[tracks[first.image_id - 1][first.point2D_idx]] = point.xyz.tolist()
    return {"focal_px": model.camera(1).focal_length, "poses": poses, "points": points}


if __name__ == "__main__":
    pycolmap.logging.minloglevel = pycolmap.logging.WARNING.value
    write_runs(f"COLMAP (pycolmap {pycolmap.__version__})", measure)
