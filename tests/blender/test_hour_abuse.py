"""Whatever an artist does while work goes on, at whatever moment: nothing is lost and nothing is mixed."""

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import bpy
import pytest
from conftest import ROOT, snapshot
from consistent import difference, faults, state
from people import ANNA, BEN, OLDER_ANNA, Clips, clip_of, head_of, heads, reds, reopened, run, select, size
from small_people import VERTICES, small
from small_people import library as small_library
from test_operators import numbered_clip
from tracking import Finished, module
from windowed import ESC, Run, begun

RECONSTRUCT = bpy.ops.facewright.reconstruct
MOMENTS = ("begun", "working", "delivered")


@pytest.fixture
def clips(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Clips:
    """Clips of two small people."""
    small_library(monkeypatch, {person.name: person for person in (ANNA, BEN)}, rounds=2)
    return SimpleNamespace(anna=clip_of(tmp_path, ANNA), ben=clip_of(tmp_path, BEN))


@pytest.fixture
def grown(monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """From then on, Anna's clip shows her a little older."""
    return lambda: small_library(monkeypatch, {person.name: person for person in (OLDER_ANNA, BEN)}, rounds=2)


@pytest.fixture
def meanwhile(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Run]:
    """Presses a button, lets the artist do something at a moment of the work, and sees the work to its end."""

    def work(moment: str, artist: Callable[[], Any], button: Any = RECONSTRUCT, **options: Any) -> Run:
        done = begun(monkeypatch, button, **options)
        if moment != "begun":
            assert done.step() == {"RUNNING_MODAL"}
        if moment == "delivered":
            with monkeypatch.context() as held:
                held.setattr(module("modal"), "busy_with", lambda _context: "done, let go of the mouse")
                while module("modal").Running.progress.stage != "done, let go of the mouse":
                    assert done.step() == {"RUNNING_MODAL"}
                artist()
        else:
            artist()
        done.end()
        assert not module("modal").Running.active, "nothing runs any more"
        return done

    return work


def assert_small(skin: bpy.types.Object, person: Any) -> None:
    """Shape and pictures of a head are a person's, and the file is consistent."""
    assert (round(size(skin), 3), reds(skin)) == (person.size, {person.red})
    assert faults(VERTICES) == []


def of_head(skin: bpy.types.Object) -> dict[str, str]:
    """The part of the file's state that is a head's."""
    names = {kind: {data.name for data in found} for kind, found in data_of(skin).items()}
    return {name: value for name, value in state().items() for k, n in names.items() if name in {f"{k} {x}" for x in n}}


def data_of(skin: bpy.types.Object) -> dict[str, list[Any]]:
    objects = head_of(skin).objects
    worn = [material for obj in objects for material in obj.data.materials]
    return {"object": objects, "mesh": [obj.data for obj in objects], "material": worn}


@pytest.mark.parametrize("mode", ["EDIT", "SCULPT", "WEIGHT_PAINT", "VERTEX_PAINT", "TEXTURE_PAINT"])
@pytest.mark.parametrize("moment", MOMENTS)
def test_a_mode_entered_meanwhile_mixes_nothing(
    clips: Clips, grown: Callable[[], None], meanwhile: Any, moment: str, mode: str
) -> None:
    anna = run(clips.anna)
    grown()
    done = meanwhile(moment, lambda: bpy.ops.object.mode_set(mode=mode))
    assert anna.mode == "OBJECT"
    assert_small(anna, OLDER_ANNA)
    title = mode.replace("_", " ").title()
    assert f"Face was in {title} Mode, which was left" in done.said[-1]


@pytest.mark.parametrize("moment", MOMENTS)
def test_what_is_edited_meanwhile_stays(clips: Clips, grown: Callable[[], None], meanwhile: Any, moment: str) -> None:
    anna = run(clips.anna)
    grown()

    def edit() -> None:
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.transform.translate(value=(0.0, 0.0, 0.01))

    meanwhile(moment, edit)
    assert module("scene.head").kept(anna) == ["the sculpting of 25 vertices of Face"]
    assert faults(VERTICES) == []


@pytest.mark.parametrize("moment", MOMENTS)
def test_a_head_left_in_edit_mode_in_another_scene_is_made_whole(
    clips: Clips, grown: Callable[[], None], meanwhile: Any, moment: str
) -> None:
    anna = run(clips.anna)
    grown()

    def leave() -> None:
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.context.window.scene = bpy.data.scenes.new("Other")

    done = meanwhile(moment, leave)
    assert "in Edit Mode, which was left" in done.said[-1]
    bpy.context.window.scene = bpy.data.scenes["Scene"]
    assert_small(anna, OLDER_ANNA)


def test_a_head_in_sculpt_mode_beside_the_active_object_is_made_whole(
    clips: Clips, grown: Callable[[], None], meanwhile: Any
) -> None:
    anna = run(clips.anna)
    grown()

    def sculpt() -> None:
        bpy.ops.object.mode_set(mode="SCULPT")
        # As with Lock Object Modes off.
        bpy.context.view_layer.objects.active = head_of(anna).parts["tongue"]

    meanwhile("working", sculpt)
    assert anna.mode == "OBJECT"
    assert_small(anna, OLDER_ANNA)


@pytest.mark.parametrize("moment", MOMENTS)
def test_pose_mode_of_an_artists_rig_is_left_and_said(clips: Clips, meanwhile: Any, moment: str) -> None:
    bpy.context.scene.facewright_clip.path = clips.anna
    rig = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.scene.collection.objects.link(rig)

    def pose() -> None:
        select(rig)
        bpy.ops.object.mode_set(mode="POSE")

    done = meanwhile(moment, pose)
    assert "Rig was in Pose Mode" in done.said[-1]
    assert_small(bpy.context.object, ANNA)


@pytest.mark.parametrize("moment", MOMENTS)
def test_everything_may_be_renamed_meanwhile(
    clips: Clips, grown: Callable[[], None], meanwhile: Any, moment: str
) -> None:
    anna, ben = run(clips.anna), run(clips.ben)
    bpy.context.scene.facewright_clip.path = clips.anna
    grown()

    def rename() -> None:
        kinds = ("objects", "meshes", "shape_keys", "materials", "images", "collections", "scenes")
        things = [data for kind in kinds for data in getattr(bpy.data, kind)]
        for number, data in enumerate(things):
            data.name = f"Thing {number}"
        ben.name = "Face"

    before = snapshot()
    meanwhile(moment, rename)
    assert snapshot() == before, "nothing new was made for want of a name"
    assert_small(anna, OLDER_ANNA)
    assert_small(ben, BEN)


@pytest.mark.parametrize("moment", MOMENTS)
@pytest.mark.parametrize("part", ["skin", "eye_left", "tongue"])
def test_a_part_deleted_meanwhile_comes_back(
    clips: Clips, grown: Callable[[], None], meanwhile: Any, moment: str, part: str
) -> None:
    anna = run(clips.anna)
    grown()
    meanwhile(moment, lambda: bpy.data.objects.remove(head_of(anna).parts[part]))
    (head,) = heads()
    assert set(head.parts) == set(VERTICES)
    assert_small(head.skin, OLDER_ANNA)


@pytest.mark.parametrize("moment", MOMENTS)
def test_a_head_deleted_with_its_collection_meanwhile_is_a_new_one_and_no_other_is_touched(
    clips: Clips, grown: Callable[[], None], meanwhile: Any, moment: str
) -> None:
    older, anna = run(clips.anna), run(clips.anna, head="NEW")
    before = of_head(older)
    grown()

    def delete() -> None:
        home = head_of(anna).home
        for obj in head_of(anna).objects:
            bpy.data.objects.remove(obj)
        bpy.data.collections.remove(home)

    done = meanwhile(moment, delete)
    assert "the head that this was for is gone: it is a new one" in done.said[-1]
    assert len(heads()) == 2
    assert_small(bpy.context.object, OLDER_ANNA)
    assert difference(before, of_head(older)) == "", "another head of the same clip is as it was"


@pytest.mark.parametrize("moment", MOMENTS)
@pytest.mark.parametrize("kind", ["images", "materials", "meshes", "collections"])
def test_looks_meshes_and_collections_deleted_meanwhile_come_back(
    clips: Clips, grown: Callable[[], None], meanwhile: Any, moment: str, kind: str
) -> None:
    run(clips.anna)
    grown()

    def delete() -> None:
        for data in list(getattr(bpy.data, kind)):
            getattr(bpy.data, kind).remove(data)

    meanwhile(moment, delete)
    made = bpy.context.object
    assert faults(VERTICES) == []
    assert round(size(made), 3) == OLDER_ANNA.size
    assert set(head_of(made).parts) == set(VERTICES)
    if kind != "images":
        assert reds(made) == {OLDER_ANNA.red}


@pytest.mark.parametrize("moment", MOMENTS)
def test_a_head_goes_into_the_scene_in_which_its_work_began(clips: Clips, meanwhile: Any, moment: str) -> None:
    scene, window, elsewhere = bpy.context.scene, bpy.context.window, bpy.data.scenes.new("Other")
    window.scene = elsewhere
    run(clips.anna)
    elsewhere.facewright_clip.path = clips.ben
    window.scene = scene
    scene.facewright_clip.path = clips.anna

    def leave() -> None:
        window.scene = elsewhere

    done = meanwhile(moment, leave)
    assert "it is in the scene Scene, in which it began" in done.said[-1]
    (other,) = heads()
    assert_small(other.skin, ANNA)
    assert bpy.context.scene.name == "Other", "the window stays where it is"
    bpy.context.window.scene = scene
    (made,) = heads()
    assert made.skin != other.skin and made.home.name in scene.collection.children
    assert_small(made.skin, ANNA)


@pytest.mark.parametrize("moment", MOMENTS)
def test_a_head_whose_scene_is_deleted_meanwhile_is_made_in_the_present_one(
    clips: Clips, meanwhile: Any, moment: str
) -> None:
    bpy.context.scene.facewright_clip.path = clips.anna

    def delete() -> None:
        gone = bpy.context.scene
        bpy.context.window.scene = bpy.data.scenes.new("Other")
        bpy.data.scenes.remove(gone)

    done = meanwhile(moment, delete)
    assert "the scene in which this began is gone, so it is in Other" in done.said[-1]
    (made,) = heads()
    assert_small(made.skin, ANNA)


@pytest.mark.parametrize("moment", MOMENTS)
def test_what_is_undone_meanwhile_is_undone_and_the_head_is_made(
    clips: Clips, grown: Callable[[], None], meanwhile: Any, moment: str
) -> None:
    anna = run(clips.anna)
    bpy.ops.ed.undo_push(message="Head")
    anna.location.x = 1.0
    bpy.ops.ed.undo_push(message="Moved")
    grown()
    meanwhile(moment, bpy.ops.ed.undo)
    (made,) = heads()
    assert made.skin.location.x == 0.0
    assert_small(made.skin, OLDER_ANNA)
    bpy.ops.ed.undo()
    (back,) = heads()
    assert_small(back.skin, ANNA)
    bpy.ops.ed.redo()
    (again,) = heads()
    assert_small(again.skin, OLDER_ANNA)


@pytest.mark.parametrize("moment", MOMENTS)
def test_a_head_whose_making_is_undone_meanwhile_is_made_anew(
    clips: Clips, grown: Callable[[], None], meanwhile: Any, moment: str
) -> None:
    bpy.context.scene.facewright_clip.path = clips.anna
    bpy.ops.ed.undo_push(message="Before")
    run(clips.anna)
    bpy.ops.ed.undo_push(message="Head")
    grown()
    meanwhile(moment, bpy.ops.ed.undo)
    (made,) = heads()
    assert_small(made.skin, OLDER_ANNA)
    bpy.ops.ed.undo()
    assert heads() == []


@pytest.mark.parametrize("moment", MOMENTS)
def test_what_is_chosen_meanwhile_stays_chosen(clips: Clips, meanwhile: Any, moment: str) -> None:
    settings = bpy.context.scene.facewright_clip
    settings.path = clips.anna

    def choose() -> None:
        settings.path = clips.ben

    meanwhile(moment, choose)
    assert settings.head == "NEW", "another clip is for another head"
    anna = bpy.context.object
    ben = run(clips.ben)
    assert ben != anna
    assert_small(anna, ANNA)
    assert_small(ben, BEN)


@pytest.mark.parametrize("moment", MOMENTS)
def test_results_go_into_the_folder_that_was_set_when_the_work_began(
    clips: Clips, meanwhile: Any, moment: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings, folders = bpy.context.scene.facewright_clip, []
    monkeypatch.setattr(module("reconstruct.actions"), "write", lambda _result, folder: folders.append(folder) or "")
    settings.path, settings.output = clips.anna, str(tmp_path / "first")

    def change() -> None:
        settings.output = str(tmp_path / "second")

    meanwhile(moment, change)
    assert folders == [str(tmp_path / "first")]


def test_a_result_that_cannot_be_written_is_a_head_all_the_same(
    clips: Clips, meanwhile: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def write(_folder: str) -> None:
        raise module("engine").FacewrightError("the disk is full")

    full = SimpleNamespace(**vars(small(ANNA)) | {"write": write})
    monkeypatch.setattr(module("reconstruct.actions"), "reconstruct", lambda *_frames, **_settings: Finished(full))
    settings = bpy.context.scene.facewright_clip
    settings.path, settings.output = clips.anna, str(tmp_path / "results")
    done = meanwhile("working", lambda: None)
    assert "The files of the result are not written: the disk is full" in done.said
    assert_small(bpy.context.object, ANNA)


@pytest.mark.parametrize("moment", ["begun", "working"])
@pytest.mark.parametrize("leave", ["new", "open", "revert"])
def test_another_file_ends_the_work_and_gets_nothing_of_it(
    clips: Clips, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, moment: str, leave: str
) -> None:
    run(clips.ben)
    reopened(tmp_path / "ben.blend")
    bpy.context.scene.facewright_clip.path = clips.anna
    done = begun(monkeypatch, RECONSTRUCT)
    work = done.operator._work
    if moment == "working":
        done.step()
    if leave == "new":
        bpy.ops.wm.read_homefile(use_empty=True)
    elif leave == "open":
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "ben.blend"))
    else:
        bpy.ops.wm.revert_mainfile()
    assert not module("modal").Running.active, "the buttons are not grey"
    with pytest.raises(StopIteration):
        next(work)
    assert [head.skin.name for head in heads()] == ([] if leave == "new" else ["Face"])
    bpy.context.scene.facewright_clip.path = clips.anna
    assert RECONSTRUCT.poll()


@pytest.mark.parametrize("moment", MOMENTS)
def test_esc_changes_nothing_at_any_moment(clips: Clips, monkeypatch: pytest.MonkeyPatch, moment: str) -> None:
    run(clips.anna)
    before, done = state(), begun(monkeypatch, RECONSTRUCT)
    monkeypatch.setattr(module("modal"), "busy_with", lambda _context: "done, let go of the mouse")
    for _ in range({"begun": 0, "working": 1, "delivered": 6}[moment]):
        done.step()
    assert done.step(ESC) == {"CANCELLED"}
    assert difference(before, state()) == "" and not module("modal").Running.active


def test_a_result_waits_for_a_render(clips: Clips, monkeypatch: pytest.MonkeyPatch) -> None:
    bpy.context.scene.facewright_clip.path = clips.anna
    done, modal = begun(monkeypatch, RECONSTRUCT), module("modal")
    with monkeypatch.context() as rendering:
        app = SimpleNamespace(is_job_running=lambda kind: kind == "RENDER")
        rendering.setattr(module("delivery"), "bpy", SimpleNamespace(app=app))
        for _ in range(6):
            assert done.step() == {"RUNNING_MODAL"}
        assert modal.Running.progress.stage == "done, waits for the render"
        assert not heads(), "the pictures that it reads stay"
    assert done.end() == {"FINISHED"}
    assert_small(bpy.context.object, ANNA)


@pytest.mark.parametrize("fails", ["work", "finish"])
def test_work_that_fails_in_an_unforeseen_way_ends_and_says_so(
    clips: Clips, monkeypatch: pytest.MonkeyPatch, fails: str
) -> None:
    bpy.context.scene.facewright_clip.path = clips.anna
    bpy.ops.ed.undo_push(message="Before")
    before = state()

    def fail(*_given: Any, **_more: Any) -> Any:
        raise ReferenceError("StructRNA has been removed")

    monkeypatch.setattr(
        *((Finished, "progress", fail) if fails == "work" else (module("scene.heads"), "remember", fail))
    )
    done = begun(monkeypatch, RECONSTRUCT)
    # What has changed half can be undone as one step.
    assert done.end() == ({"CANCELLED"} if fails == "work" else {"FINISHED"})
    assert "StructRNA has been removed" in done.said[-1] and not module("modal").Running.active
    if fails == "finish":
        bpy.ops.ed.undo()
    assert difference(before, state()) == ""


def test_the_extension_turned_off_during_work_is_not_at_work_when_it_is_turned_on(
    clips: Clips, monkeypatch: pytest.MonkeyPatch, addon: Any
) -> None:
    bpy.context.scene.facewright_clip.path = clips.anna
    begun(monkeypatch, RECONSTRUCT)
    addon.unregister()
    addon.register()
    assert not module("modal").Running.active


@pytest.mark.parametrize("moment", MOMENTS)
def test_tracks_go_to_their_clip_however_it_is_called_then(
    clip: bpy.types.MovieClip, library: Callable[..., Any], meanwhile: Any, moment: str
) -> None:
    library()
    name = clip.name

    def rename() -> None:
        clip.name = "Take 1"
        bpy.data.movieclips.load(clip.filepath).name = name

    meanwhile(moment, rename, bpy.ops.facewright.track)
    assert len(clip.tracking.objects["Face"].tracks) == 12
    assert "Face" not in bpy.data.movieclips[name].tracking.objects


@pytest.mark.parametrize("moment", MOMENTS)
def test_tracks_of_a_clip_that_is_removed_meanwhile_are_refused(
    clip: bpy.types.MovieClip, library: Callable[..., Any], meanwhile: Any, moment: str
) -> None:
    library()
    done = meanwhile(moment, lambda: bpy.data.movieclips.remove(clip), bpy.ops.facewright.track)
    assert "the movie clip was removed" in done.said[-1]


@pytest.mark.parametrize("moment", MOMENTS)
def test_a_motion_goes_into_the_scene_and_to_the_clip_with_which_it_began(
    tracked: bpy.types.MovieClip, monkeypatch: pytest.MonkeyPatch, meanwhile: Any, moment: str
) -> None:
    from moving import parsed as motion
    from moving import solution

    monkeypatch.setattr(module("motion.actions"), "solve_motion", lambda *_t, **_s: Finished(motion(solution())))
    scene = bpy.context.scene

    def leave() -> None:
        tracked.name = "Take 1"
        bpy.context.window.scene = bpy.data.scenes.new("Other")

    done = meanwhile(moment, leave, bpy.ops.facewright.motion)
    assert "it is in the scene Scene, in which it began" in done.said[-1]
    assert module("motion.actions").known(scene) is not None
    assert module("motion.actions").known(bpy.data.scenes["Other"]) is None


def test_the_librarys_own_work_goes_on_through_all_of_that(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Slow: a real head is made of the synthetic person's frames, by the library's threads."""
    scene, window = bpy.context.scene, bpy.context.window
    scene.facewright_clip.path, scene.facewright_clip.texture_size = str(ROOT / "tests/data/clip/frames"), "1024"
    bpy.ops.ed.undo_push(message="Clip")
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.ed.undo_push(message="Cube")
    done = begun(monkeypatch, RECONSTRUCT)
    done.step()
    bpy.ops.ed.undo()
    bpy.ops.ed.redo()
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "meanwhile.blend"), copy=True)
    window.scene = bpy.data.scenes.new("Other")
    assert done.end(pause_s=0.05) == {"FINISHED"}, done.said
    assert "it is in the scene Scene, in which it began" in done.said[-1]
    assert not heads() and "Cube was in Edit Mode, which was left" in done.said[-1]
    window.scene = bpy.data.scenes["Scene"]
    (made,) = heads()
    assert len(made.skin.data.shape_keys.key_blocks) == 68 and set(made.parts) == set(VERTICES)
    assert faults({name: len(obj.data.vertices) for name, obj in made.parts.items()}) == []


@pytest.fixture
def video(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A video that Blender decodes, of Anna."""
    folder = tmp_path / "Anna"
    folder.mkdir()
    numbered_clip(folder / "clip.mp4", 24)
    bpy.ops.wm.read_homefile(use_empty=True)
    monkeypatch.setattr(module("reconstruct.actions"), "reconstruct", lambda *_f, **_s: Finished(small(ANNA)))
    monkeypatch.setattr(module("scene.video"), "is_decoded_by_library", lambda _path: False)
    monkeypatch.setattr(module("scene.video"), "check_face", lambda *_frames: Finished())
    monkeypatch.setattr(module("scene.video"), "STEP_SECONDS", 0.0)
    return str(folder / "clip.mp4")


def decoding(monkeypatch: pytest.MonkeyPatch, path: str) -> Run:
    """Work that has decoded a few frames."""
    bpy.context.scene.facewright_clip.path = path
    bpy.ops.ed.undo_push(message="Chosen")
    bpy.context.scene.frame_set(7)
    bpy.ops.ed.undo_push(message="Frame")
    done = begun(monkeypatch, RECONSTRUCT)
    for _ in range(5):
        done.step()
    assert module("modal").Running.progress.stage == "decode" and len(bpy.data.scenes) == 2
    return done


def test_an_undo_while_frames_are_decoded_neither_stops_it_nor_leaves_anything(
    video: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = decoding(monkeypatch, video)
    bpy.ops.ed.undo_push(message="Something, with the scene that is decoded in")
    bpy.ops.ed.undo()
    bpy.ops.ed.undo()
    assert len(bpy.data.scenes) == 1 and bpy.context.scene.frame_current == 1
    assert done.end() == {"FINISHED"}
    assert_small(bpy.context.object, ANNA)
    assert len(bpy.data.scenes) == 1


def test_a_step_that_holds_the_scene_of_decoding_does_not_bring_it_back(
    video: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = decoding(monkeypatch, video)
    bpy.ops.ed.undo_push(message="Something")
    assert done.end() == {"FINISHED"}
    bpy.ops.ed.undo()
    assert [scene.name for scene in bpy.data.scenes] == ["Scene"] and not heads()


def test_a_file_saved_while_frames_are_decoded_opens_without_the_scene_of_that(
    video: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    decoding(monkeypatch, video)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "meanwhile.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "meanwhile.blend"))
    assert [scene.name for scene in bpy.data.scenes] == ["Scene"]
    assert not module("modal").Running.active


def test_deleting_the_scene_of_decoding_does_not_stop_it(video: str, monkeypatch: pytest.MonkeyPatch) -> None:
    done = decoding(monkeypatch, video)
    bpy.data.scenes.remove(bpy.data.scenes["Facewright decoding"])
    assert done.end() == {"FINISHED"}
    assert_small(bpy.context.object, ANNA)
