"""Steps that several of the window's tests take: what is clicked, what is waited for, and what is expected."""

import listed
from session import ANSWER_SECONDS, Session, State, expect

RECONSTRUCT = "bpy.ops.facewright.reconstruct()"
CLIP_FIELD = 'bpy.data.scenes["Scene"].facewright_clip.path'
HAPPINESS = 'bpy.ops.facewright.expression(name="happiness")'
# Far beyond what a run takes on a slow machine.
RUN_SECONDS = 600
SUFFIXES = ("", " eye_left", " eye_right", " teeth_upper", " teeth_lower", " tongue", " lashes")
PARTS, SECOND_PARTS = ({f"object {face}{suffix}" for suffix in SUFFIXES} for face in ("Face", "Face.001"))


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


def choose_first_head(session: Session) -> None:
    """Click the first head in the list instead of the second."""
    listed.choose(session, 0, "Face")


def expect_same(parts: set[str], before: State, after: State) -> None:
    """Objects are what they were."""
    for part in sorted(parts):
        expect(before["data"][part] == after["data"].get(part), f"{part} is not what it was")


def point_at_view(session: Session) -> None:
    """Move the mouse into the 3D view."""
    left, top, width, height = session.rectangle("editor")
    session.desktop.point(left + width // 4, top + height // 2)
    session.glance()


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


def expect_stopped(session: Session, before: State) -> None:
    session.wait("Esc stops the job", ANSWER_SECONDS, lambda s: not s["running"])
    after = session.settled()
    expect(after["data"] == before["data"], f"Esc left something changed: {difference(before, after)}")
    expect(after["undo_steps"] == before["undo_steps"], "Esc left an undo step")
