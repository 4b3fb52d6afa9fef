"""The manual's links, the report as a text, first steps, preferences, the Clip editor without a clip."""

import json
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import bpy
import pytest
from conftest import PACKAGE, ROOT, snapshot
from people import ANNA, Clips, clip_of, run, select
from tracking import drawn, module


@pytest.fixture
def manual(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A manual of two pages, where the add-on looks for it."""
    for name in ("index", "cameras"):
        (tmp_path / f"{name}.html").write_text(f"<h1>{name}</h1>", encoding="utf-8")
    monkeypatch.setattr(module("help.actions"), "MANUAL", tmp_path)
    return tmp_path


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Addresses that the browser was asked for."""
    asked: list[str] = []
    monkeypatch.setattr("webbrowser.open", lambda url, *_more, **_named: asked.append(url) or True)
    return asked


def looked_up(name: str) -> str | None:
    """Where Blender's F1 goes from a button or field of this name."""
    return bpy.types.WM_OT_doc_view_manual._lookup_rna_url(name, verbose=False)


def test_f1_finds_the_page_of_a_feature_and_else_the_first_page(manual: Path) -> None:
    assert looked_up("bpy.ops.facewright.calibrate") == (manual / "cameras.html").as_uri()
    assert looked_up("bpy.types.FacewrightCamera.square_mm") == (manual / "cameras.html").as_uri()
    for name in ("bpy.ops.facewright.export", "bpy.types.FacewrightKeys.search", "bpy.types.Scene.facewright_clip"):
        assert looked_up(name) == (manual / "index.html").as_uri()


def test_the_chapters_that_links_name_are_written() -> None:
    written = {chapter.stem for chapter in (ROOT / "docs/manual").glob("*.md")}
    if not written:
        pytest.skip("the manual is not in this tree")
    help_actions = module("help.actions")
    assert {*help_actions.PAGES, help_actions.FILMING, help_actions.FIRST_HEAD, "index"} <= written


def test_f1_on_what_is_blenders_goes_where_it_went(manual: Path) -> None:
    found = looked_up("bpy.types.Object.location")
    assert found is None or found.startswith("https://docs.blender.org")


def test_without_a_manual_f1_finds_nothing_of_ours_and_the_button_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module("help.actions"), "MANUAL", tmp_path / "none")
    assert looked_up("bpy.ops.facewright.calibrate") is None
    with pytest.raises(RuntimeError, match="comes without the manual"):
        bpy.ops.facewright.manual()


def test_the_manual_is_a_file_of_the_extension(manual: Path, opened: list[str]) -> None:
    assert bpy.ops.facewright.manual() == {"FINISHED"}
    assert bpy.ops.facewright.manual(page="cameras") == {"FINISHED"}
    assert opened == [(manual / name).as_uri() for name in ("index.html", "cameras.html")]
    assert all(url.startswith("file:///") for url in opened)


def test_the_report_is_a_text_of_the_head_that_is_active(clips: Clips) -> None:
    anna, ben = run(clips.anna), run(clips.ben)
    select(anna)
    assert bpy.ops.facewright.open_report() == {"FINISHED"}
    (text,) = bpy.data.texts
    assert "this is Anna" in text.as_string().replace("This", "this") and anna.name in text.name
    text.name = "Mine"
    bpy.ops.facewright.open_report()
    assert [t.name for t in bpy.data.texts] == ["Mine"], "a text that was renamed is found again"
    select(ben)
    bpy.ops.facewright.open_report()
    assert len(bpy.data.texts) == 2 and "This is Ben" in bpy.data.texts["Face.001 Report"].as_string()


def test_a_new_run_shows_in_the_same_text(clips: Clips, grown: Any) -> None:
    anna = run(clips.anna)
    bpy.ops.facewright.open_report()
    anna["facewright_report"] = json.dumps(json.loads(anna["facewright_report"]) | {"warnings": ["another warning"]})
    bpy.ops.facewright.open_report()
    (text,) = bpy.data.texts
    assert "Another warning" in text.as_string() and "This is Anna" not in text.as_string()


def test_without_a_head_there_is_no_report_and_nothing_changes() -> None:
    before = snapshot()
    with pytest.raises(RuntimeError, match="Reconstruct a face first"):
        bpy.ops.facewright.open_report()
    assert snapshot() == before and not bpy.data.texts


def test_first_steps_end_with_the_first_head(clips: Clips, addon: ModuleType) -> None:
    step = module("help.actions").next_step
    scene = bpy.context.scene
    (film, choose) = step(scene)
    assert "Film a face" in film and "choose" in choose
    scene.facewright_clip.path = clips.anna
    assert step(scene)[0].startswith("Reconstruct Face")
    run(clips.anna)
    assert step(scene) == ()


def test_first_steps_are_drawn_until_there_is_a_head(clips: Clips) -> None:
    panel = bpy.types.FACEWRIGHT_PT_first_steps
    assert "Film a face that turns slowly" in drawn("FACEWRIGHT_PT_first_steps")
    bpy.context.scene.facewright_clip.path = clips.anna
    assert "Reconstruct Face makes a textured head" in drawn("FACEWRIGHT_PT_first_steps")
    assert panel.poll(bpy.context)
    run(clips.anna)
    assert not panel.poll(bpy.context)
    drawn("FACEWRIGHT_PT_help")


def test_the_clip_editor_without_a_clip_says_what_it_is_for(clip: bpy.types.MovieClip) -> None:
    assert drawn("FACEWRIGHT_PT_track", space_data=SimpleNamespace(clip=None)).startswith("Open the film of a face")
    assert "Open the film" not in drawn("FACEWRIGHT_PT_track", space_data=SimpleNamespace(clip=clip))


@pytest.fixture
def preferences() -> Any:
    found = bpy.context.preferences.addons[PACKAGE].preferences
    yield found
    found.property_unset("assets")
    found.property_unset("texture_size")
    module("preferences").register()


def test_the_preferred_texture_is_that_of_scenes_without_one(preferences: Any) -> None:
    own = bpy.data.scenes.new("Own")
    own.facewright_clip.texture_size = "1024"
    preferences.texture_size = "4096"
    fresh = bpy.data.scenes.new("Fresh")
    sizes = {scene.name: scene.facewright_clip.texture_size for scene in (bpy.context.scene, own, fresh)}
    assert sizes == {bpy.context.scene.name: "4096", "Own": "1024", "Fresh": "4096"}
    options = module("reconstruct.actions").options_of(fresh.facewright_clip)
    assert options.texture_size == 4096


def test_what_a_scene_holds_survives_a_change_of_the_preference(preferences: Any, clips: Clips) -> None:
    clip = bpy.context.scene.facewright_clip
    clip.path, clip.use_markers = clips.anna, True
    preferences.texture_size = "1024"
    clip = bpy.context.scene.facewright_clip
    assert (clip.path, clip.use_markers) == (clips.anna, True)


def test_assets_come_from_the_preferred_folder(
    preferences: Any, engine: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("FACEWRIGHT_ASSETS", raising=False)
    built_in = engine.assets_folder()
    assert Path(built_in).is_dir()
    preferences.assets = str(tmp_path)
    assert Path(engine.assets_folder()) == tmp_path
    with pytest.raises(engine.FacewrightError, match=tmp_path.name):
        engine.generic_head()
    monkeypatch.setenv("FACEWRIGHT_ASSETS", built_in)
    assert engine.assets_folder() == built_in, "the environment goes first"
    monkeypatch.delenv("FACEWRIGHT_ASSETS")
    preferences.assets = ""
    assert engine.assets_folder() == built_in


def editor(clip: Any, mode: str = "TRACKING", view: str = "CLIP") -> Any:
    """A context whose Clip editor shows a clip."""
    return SimpleNamespace(space_data=SimpleNamespace(mode=mode, view=view, clip=clip))


def test_the_clip_editor_has_our_tab_without_a_clip(clip: bpy.types.MovieClip) -> None:
    panels = {name: getattr(bpy.types, f"FACEWRIGHT_PT_{name}") for name in ("track", "tracks", "clip_motion")}
    assert {name for name, panel in panels.items() if panel.poll(editor(None))} == {"track"}
    assert {name for name, panel in panels.items() if panel.poll(editor(clip))} == set(panels)
    assert not any(panel.poll(editor(clip, mode="MASK")) for panel in panels.values())
    assert not any(panel.poll(editor(clip, view="GRAPH")) for panel in panels.values())


def report(*frames: tuple[bool, str | None, str], seen: float = 0.6) -> str:
    """A report.json of frames: used or not, the reason's kind and sentence."""
    generic = json.loads(module("engine").generic_head().report)
    told = [
        {"name": f"frame_{n}", "used": used, "reason": why, "cam_from_head": None, "reprojection_rms_px": None}
        | ({"reason_kind": kind} if kind else {})
        for n, (used, kind, why) in enumerate(frames)
    ]
    return json.dumps(generic | {"frames": told, "points": 500, "texture": generic["texture"] | {"seen": seen}})


def test_frames_that_were_not_needed_are_not_called_left_out() -> None:
    frames = [(True, "yaw", "yaw +3°")] * 36 + [(False, "between_looks", "between frames that were looked at")] * 120
    frames += [(False, "alike", "looks like a better frame that is used")] * 20
    frames += [(False, "enough", "enough frames from this side")] * 5 + [(False, "eyes_closed", "eyes closed")] * 2
    lines = module("reconstruct.actions").report_lines(report(*frames))
    assert lines[:3] == [
        "Made from 36 frames, 500 points",
        "145 frames not needed: 120 between those that were looked at, 20 like a better one, "
        "5 from a side with enough others",
        "2 frames left out: eyes closed",
    ]
    assert "Skin: 60 % seen, rest filled in" in lines


def test_frames_of_older_reports_are_told_apart_too() -> None:
    frames = [(True, None, "yaw +3°"), (False, None, "looks like a better frame that is used")]
    frames += [(False, None, "blurred: 10 % of the clip's usual sharpness"), (False, None, "eyes closed")]
    lines = module("reconstruct.actions").report_lines(report(*frames))
    assert lines[:3] == [
        "Made from 1 frame, 500 points",
        "1 frame not needed: like a better one",
        "2 frames left out: 1 blurred, 1 eyes closed",
    ]


def test_every_frame_given_is_in_one_of_the_sentences() -> None:
    """Of each kind that the library knows: what is used, not needed and left out adds up."""
    kinds = ["no_face", "other_shot", "blurred", "covered", "eyes_closed", "expression", "alike", "enough"]
    kinds += ["between_looks", "no_pose", "from_the_side", "not_tracked", "contradicted"]
    frames = [(False, kind, kind) for kind in kinds] + [(True, "yaw", "yaw +3°")] * 4
    lines = module("reconstruct.actions").report_lines(report(*frames))
    counts = [int(line.removeprefix("Made from ").split(" ")[0]) for line in lines[:3]]
    assert counts == [4, 3, len(kinds) - 3]


def test_the_text_tells_of_every_frame(clips: Clips) -> None:
    anna = run(clip_of(Path(clips.anna).parent, ANNA))
    anna["facewright_report"] = report((True, "yaw", "yaw +3°"), (False, "blurred", "blurred: 10 % as sharp"))
    bpy.ops.facewright.open_report()
    lines = bpy.data.texts[0].as_string().splitlines()
    assert "frame_0  used  yaw +3°" in lines and "frame_1  –     blurred: 10 % as sharp" in lines
