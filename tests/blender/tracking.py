"""Tracks of a face that tests make up, and what they ask of a clip with them."""

import importlib
import json
from collections.abc import Callable
from types import ModuleType, SimpleNamespace
from typing import Any

import bpy
import numpy as np
from conftest import PACKAGE, ROOT

CLIP = ROOT / "tests/data/clip"
TRUTH = json.loads((CLIP / "truth.json").read_text())
NAMES = [f"frame_{k:02d}" for k in range(21)]
REGIONS = ("skin", "mouth", "eyes", "brows")
SIZE = (400, 300)
Text = dict[str, Any]


def made_up(count: int = 12, names: list[str] | None = None, seed: int = 3, first_id: int = 0) -> Text:
    """A tracks.json: points that wander over the picture, found from some frame on to some other, with gaps."""
    names, rng = NAMES if names is None else names, np.random.default_rng(seed)
    tracks = [one_track(first_id + k, REGIONS[k % 4], len(names), rng) for k in range(count)]
    poses = {frame["name"]: frame["cam_from_head"] for frame in TRUTH["frames"]}
    frames = [
        {"name": name, "used": k != 4, "reason": "blurred" if k == 4 else "", "cam_from_head": poses.get(name)}
        for k, name in enumerate(names)
    ]
    frames[4]["reason_kind"] = "blurred"
    for k, frame in enumerate(frames):
        frame["points"] = sum(k in [row[0] for row in track["observations"]] for track in tracks)
    camera = TRUTH["camera"] | {"source": "board"}
    head = {"version": "0.1.0", "method": "default", "camera": camera, "window": 15}
    return head | {"frames": frames, "tracks": tracks, "interocular": 0.0627}


def one_track(number: int, region: str, frames: int, rng: np.random.Generator) -> Text:
    """At least two frames, a gap of one or two, a frame again; `frames` are seven or more."""
    first, last = int(rng.integers(0, max(frames // 5, 1))), int(rng.integers(frames * 3 // 4, frames))
    gap = (first + last) // 2
    gap_end = min(gap + int(rng.integers(0, 2)), last - 1)
    points = rng.uniform((20, 20), (380, 280)) + rng.normal(0.0, 2.0, (frames, 2)).cumsum(axis=0)
    seen = [k for k in range(first, last + 1) if not gap <= k <= gap_end]
    rows = [[k, *points[k].tolist(), float(rng.uniform(0.05, 0.4))] for k in seen]
    gaps = [[gap, gap_end, "turned away"]] + ([[last + 1, frames - 1, "outside"]] if last + 1 < frames else [])
    place = [round(float(v), 6) for v in rng.uniform(-0.08, 0.08, 3)]
    head = {"id": number, "reference": seen[1], "region": region}
    return head | {"observations": rows, "gaps": gaps, "place": place}


def module(name: str) -> ModuleType:
    return importlib.import_module(f"{PACKAGE}.{name}")


def place(clip: bpy.types.MovieClip, tracks: Text) -> str:
    return module("track.actions").place(clip, parsed(tracks))


def read(clip: bpy.types.MovieClip) -> Text:
    return json.loads(str(module("track.actions").read(clip)))


def parsed(tracks: Text) -> Any:
    """As the library has them."""
    return module("engine").Tracks.parse(json.dumps(tracks))


def written(content: Text) -> Text:
    """As the library writes it: with its schema, and with all that a camera has."""
    return content | {"schema": 1, "camera": {"k1": 0.0, "k2": 0.0} | content["camera"]}


def same(mine: Any, theirs: Any) -> bool:
    """Whether two files hold the same; poses are rounded to rotations as they are read."""
    if isinstance(mine, dict):
        return mine.keys() == theirs.keys() and all(same(mine[key], theirs[key]) for key in mine)
    if isinstance(mine, list):
        return len(mine) == len(theirs) and all(map(same, mine, theirs))
    return abs(mine - theirs) < 1e-6 if isinstance(mine, float) else mine == theirs


def by_id(tracks: Text) -> dict[int, Text]:
    return {track["id"]: track for track in tracks["tracks"]}


def marker(track: bpy.types.MovieTrackingTrack, frame: int) -> bpy.types.MovieTrackingMarker:
    found = track.markers.find_frame(frame)
    assert found is not None
    return found


# What a job has of a head before it is done, (n, 3).
SHAPE = np.eye(3, dtype=np.float32)


class Finished:
    """A native job that has made something; `fails` is raised instead."""

    def __init__(self, made: Any = None, fails: Exception | None = None) -> None:
        self.made, self.fails, self.cancelled, self.rounds = made, fails, False, 2

    def progress(self) -> tuple[str, float, float | None]:
        return "track", 0.5, 12.0

    def step(self) -> tuple[int, int] | None:
        return 3, 8

    def sketch(self, after: int = 0) -> tuple[int, Any] | None:
        """One shape, which is told once."""
        return None if after else (1, SHAPE)

    def finished(self) -> bool:
        self.rounds -= 1
        return self.cancelled or self.rounds < 0

    def cancel(self) -> None:
        self.cancelled = True

    def result(self) -> Any:
        if self.fails is not None:
            raise self.fails
        return self.made


def in_editor(clip: bpy.types.MovieClip, work: Callable[[], Any]) -> Any:
    """What is done in a Clip editor."""
    window = bpy.context.window_manager.windows[0]
    area = window.screen.areas[0]
    area.type = "CLIP_EDITOR"
    area.spaces.active.clip = clip
    area.spaces.active.clip_user.frame_current = bpy.context.scene.frame_current
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        return work()


class Layout:
    """Takes what a panel draws; refuses properties and operators that there are not."""

    def __init__(self, context: Any = None) -> None:
        self.said: list[str] = []
        self.context = context

    def prop(self, data: Any, name: str, **_more: Any) -> None:
        is_custom = name.startswith('["')
        assert name[2:-2] in data if is_custom else name in data.bl_rna.properties

    def prop_search(self, data: Any, name: str, within: Any, collection: str, **_more: Any) -> None:
        assert name in data.bl_rna.properties and collection in within.bl_rna.properties

    def operator(self, name: str, text: str = "", **_more: Any) -> SimpleNamespace:
        if name == "facewright.dismiss":
            # A sentence that a click puts away.
            self.said.append(text)
        category, _, call = name.partition(".")
        assert getattr(getattr(bpy.ops, category), call).get_rna_type()
        return SimpleNamespace()

    def menu(self, name: str, **_more: Any) -> None:
        assert hasattr(bpy.types, name)

    def label(self, text: str = "", **_more: Any) -> None:
        self.said.append(text)

    def template_list(self, kind: str, _name: str, data: Any, of: str, active: Any, index: str, **_more: Any) -> None:
        """Takes what the rows draw."""
        assert index in active.bl_rna.properties
        cls, me, shown = getattr(bpy.types, kind), SimpleNamespace(bitflag_filter_item=1), self.context
        items = list(getattr(data, of))
        flags = cls.filter_items(me, shown, data, of)[0] if hasattr(cls, "filter_items") else [1] * len(items)
        for item in [item for item, flag in zip(items, flags) if flag]:
            cls.draw_item(me, shown, self, data, item, 0, active, index)

    def separator(self, **_more: Any) -> None:
        pass

    def row(self, **_more: Any) -> "Layout":
        return self

    column = split = grid_flow = row


def drawn(panel: str, **context: Any) -> str:
    preferences = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))
    shown = SimpleNamespace(
        scene=bpy.context.scene, region=SimpleNamespace(width=400), preferences=preferences, **context
    )
    cls, layout = getattr(bpy.types, panel), Layout(shown)
    me = SimpleNamespace(layout=layout, draw_markers=lambda context: cls.draw_markers(me, context))
    cls.draw(me, shown)
    return " ".join(layout.said)
