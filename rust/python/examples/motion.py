"""Track a face, solve for the head's motion, and look at both with NumPy.

    python motion.py FRAMES OUT --assets ASSETS [--camera camera.json]

Leaves OUT/tracks.json, OUT/motion.json and OUT/poses.csv.
"""

import argparse
from pathlib import Path

import facewright
import numpy as np


def main() -> None:
    parser = argparse.ArgumentParser(description="Track a face and solve for the head's motion")
    parser.add_argument("frames", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--assets", type=Path, required=True)
    parser.add_argument("--camera", type=Path)
    given = parser.parse_args()
    camera = facewright.Camera.read(given.camera) if given.camera else None
    tracks = facewright.track([given.frames], assets=given.assets, camera=camera).result()
    motion = facewright.motion(tracks).result()

    lengths = np.array([len(track.frames) for track in tracks.tracks])
    print(f"{len(tracks)} points, found in {np.median(lengths):.0f} of {len(tracks.frames)} frames each (median)")
    rotations = motion.poses[motion.posed, :3, :3]
    translations = motion.poses[motion.posed, :3, 3]
    yaw = yaws(rotations)
    print(f"the head turns from {yaw.min():.1f}° to {yaw.max():.1f}°")
    print(f"it is {np.linalg.norm(translations, axis=1).mean():.3f} m away (mean)")
    fixed = ~motion.points.moves
    sigma = np.median(motion.points.sigmas_mm[fixed])
    print(f"{fixed.sum()} of {len(motion.points)} points are fixed to the head, sigma {sigma:.2f} mm (median)")
    print(f"reprojection error {motion.reprojection_rms_px:.2f} px (RMS)")

    given.out.mkdir(parents=True, exist_ok=True)
    tracks.write(given.out / "tracks.json")
    motion.write(given.out / "motion.json")
    table = np.column_stack([motion.posed, yaw, translations])
    np.savetxt(given.out / "poses.csv", table, "%d,%.3f,%.5f,%.5f,%.5f", header="frame,yaw_deg,x_m,y_m,z_m")


def yaws(rotations: np.ndarray) -> np.ndarray:
    """(n,) degrees; positive turns the nose to the right of the picture.

    The face looks along the head frame's +z, which is the last column of `cam_from_head`'s rotation; the camera looks
    along its own +z.
    """
    nose = rotations[:, :, 2]
    return np.degrees(np.arctan2(nose[:, 0], -nose[:, 2]))


if __name__ == "__main__":
    main()
