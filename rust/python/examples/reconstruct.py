"""Reconstruct the head in a clip and print what the report says.

    python reconstruct.py FRAMES OUT --assets ASSETS [--camera camera.json]

FRAMES is a folder of pictures, or a video; ASSETS the folder that `cargo x head` leaves, or the extension's `assets`.
"""

import argparse
import sys
import time
from pathlib import Path
from typing import Any

import facewright


def main() -> None:
    parser = argparse.ArgumentParser(description="Reconstruct the head in a clip")
    parser.add_argument("frames", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--assets", type=Path, required=True)
    parser.add_argument("--camera", type=Path)
    given = parser.parse_args()
    try:
        # Before the work, not after it.
        facewright.check_folder(given.out)
        camera = facewright.Camera.read(given.camera) if given.camera else None
        head = finish(facewright.reconstruct([given.frames], assets=given.assets, camera=camera, texture_size=1024))
        head.write(str(given.out))
    except facewright.FacewrightError as error:
        sys.exit(str(error))
    tell(head)


def finish(job: Any) -> Any:
    """The job's result, with its stages on the way. Ctrl-C drops the job, which cancels it."""
    while not job.finished():
        stage, done, _ = job.progress()
        print(f"\r{stage:<12}{done:4.0%}", end="", file=sys.stderr)
        time.sleep(0.1)
    print(file=sys.stderr)
    return job.result()


def tell(head: facewright.Reconstruction) -> None:
    report = facewright.Report.parse(head.report)
    used = sum(frame.used for frame in report.frames)
    print(f"{len(head.positions)} vertices, {len(head.quads)} quads, {len(head.keys)} shape keys")
    print(f"{used} of {len(report.frames)} frames used, {report.points} points measured")
    for frame in report.frames:
        if not frame.used:
            print(f"  {frame.name} was left out: {frame.reason}")
    print(f"size from {report.scale.source}, to {report.scale.relative_sigma:.1%}")
    print(f"points lie {report.fit.points_median_mm:.2f} mm from the surface (median)")
    for warning in report.warnings:
        print(f"warning: {warning}")


if __name__ == "__main__":
    main()
