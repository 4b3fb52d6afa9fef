"""OpenCV's side of the bench `dense`: flat windows swept along the normals, by normalised cross-correlation."""

from pathlib import Path
from typing import Any

import cv2
import numpy as np
from common import Run, timed
from opencv import main, read_grey

# Sides of a window, pixels.
WINDOWS = (15, 21)
# Offsets along a normal, metres.
OFFSETS = np.linspace(-0.0015, 0.0015, 31)
# A view takes part where it sees a place less obliquely than this, cosine; a place is measured where so many do.
OBLIQUE, FEWEST = 0.4, 4
# Windows that agree less are no measurement.
AGREEMENT = 0.6


def pixels(camera: dict[str, Any], pose: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Where a camera shows points."""
    turn, _ = cv2.Rodrigues(pose[:3, :3])
    matrix = np.array([[camera["fx"], 0, camera["cx"]], [0, camera["fy"], camera["cy"]], [0, 0, 1]])
    lens = np.array([camera["k1"], camera["k2"], 0, 0])
    found, _ = cv2.projectPoints(points.reshape(-1, 3), turn, pose[:3, 3], matrix, lens)
    return found.reshape(*points.shape[:-1], 2).astype(np.float32)


def normalised(windows: np.ndarray) -> np.ndarray:
    """Windows (last axis) with mean 0 and length 1."""
    windows = windows - windows.mean(axis=-1, keepdims=True)
    return windows / np.maximum(np.linalg.norm(windows, axis=-1, keepdims=True), 1e-6)


def swept(case: dict[str, Any], pictures: list[np.ndarray], side: int) -> list[float | None]:
    """How far the skin is out from each vertex."""
    places = np.array(case["positions"])
    normals = places / np.linalg.norm(places, axis=1, keepdims=True)
    poses = [np.array(pose) for pose in case["poses"]]
    wanted = np.flatnonzero(np.array(case["share"]) > 0.5)
    places, normals = places[wanted], normals[wanted]
    across = np.cross([0.0, 1.0, 0.0], normals)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    down = np.cross(normals, across)
    # As wide as so many pixels in the frontal picture.
    pixel = np.linalg.norm(poses[len(poses) // 2][:3, 3]) / case["camera"]["fx"]
    steps = (np.arange(side) - (side - 1) / 2) * pixel
    u, v = (grid.ravel()[None, :, None] for grid in np.meshgrid(steps, steps))
    windows = across[:, None, :] * u + down[:, None, :] * v
    cosines = []
    for pose in poses:
        rays = places @ pose[:3, :3].T + pose[:3, 3]
        cosines.append(-np.einsum("ij,ij->i", normals @ pose[:3, :3].T, rays) / np.linalg.norm(rays, axis=1))
    seen = np.array(cosines) > OBLIQUE
    frontal = len(poses) // 2
    agreement = np.zeros((len(OFFSETS), len(places)))
    for k, offset in enumerate(OFFSETS):
        points = (places + offset * normals)[:, None, :] + windows
        shown = [
            normalised(cv2.remap(picture, *np.moveaxis(pixels(case["camera"], pose, points), -1, 0), cv2.INTER_LINEAR))
            for pose, picture in zip(poses, pictures)
        ]
        correlations = np.array([np.einsum("ij,ij->i", window, shown[frontal]) for window in shown])
        correlations[frontal] = 0.0
        agreement[k] = (correlations * seen).sum(axis=0) / np.maximum(seen.sum(axis=0) - 1, 1)
    best = np.clip(agreement.argmax(axis=0), 1, len(OFFSETS) - 2)
    before, at, after = (agreement[best + shift, np.arange(len(places))] for shift in (-1, 0, 1))
    bend = before - 2 * at + after
    peak = np.where(bend < -1e-9, 0.5 * (before - after) / np.where(bend < -1e-9, bend, -1.0), 0.0)
    found = OFFSETS[best] + np.clip(peak, -1, 1) * (OFFSETS[1] - OFFSETS[0])
    answer: list[float | None] = [None] * len(case["positions"])
    for vertex, value, agreed, views in zip(wanted, found, at, seen.sum(axis=0)):
        if agreed > AGREEMENT and views >= FEWEST:
            answer[vertex] = float(value)
    return answer


def measure(case: dict[str, Any], folder: Path) -> list[Run]:
    """By every window."""
    pictures = [read_grey(folder / name) for name in case["pictures"]]
    runs = []
    for side in WINDOWS:
        ms, answer = timed(lambda side=side: swept(case, pictures, side))
        runs.append(Run(case["name"], "surface along normals", f"NCC, window {side}", {"measure": ms}, answer))
    return runs


if __name__ == "__main__":
    main(measure)
