"""Makes the manual's pictures: cuts them out of what the window's tests have left, and spoils frames of the demo clip.

    python3 tests/gui/pictures.py --shots FOLDER --frames tests/data/clip/frames --out docs/manual/pictures

Needs ImageMagick. A picture is a JPEG of at most 150 KB; the same input gives the same file.
"""

import argparse
import subprocess
import sys
from pathlib import Path

# (width, height, left, top) of the screenshot; None is all of it.
Part = tuple[int, int, int, int] | None
VIEW: Part = (1057, 720, 0, 0)
CLIP_PANEL: Part = (262, 636, 773, 56)
HEADS: Part = (262, 130, 773, 56)
REPORT: Part = (262, 158, 773, 142)
TABLE: Part = (262, 455, 773, 182)
# By the names of the manual's pictures: what a test has left, and what of it is shown.
CUT: dict[str, tuple[str, Part]] = {
    "installed": ("hour-01-installed", (860, 580, 0, 0)),
    "tab": ("hour-02-tab", VIEW),
    "clip": ("frames-chosen", CLIP_PANEL),
    "growing": ("growing", VIEW),
    "head": ("hour-head-in-view", VIEW),
    "report": ("hour-05-neutral-at-01", REPORT),
    "happiness": ("hour-05-happiness-at-20", None),
    "surprise": ("hour-05-surprise-at-40", None),
    "controls": ("controls-dragged", VIEW),
    "two-heads": ("hour-07-second-person", VIEW),
    "heads": ("heads-list", HEADS),
    "exported": ("hour-11-exported", None),
    "appended": ("hour-12-appended", None),
    "calibration": ("calibration-table", TABLE),
    "tracks": ("tracks", None),
    "motion": ("motion-through", None),
}
GOOD = ("frame_02", "frame_11", "frame_19")
SPOILED = "frame_11"
# What a bad film does to a frame, in the order of the chapter.
BAD: dict[str, list[str]] = {
    "blurred": ["-motion-blur", "0x9+0"],
    "dark": ["-evaluate", "multiply", "0.2"],
    "lit from one side": [
        *["(", "+clone", "-sparse-color", "barycentric", "120,0 white 270,0 gray20", ")"],
        *["-compose", "multiply", "-composite"],
    ],
    "cut off": ["-virtual-pixel", "edge", "-distort", "SRT", "200,150 1 0 20,110"],
    "too small": ["-virtual-pixel", "edge", "-distort", "SRT", "200,150 0.3 0 230,150"],
    "covered": ["-fill", "#8a6a58", "-draw", "roundrectangle 130,96 300,140 20,20"],
}
WIDTH, TILE = 960, "320x240"
QUALITY = 82
MOST_BYTES = 150_000


def magick(*arguments: str | Path) -> None:
    subprocess.run(["convert", *map(str, arguments)], check=True)


def cut(source: Path, part: Part, target: Path) -> None:
    """A part of a screenshot, not wider than a page."""
    cropped = ["-crop", "{}x{}+{}+{}".format(*part), "+repage"] if part else []
    magick(source, *cropped, "-resize", f"{WIDTH}x>", "-strip", "-quality", str(QUALITY), target)


def row(pictures: list[list[str | Path]], columns: int, target: Path) -> None:
    """Pictures beside each other, a few in each row."""
    tiles = [
        ["(", *picture, "-resize", f"{TILE}!", "-bordercolor", "white", "-border", "3", ")"] for picture in pictures
    ]
    lines = [tiles[i : i + columns] for i in range(0, len(tiles), columns)]
    flat = [word for line in lines for word in ("(", *[w for tile in line for w in tile], "+append", ")")]
    magick(*flat, "-append", "-resize", f"{WIDTH}x>", "-strip", "-quality", str(QUALITY), target)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--shots", type=Path, required=True, help="what the window's tests have left")
    parser.add_argument("--frames", type=Path, required=True, help="the frames of the demo clip")
    parser.add_argument("--out", type=Path, required=True, help="where the pictures go")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    for name, (shot, part) in CUT.items():
        cut(given.shots / f"{shot}.png", part, given.out / f"{name}.jpg")
    row([[given.frames / f"{name}.jpg"] for name in GOOD], 3, given.out / "frames-good.jpg")
    row([[given.frames / f"{SPOILED}.jpg", *how] for how in BAD.values()], 3, given.out / "frames-bad.jpg")
    large = [file.name for file in given.out.iterdir() if file.stat().st_size > MOST_BYTES]
    if large:
        print(f"larger than {MOST_BYTES // 1000} KB: {', '.join(large)}")
    return 1 if large else 0


if __name__ == "__main__":
    sys.exit(main())
