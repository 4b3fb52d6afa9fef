"""The tests in a real Blender window: each in a fresh session, by mouse and keyboard alone.

A failure leaves `NAME-failed.png` and `NAME.log` in the results. The last line is `N passed, N failed`.
"""

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

import listed
from desktop import Desktop
from session import ANSWER_SECONDS, Session, Setup, State, Unexpected, expect

RECONSTRUCT = "bpy.ops.facewright.reconstruct()"
TRACK = "bpy.ops.facewright.track()"
SOLVE = "bpy.ops.facewright.motion()"
LOOK_THROUGH = "bpy.ops.facewright.look_through()"
CALIBRATE = "bpy.ops.facewright.calibrate()"
OPEN_REPORT = "bpy.ops.facewright.open_report()"
SAVE_DRAWING = "bpy.ops.facewright.save_calibration_picture()"
CLIP_FIELD = 'bpy.data.scenes["Scene"].facewright_clip.path'
ADD_CONTROLS = "bpy.ops.facewright.add_controls()"
# How far a handle is dragged, pixels.
DRAG = 12
CLICK = 'bpy.data.scenes["Scene"].facewright_clip.click'
HAPPINESS = 'bpy.ops.facewright.expression(name="happiness")'
# Far beyond what a run takes on a slow machine.
RUN_SECONDS = 600
# Basis, the ARKit keys, the visemes.
KEYS = 1 + 52 + 15
MIN_TRACKS = 60
# As far as the panels go that are above the table.
NOTCHES = 18
# From the left border of a side bar to where nothing is drawn.
EDGE = 4
OWN_CAMERA = "Own Camera"
SUFFIXES = ("", " eye_left", " eye_right", " teeth_upper", " teeth_lower", " tongue", " lashes")
PARTS, SECOND_PARTS = ({f"object {face}{suffix}" for suffix in SUFFIXES} for face in ("Face", "Face.001"))
MOTION = {"object Face Head", "object Face Camera", "object Face Points", "action Face Camera"}


def start(session: Session, command: str) -> State:
    """Click a button and see the job at work; the state before."""
    before = session.settled()
    session.click_button(command)
    session.wait("the click starts the job", ANSWER_SECONDS, lambda s: s["running"])
    session.wait("the panel shows progress", RUN_SECONDS, lambda s: s["running"] and s["fraction"] > 0.0)
    return before


def finish(session: Session, command: str) -> State:
    """Click a button and wait for what the job makes; the state after."""
    start(session, command)
    session.wait("the job ends", RUN_SECONDS, lambda s: not s["running"])
    return session.settled()


def stop(session: Session, command: str, pictures: str) -> None:
    """Click a button and press Esc when the job has come some way; the pictures' names begin as told."""
    before = start(session, command)
    session.wait("the bar grows", RUN_SECONDS, lambda s: s["fraction"] > 0.2)
    session.picture(f"{pictures}running")
    press_escape(session, before)
    session.picture(f"{pictures}cancelled")


def press_escape(session: Session, before: State) -> None:
    """Stop the running job and see that it was in vain."""
    session.desktop.press("Escape")
    expect_stopped(session, before)


def expect_stopped(session: Session, before: State) -> None:
    session.wait("Esc stops the job", ANSWER_SECONDS, lambda s: not s["running"])
    after = session.settled()
    expect(after["data"] == before["data"], f"Esc left something changed: {difference(before, after)}")
    expect(after["undo_steps"] == before["undo_steps"], "Esc left an undo step")


def esc_changes_nothing(session: Session) -> None:
    stop(session, RECONSTRUCT, "")


def esc_while_it_tracks_changes_nothing(session: Session) -> None:
    stop(session, TRACK, "tracks-")


def one_click_makes_a_head_that_one_undo_takes_away(session: Session) -> None:
    before = session.settled()
    made = finish(session, RECONSTRUCT)
    expect(made["data"].keys() >= PARTS, f"parts are missing: {difference(before, made)}")
    expect(made["shape_keys"]["Face"] == KEYS, f"Face has {made['shape_keys']['Face']} shape keys instead of {KEYS}")
    expect_one_step(before, made)
    session.picture("reconstructed")
    session.picture_of_editor("panel")
    press_escape(session, start(session, RECONSTRUCT))
    undo(session, "ctrl+z", before)
    session.picture("undone")
    undo(session, "ctrl+shift+z", made)


def frames_are_chosen_with_the_eyes(session: Session) -> None:
    session.wait("the clip is looked at unasked", ANSWER_SECONDS, lambda s: s["clip"]["looked"])
    session.picture_of_editor("frames")
    pick(session, 3)
    session.wait("the part begins there", ANSWER_SECONDS, lambda s: s["clip"]["part"] == [3, 20])
    session.click_button(CLICK, (0.75,))
    pick(session, 10)
    session.wait("its stretch is left out", ANSWER_SECONDS, lambda s: s["clip"]["left_out"] == "10")
    pick(session, 16)
    session.wait("so is another", ANSWER_SECONDS, lambda s: s["clip"]["left_out"] == "10,16")
    pick(session, 16)
    session.wait("it is taken in again", ANSWER_SECONDS, lambda s: s["clip"]["left_out"] == "10")
    session.glance()
    session.picture_of_editor("frames-chosen")
    made = finish(session, RECONSTRUCT)
    expect(made["clip"]["given"] == [17], f"the head is made from {made['clip']['given']} frames")
    session.picture_of_editor("frames-folded")


def pick(session: Session, number: int) -> None:
    """Click on a frame of the strip."""
    session.click_button(f"bpy.ops.facewright.pick_frame(number={number})", (0.1, 0.3, 0.5, 0.7, 0.9))


def an_expression_is_a_click_and_an_undo_step(session: Session) -> None:
    made = finish(session, RECONSTRUCT)
    session.click_button(HAPPINESS)
    session.wait("the face smiles", ANSWER_SECONDS, lambda s: s["smiles"]["Face"] > 0.3)
    session.glance()
    session.picture("happiness")
    undo(session, "ctrl+z", made)
    expect(session.glance()["smiles"]["Face"] == 0.0, "the undone smile is still there")


def a_handle_is_dragged_and_its_key_moves(session: Session) -> None:
    made = finish(session, RECONSTRUCT)
    scroll_down(session)
    session.click_button(ADD_CONTROLS)
    session.wait("the handles can be posed", ANSWER_SECONDS, lambda s: s["mode"] == "POSE" and s["handle"])
    added = session.settled()
    expect_one_step(made, added)
    session.picture("controls")
    across, up = added["handle"]
    session.desktop.point(across, added["height"] - up)
    session.desktop.click()
    chosen = session.settled()
    expect_one_step(added, chosen)
    session.desktop.press("g")
    session.desktop.point(across, added["height"] - up - DRAG)
    smiling = session.wait("the mouth's corner rises", ANSWER_SECONDS, lambda s: s["smiles"]["Face"] > 0.3)
    session.desktop.click()
    session.settled()
    session.picture("controls-dragged")
    expect(smiling["handle"] != added["handle"], "the handle is where it was")
    session.desktop.press("ctrl+z")
    session.wait("the mouth is at rest", ANSWER_SECONDS, lambda s: s["smiles"]["Face"] == 0.0)
    session.desktop.press("ctrl+z")
    session.settled()
    undo(session, "ctrl+z", made)
    expect(not session.glance()["handle"], "the undone controls are still there")


def scroll_down(session: Session) -> None:
    """Bring the lower panels of the side bar into sight."""
    left, top, width, height = session.rectangle("side_bar")
    session.desktop.point(left + width // 2, top + height // 2)
    session.desktop.turn_wheel(20)
    session.glance()


def a_second_person_is_a_second_head(session: Session) -> None:
    first = finish(session, RECONSTRUCT)
    session.type_into(CLIP_FIELD, str(session.mirrored_clip()))
    session.wait("another clip is for a new head", ANSWER_SECONDS, lambda s: s["head"] == "NEW")
    both = finish(session, RECONSTRUCT)
    expect(both["data"].keys() >= SECOND_PARTS, f"parts are missing: {difference(first, both)}")
    expect_same(PARTS, first, both)
    session.picture("two-heads")
    session.click_button(HAPPINESS)
    smiling = session.wait("the new head smiles", ANSWER_SECONDS, lambda s: s["smiles"]["Face.001"] > 0.3)
    expect(smiling["smiles"]["Face"] == 0.0, "the first head smiles with it")
    choose_first_head(session)
    updated = finish(session, RECONSTRUCT)
    expect_same(SECOND_PARTS, both, updated)
    expect(updated["data"].keys() == both["data"].keys(), f"it is not updated: {difference(both, updated)}")
    expect(updated["data"]["object Face"] != both["data"]["object Face"], "the first head is not what the clip shows")
    session.picture("two-heads-updated")
    session.picture_of_editor("panel-of-two")


def choose_first_head(session: Session) -> None:
    """Click the first head in the list instead of the second."""
    listed.choose(session, 0, "Face")


def heads_are_chosen_named_copied_and_removed_in_the_list(session: Session) -> None:
    first = finish(session, RECONSTRUCT)
    copied = listed.duplicate(session)
    listed.expect_alike(copied, "Face", "Face.001")
    expect_same(PARTS, first, copied)
    expect_one_step(first, copied)
    session.picture("heads-duplicated")
    undo(session, "ctrl+z", first)
    undo(session, "ctrl+shift+z", copied)
    chosen = listed.choose(session, 0, "Face")
    expect(chosen["data"] == copied["data"], f"a click changes {difference(copied, chosen)}")
    session.click_button(HAPPINESS)
    smiling = session.wait("the chosen head smiles", ANSWER_SECONDS, lambda s: s["smiles"]["Face"] > 0.3)
    expect(smiling["smiles"]["Face.001"] == 0.0, "the copy smiles with it")
    listed.choose(session, 1, "Face.001")
    before = session.settled()
    named = listed.rename(session, 1, "Twin")
    expect({"object Twin", "object Twin tongue", "image Twin skin"} <= named["data"].keys(), "not all is called Twin")
    # The first of the two clicks is a choice, and a step, too.
    undo(session, "ctrl+z", before)
    undo(session, "ctrl+shift+z", named)
    session.picture_of_editor("heads-list")
    before_removal = session.settled()
    removed = listed.remove(session)
    expect(removed["data"].keys() >= PARTS, "the other head is gone too")
    expect(not any("Twin" in name for name in removed["data"]), "something of the head is left")
    expect_one_step(before_removal, removed)
    undo(session, "ctrl+z", before_removal)
    session.picture_of_editor("heads-restored")
    undo(session, "ctrl+shift+z", removed)


def expect_same(parts: set[str], before: State, after: State) -> None:
    """Objects are what they were."""
    for part in sorted(parts):
        expect(before["data"][part] == after["data"].get(part), f"{part} is not what it was")


def a_head_is_seen_at_once_before_what_stands_in_its_place(session: Session) -> None:
    point_at_view(session)
    session.desktop.press("alt+h")
    finish(session, RECONSTRUCT)
    seen = session.wait("the view has turned to the head", ANSWER_SECONDS, lambda s: s["heads_seen"][0] > 0.4)
    expect(seen["colours"] == ["TEXTURE"], f"the view shows {seen['colours'][0]} colours")
    session.picture("seen-at-once")


def a_head_grows_while_it_works_and_esc_takes_it_away(session: Session) -> None:
    before = start(session, RECONSTRUCT)
    grown = session.wait("a first head is drawn", RUN_SECONDS, lambda s: s["sketched"])
    expect(grown["looks"] != before["looks"], "the view does not look at it")
    session.wait("its shape is sharpened", RUN_SECONDS, lambda s: s["step"] is not None and s["step"][0] >= 6)
    session.picture("growing")
    press_escape(session, before)
    expect(not session.glance()["sketched"], "the head is still drawn")
    expect(session.glance()["looks"] == before["looks"], "the view does not look where it did")
    session.picture("growing-cancelled")


def an_update_that_is_undone_gives_back_shape_and_skin(session: Session) -> None:
    made = finish(session, RECONSTRUCT)
    session.type_into(CLIP_FIELD, str(session.mirrored_clip()))
    choose_first_head(session)
    updated = finish(session, RECONSTRUCT)
    expect(updated["data"].keys() == made["data"].keys(), f"it is not updated: {difference(made, updated)}")
    for changed in ("object Face", "image Face skin", "image Face eyes"):
        expect(updated["data"][changed] != made["data"][changed], f"{changed} is not of the other person")
    undo(session, "ctrl+z", made)
    undo(session, "ctrl+shift+z", updated)
    session.picture("update-redone")


def edit_mode_entered_meanwhile_mixes_nothing(session: Session) -> None:
    made = finish(session, RECONSTRUCT)
    session.type_into(CLIP_FIELD, str(session.mirrored_clip()))
    choose_first_head(session)
    start(session, RECONSTRUCT)
    point_at_view(session)
    session.desktop.press("Tab")
    session.wait("the head is in Edit Mode", ANSWER_SECONDS, lambda s: s["mode"] == "EDIT_MESH")
    session.wait("the job ends", RUN_SECONDS, lambda s: not s["running"])
    updated = session.settled()
    expect(updated["mode"] == "OBJECT", f"Blender is in {updated['mode']}")
    session.desktop.press("Tab")
    session.wait("the head is in Edit Mode", ANSWER_SECONDS, lambda s: s["mode"] == "EDIT_MESH")
    session.desktop.press("Tab")
    session.wait("the head is out of it", ANSWER_SECONDS, lambda s: s["mode"] == "OBJECT")
    expect_same({"object Face", "image Face skin"}, updated, session.settled())
    expect(updated["data"]["object Face"] != made["data"]["object Face"], "the head is not the other person's")


def an_undo_meanwhile_is_an_undo_and_the_head_comes_all_the_same(session: Session) -> None:
    before = finish(session, RECONSTRUCT)
    point_at_view(session)
    for key in ("g", "x", "1", "Return"):
        session.desktop.press(key)
    moved = session.settled()
    expect(moved["data"]["object Face"] != before["data"]["object Face"], "the head has not been moved")
    session.type_into(CLIP_FIELD, str(session.mirrored_clip()))
    choose_first_head(session)
    start(session, RECONSTRUCT)
    point_at_view(session)
    for _ in range(3):
        session.desktop.press("ctrl+z")
    session.wait("the job ends", RUN_SECONDS, lambda s: not s["running"])
    updated = session.settled()
    expect(updated["data"].keys() == before["data"].keys(), f"it is not updated: {difference(before, updated)}")
    expect(
        updated["data"]["image Face skin"] != before["data"]["image Face skin"], "the head is not the other person's"
    )
    undo(session, "ctrl+z", before)


def a_new_file_meanwhile_ends_the_work(session: Session) -> None:
    start(session, RECONSTRUCT)
    session.wait("the bar grows", RUN_SECONDS, lambda s: s["fraction"] > 0.1)
    point_at_view(session)
    session.desktop.press("ctrl+n")
    session.desktop.press("Return")
    session.wait("the new file ends the job", ANSWER_SECONDS, lambda s: not s["running"])
    after = session.settled()
    expect(not PARTS & after["data"].keys(), "the new file has got the head")


def a_drag_is_not_disturbed(session: Session) -> None:
    finish(session, RECONSTRUCT)
    start(session, RECONSTRUCT)
    point_at_view(session)
    session.desktop.press("g")
    session.wait("the work is done", RUN_SECONDS, lambda s: s["fraction"] > 0.99)
    expect(session.glance()["running"], "the head changed while it was dragged")
    session.desktop.press("Return")
    session.wait("the job ends", ANSWER_SECONDS, lambda s: not s["running"])


def point_at_view(session: Session) -> None:
    """Move the mouse into the 3D view."""
    left, top, width, height = session.rectangle("editor")
    session.desktop.point(left + width // 4, top + height // 2)
    session.glance()


def tracking_a_clip_writes_markers_that_one_undo_takes_away(session: Session) -> None:
    before = session.settled()
    tracked = finish(session, TRACK)
    count = tracked["tracks"].get("Face", 0)
    expect(count >= MIN_TRACKS, f"the face has {count} tracks, not {MIN_TRACKS} and more")
    own = "tracks Camera"
    expect(tracked["data"][own] == before["data"][own], "the artist's own track is not what it was")
    expect_one_step(before, tracked)
    session.picture_of_editor("tracks")
    undo(session, "ctrl+z", before)
    session.picture("tracks-undone")
    undo(session, "ctrl+shift+z", tracked)


def esc_while_it_solves_changes_nothing(session: Session) -> None:
    before = finish(session, TRACK)
    session.point_at_button(SOLVE)
    # The motion is found within a second: Esc comes before anything can be seen of it.
    session.desktop.click_and_press("Escape")
    session.wait("the click starts the job", ANSWER_SECONDS, lambda s: s["stage"] != before["stage"])
    expect_stopped(session, before)


def solving_shows_the_motion_that_one_undo_takes_away(session: Session) -> None:
    before = finish(session, TRACK)
    solved = solve(session)
    expect(solved["data"].keys() >= MOTION, f"parts are missing: {difference(before, solved)}")
    expect(solved["camera"] == OWN_CAMERA, f"the scene's camera is {solved['camera']} before Look Through")
    expect_one_step(before, solved)
    session.picture("motion")
    undo(session, "ctrl+z", before)
    session.picture("motion-undone")
    undo(session, "ctrl+shift+z", solved)
    look_through(session, solved)


def solve(session: Session) -> State:
    """Click the button and wait for the motion, which may be there before the next look; the state after."""
    session.click_button(SOLVE)
    session.wait("the panel shows progress", RUN_SECONDS, lambda s: s["stage"] == "motion")
    session.glance()
    with session.held():
        session.picture("motion-running")
    session.wait("the job ends", RUN_SECONDS, lambda s: not s["running"])
    return session.settled()


def look_through(session: Session, before: State) -> None:
    """Click the button and see the scene from the motion's camera."""
    session.click_button(LOOK_THROUGH)
    session.wait("the 3D view looks through the camera", ANSWER_SECONDS, lambda s: s["views"] == ["CAMERA"])
    looked = session.settled()
    expect(looked["camera"] == "Face Camera", f"the scene's camera is {looked['camera']}")
    expect_one_step(before, looked)
    session.picture("motion-through")


def the_report_opens_as_a_text_in_one_undo_step(session: Session) -> None:
    made = finish(session, RECONSTRUCT)
    session.picture_of_editor("report-panel")
    session.click_button(OPEN_REPORT)
    shown = session.settled()
    session.picture("report-text")
    expect_one_step(made, shown)
    expect(shown["data"] == made["data"], f"the report changes something: {difference(made, shown)}")


def the_table_of_the_calibration_is_read_at_the_side_bars_usual_width(session: Session) -> None:
    """Every number of every row, whole: to be looked at in the picture."""
    session.point_at_button(CALIBRATE)
    # Beside the table, which would turn instead.
    left, top, _, height = session.rectangle("side_bar")
    session.desktop.point(left + EDGE, top + height // 2)
    session.desktop.turn_wheel(NOTCHES)
    session.point_at_button(SAVE_DRAWING)
    session.picture_of_editor("calibration-table")


def blender_closes_while_the_job_runs(session: Session) -> None:
    start(session, RECONSTRUCT)
    session.desktop.press("ctrl+q")
    code = session.ended(ANSWER_SECONDS)
    expect(code == 0, "Blender does not close" if code is None else f"Blender closed with code {code}")


def expect_one_step(before: State, after: State) -> None:
    steps = after["undo_steps"] - before["undo_steps"]
    expect(steps == 1, f"{steps} undo steps instead of one")


def undo(session: Session, keys: str, wanted: State) -> None:
    """Press keys of the undo history once and see an earlier state."""
    session.desktop.press(keys)
    after = session.settled()
    expect(after["data"] == wanted["data"], f"{keys} does not restore: {difference(wanted, after)}")


def difference(before: State, after: State) -> str:
    old, new = before["data"], after["data"]
    changed = [
        f"{name} {old.get(name)} → {new.get(name)}" for name in sorted({*old, *new}) if old.get(name) != new.get(name)
    ]
    return ", ".join(changed) or "nothing"


Test = Callable[[Session], None]

# By the editors in the window's main area; the test is about the first.
TESTS: dict[str, list[Test]] = {
    "VIEW_3D": [
        esc_changes_nothing,
        one_click_makes_a_head_that_one_undo_takes_away,
        frames_are_chosen_with_the_eyes,
        an_expression_is_a_click_and_an_undo_step,
        a_handle_is_dragged_and_its_key_moves,
        a_second_person_is_a_second_head,
        heads_are_chosen_named_copied_and_removed_in_the_list,
        a_head_is_seen_at_once_before_what_stands_in_its_place,
        a_head_grows_while_it_works_and_esc_takes_it_away,
        an_update_that_is_undone_gives_back_shape_and_skin,
        edit_mode_entered_meanwhile_mixes_nothing,
        an_undo_meanwhile_is_an_undo_and_the_head_comes_all_the_same,
        a_new_file_meanwhile_ends_the_work,
        a_drag_is_not_disturbed,
        the_report_opens_as_a_text_in_one_undo_step,
        blender_closes_while_the_job_runs,
    ],
    "VIEW_3D OPEN": [
        the_table_of_the_calibration_is_read_at_the_side_bars_usual_width,
    ],
    "CLIP_EDITOR": [
        esc_while_it_tracks_changes_nothing,
        tracking_a_clip_writes_markers_that_one_undo_takes_away,
    ],
    "CLIP_EDITOR VIEW_3D": [
        esc_while_it_solves_changes_nothing,
        solving_shows_the_motion_that_one_undo_takes_away,
    ],
}


def passes(test: Test, editors: str, desktop: Desktop, setup: Setup) -> bool:
    """Run a test in a session of its own and say how it went."""
    title, begun = test.__name__.replace("_", " "), time.monotonic()
    log = setup.out / f"{test.__name__}.log"
    try:
        with Session(desktop, setup, editors, log) as session:
            try:
                session.get_ready()
                test(session)
            except Unexpected:
                session.picture(f"{test.__name__}-failed")
                raise
    except Unexpected as reason:
        print(f"FAILED  {title}: {reason}\n        see {log} and the picture beside it", flush=True)
        return False
    print(f"ok      {title} ({time.monotonic() - begun:.0f} s)", flush=True)
    return True


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--zip", type=Path, required=True, help="the extension")
    parser.add_argument("--clip", type=Path, required=True, help="a folder with the folders frames and board")
    parser.add_argument("--out", type=Path, required=True, help="where screenshots and logs go")
    parser.add_argument("--only", default="", help="a part of the names of the tests to run")
    wanted = parser.parse_args()
    setup = Setup(wanted.zip.absolute(), wanted.clip.absolute(), wanted.out)
    for old in [*setup.out.glob("*.png"), *setup.out.glob("*.log")]:
        old.unlink()
    with Desktop() as desktop:
        tests = [(test, editors) for editors, tests in TESTS.items() for test in tests if wanted.only in test.__name__]
        results = [passes(test, editors, desktop, setup) for test, editors in tests]
    passed, failed = results.count(True), results.count(False)
    print(f"{passed} passed, {failed} failed", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
