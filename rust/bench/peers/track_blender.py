"""Blender's side of the bench `track`: the tracker of its clip editor, on the film only."""

import time
from contextlib import AbstractContextManager
from pathlib import Path
from statistics import median
from typing import Any

import bpy
from common import ROUNDS, Run, write_runs

FILM = "clip"
TASK = "window 15"
PATTERN = 15
SEARCH = 61
# Blender opens the files of a pair within its time: what a further marker costs is free of that.
SETTING = f"pattern {PATTERN}, Loc, previous frame, reads the files"

Found = list[list[float] | None]


def measure(case: dict[str, Any], folder: Path) -> list[Run]:
    """Every pair of the film, by one command for each."""
    if case["name"] != FILM:
        return []
    editor = Editor(folder / case["pictures"][0], case["pairs"])
    pairs = range(len(case["pairs"]))

    def call_ms(count: int | None) -> float:
        rounds = [sum(editor.track(pair, count) for pair in pairs) for _ in range(ROUNDS[0])]
        return median(rounds) / len(pairs)

    times = {"call_with_one_point": call_ms(1), "call": call_ms(None)}
    return [Run(case["name"], TASK, SETTING, times, {"tracks": [editor.found(pair) for pair in pairs]})]


class Editor:
    """A clip editor with one film and tracks for every pair, each with a marker in the pair's first frame."""

    def __init__(self, first_picture: Path, pairs: list[dict[str, Any]]) -> None:
        self.clip = bpy.data.movieclips.load(str(first_picture))
        self.window = bpy.context.window_manager.windows[0]
        self.area = self.window.screen.areas[0]
        self.area.type = "CLIP_EDITOR"
        self.space = self.area.spaces.active
        self.space.clip = self.clip
        settings = self.clip.tracking.settings
        settings.default_pattern_size, settings.default_search_size = PATTERN, SEARCH
        settings.default_motion_model, settings.default_pattern_match = "Loc", "PREV_FRAME"
        # The film begins at Blender's frame 1.
        self.frames = [(pair["a"] + 1, pair["b"] + 1) for pair in pairs]
        self.tracks = [
            [self.marked(frame, point) for point in pair["points"]] for pair, (frame, _) in zip(pairs, self.frames)
        ]

    def marked(self, frame: int, point: list[float]) -> Any:
        """A new track."""
        track = self.clip.tracking.tracks.new(name="", frame=frame)
        track.markers.find_frame(frame).co = self.to_clip(point)
        return track

    def track(self, pair: int, count: int | None) -> float:
        """Tracks the first points of a pair; gives the processor time, milliseconds."""
        (a, b), used = self.frames[pair], self.tracks[pair][:count]
        for track in self.clip.tracking.tracks:
            track.select = False
        for track in used:
            track.select = True
            for frame in [marker.frame for marker in track.markers if marker.frame != a]:
                track.markers.delete_frame(frame)
        scene = self.window.scene
        scene.frame_start, scene.frame_end = a, b
        # Commands begin at the editor's frame, which follows the scene's only on the screen.
        scene.frame_set(a)
        self.space.clip_user.frame_current = a
        with self.context():
            before = time.process_time()
            bpy.ops.clip.track_markers(backwards=False, sequence=True)
            return 1e3 * (time.process_time() - before)

    def found(self, pair: int) -> Found:
        """Where the points of a pair that was tracked are."""
        markers = [track.markers.find_frame(self.frames[pair][1]) for track in self.tracks[pair]]
        return [None if marker is None or marker.mute else self.to_pixel(marker.co) for marker in markers]

    def context(self) -> AbstractContextManager[Any]:
        """Of a command in the clip editor."""
        region = next(region for region in self.area.regions if region.type == "WINDOW")
        return bpy.context.temp_override(window=self.window, area=self.area, region=region, space_data=self.space)

    def to_clip(self, pixel: list[float]) -> tuple[float, float]:
        """Blender counts from the frame's lower left corner, half a pixel outside of the last pixel's centre."""
        width, height = self.clip.size
        return (pixel[0] + 0.5) / width, 1 - (pixel[1] + 0.5) / height

    def to_pixel(self, at: Any) -> list[float]:
        """The way back."""
        width, height = self.clip.size
        return [at[0] * width - 0.5, (1 - at[1]) * height - 0.5]


if __name__ == "__main__":
    write_runs(f"Blender {bpy.app.version_string}", measure)
