"""The window's tests of what an artist does while the library works: Esc, undo, Edit Mode, a drag, a new file."""

from session import ANSWER_SECONDS, Session, expect
from steps import (
    CLIP_FIELD,
    PARTS,
    RECONSTRUCT,
    RUN_SECONDS,
    choose_first_head,
    difference,
    expect_same,
    finish,
    point_at_view,
    press_escape,
    start,
    stop,
    undo,
)


def esc_changes_nothing(session: Session) -> None:
    stop(session, RECONSTRUCT, "")


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


def blender_closes_while_the_job_runs(session: Session) -> None:
    start(session, RECONSTRUCT)
    session.desktop.press("ctrl+q")
    code = session.ended(ANSWER_SECONDS)
    expect(code == 0, "Blender does not close" if code is None else f"Blender closed with code {code}")
