"""`cargo x bench reconstruct`: what a head costs, from the films to the files.

`reconstruct.py CLIP FOLDER ASSETS PROGRAM [BEFORE]`: writes films of several sizes, all made of the demo clip, runs the
program on each, in turn with another build of it if there is one, and prints a row a film: time, processor time,
memory, each step's share. Unlike in the other benches all cores work, and time is the wall's, as whoever waits for a
head counts it.
"""

import json
import os
import shutil
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing import Process
from pathlib import Path
from typing import Any

import cv2
import numpy as np

Picture = np.ndarray[Any, np.dtype[np.uint8]]

# Frames of the clip in which the man turns his head with a quiet face.
FIRST, LAST = 480, 660
TURNS = 3


@dataclass(frozen=True)
class Film:
    """The clip's frames there and back until there are enough, enlarged to a size; or blurred until no face is left."""

    name: str
    frames: int
    width: int
    height: int
    has_face: bool = True

    def folder(self, folder: Path) -> Path:
        """Where its frames are."""
        return folder / self.name.replace(" ", "-")

    def write(self, clip: list[Picture], folder: Path) -> None:
        """Its frames, unless they are there."""
        frames = self.folder(folder)
        if not frames.is_dir():
            unfinished = frames.with_suffix(".part")
            shutil.rmtree(unfinished, ignore_errors=True)
            unfinished.mkdir(parents=True)
            for k, picture in zip(range(self.frames), there_and_back(clip), strict=False):
                path = str(unfinished / f"frame_{k:06d}.png")
                cv2.imwrite(path, self.enlarged(picture), [cv2.IMWRITE_PNG_COMPRESSION, 1])
            unfinished.rename(frames)

    def enlarged(self, picture: Picture) -> Picture:
        """The picture at the film's height, its edges repeated to the sides or cut off."""
        if not self.has_face:
            picture = cv2.resize(cv2.resize(picture, (8, 6), interpolation=cv2.INTER_AREA), picture.shape[1::-1])
        height, width = picture.shape[:2]
        scaled = cv2.resize(picture, (round(width * self.height / height), self.height), interpolation=cv2.INTER_CUBIC)
        missing = self.width - scaled.shape[1]
        if missing < 0:
            return scaled[:, -missing // 2 :][:, : self.width]
        return cv2.copyMakeBorder(scaled, 0, 0, missing // 2, missing - missing // 2, cv2.BORDER_REPLICATE)


FILMS = [
    Film("clip", 181, 400, 300),
    Film("without a face", 181, 400, 300, has_face=False),
    Film("512 x 512", 400, 512, 512),
    Film("1920 x 1080", 300, 1920, 1080),
    Film("3840 x 2160", 60, 3840, 2160),
]


def there_and_back(clip: list[Picture]) -> Iterator[Picture]:
    """The frames, then back to the first, and again."""
    while True:
        yield from clip
        yield from clip[-2:0:-1]


def read(path: Path) -> list[Picture]:
    """The frames of the clip that are used."""
    video = cv2.VideoCapture(str(path))
    frames = [video.read()[1] for _ in range(LAST + 1)]
    return frames[FIRST:]


@dataclass
class Cost:
    """What one run took."""

    wall_s: float
    processor_s: float
    memory_mb: float
    steps_s: dict[str, float]


def run(program: Path, frames: Path, assets: Path, out: Path) -> Cost:
    """One head, or the refusal of a film without a face."""
    shutil.rmtree(out, ignore_errors=True)
    begun = time.monotonic()
    command = [program, "reconstruct", frames, "--assets", assets, "-q", "-o", out]
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, _, used = os.wait4(child.pid, 0)
    report = out / "report.json"
    steps = json.loads(report.read_text())["timings_s"] if report.is_file() else {}
    steps.pop("total", None)
    return Cost(time.monotonic() - begun, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024, steps)


def median(costs: list[Cost]) -> Cost:
    """Of each figure by itself."""
    of = statistics.median
    steps = {step: of(cost.steps_s[step] for cost in costs) for step in costs[0].steps_s}
    numbers = (of(getattr(cost, name) for cost in costs) for name in ("wall_s", "processor_s", "memory_mb"))
    return Cost(*numbers, steps)


def row(film: Film, side: str, cost: Cost) -> str:
    """The figures of a side."""
    work = sum(cost.steps_s.values())
    shares = sorted(cost.steps_s.items(), key=lambda step: -step[1])
    told = ", ".join(f"{step} {100 * seconds / work:.0f} %" for step, seconds in shares if seconds >= 0.02 * work)
    per_frame = 1e3 * cost.processor_s / film.frames
    return (
        f"{film.name:15} {film.frames:4} frames {side:7} {cost.wall_s:6.1f} s {cost.processor_s:6.1f} CPU-s"
        f" {per_frame:5.0f} CPU-ms/frame {cost.memory_mb:5.0f} MB  {told or 'refused'}"
    )


def write_films(clip: Path, folder: Path) -> None:
    """All films. In a process of its own: a program's memory is counted from that of the process that starts it."""
    pictures = read(clip)
    for film in FILMS:
        film.write(pictures, folder)


def main() -> None:
    """Measures every film, each program in turn."""
    clip, folder, assets, *programs = map(Path, sys.argv[1:])
    writing = Process(target=write_films, args=(clip, folder))
    writing.start()
    writing.join()
    if writing.exitcode:
        sys.exit("the films could not be written")
    for film in FILMS:
        frames = film.folder(folder)
        costs: list[list[Cost]] = [[] for _ in programs]
        for _ in range(TURNS):
            for program, taken in zip(programs, costs, strict=True):
                taken.append(run(program, frames, assets, folder / "head"))
        for side, taken in zip(("ours", "before"), costs, strict=False):
            print(row(film, side, median(taken)), flush=True)


if __name__ == "__main__":
    main()
