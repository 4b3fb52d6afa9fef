"""The tests in a real Blender window: each in a fresh session, by mouse and keyboard alone.

A failure leaves `NAME-failed.png` and `NAME.log` in the results. The last line is `N passed, N failed`.
"""

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

from desktop import Desktop
from session import ANSWER_SECONDS, Session, Setup, State, Unexpected, expect

RECONSTRUCT = "bpy.ops.facewright.reconstruct()"
HAPPINESS = 'bpy.ops.facewright.expression(name="happiness")'
# Far beyond what a run takes on a slow machine.
RUN_SECONDS = 600
# Basis, the ARKit keys, the visemes.
KEYS = 1 + 52 + 15
PARTS = {
    f"object Face{name}"
    for name in ("", " eye_left", " eye_right", " teeth_upper", " teeth_lower", " tongue", " lashes")
}


def start(session: Session) -> State:
    """Click the button and see the job at work; the state before."""
    before = session.settled()
    session.click_button(RECONSTRUCT)
    session.wait("the click starts the job", ANSWER_SECONDS, lambda s: s["running"])
    session.wait("the panel shows progress", RUN_SECONDS, lambda s: s["running"] and s["fraction"] > 0.0)
    return before


def reconstruct(session: Session) -> State:
    """Click the button and wait for the head; the state after."""
    start(session)
    session.wait("the job ends", RUN_SECONDS, lambda s: not s["running"])
    return session.settled()


def press_escape(session: Session, before: State) -> None:
    """Stop the running job and see that it was in vain."""
    session.desktop.press("Escape")
    session.wait("Esc stops the job", ANSWER_SECONDS, lambda s: not s["running"])
    after = session.settled()
    expect(after["data"] == before["data"], f"Esc left something changed: {difference(before, after)}")
    expect(after["undo_steps"] == before["undo_steps"], "Esc left an undo step")


def esc_changes_nothing(session: Session) -> None:
    before = start(session)
    session.wait("the bar grows", RUN_SECONDS, lambda s: s["fraction"] > 0.2)
    session.picture("running")
    press_escape(session, before)
    session.picture("cancelled")


def one_click_makes_a_head_that_one_undo_takes_away(session: Session) -> None:
    before = session.settled()
    made = reconstruct(session)
    expect(made["data"].keys() >= PARTS, f"parts are missing: {difference(before, made)}")
    expect(made["shape_keys"]["Face"] == KEYS, f"Face has {made['shape_keys']['Face']} shape keys instead of {KEYS}")
    expect(made["undo_steps"] == before["undo_steps"] + 1, f"{made['undo_steps'] - before['undo_steps']} undo steps")
    session.picture("reconstructed")
    session.picture_of_view("panel")
    press_escape(session, start(session))
    undo(session, "ctrl+z", before)
    session.picture("undone")
    undo(session, "ctrl+shift+z", made)


def an_expression_is_a_click_and_an_undo_step(session: Session) -> None:
    made = reconstruct(session)
    session.click_button(HAPPINESS)
    session.wait("the face smiles", ANSWER_SECONDS, lambda s: s["smile"] > 0.3)
    session.glance()
    session.picture("happiness")
    undo(session, "ctrl+z", made)
    expect(session.glance()["smile"] == 0.0, "the undone smile is still there")


def blender_closes_while_the_job_runs(session: Session) -> None:
    start(session)
    session.desktop.press("ctrl+q")
    code = session.ended(ANSWER_SECONDS)
    expect(code == 0, "Blender does not close" if code is None else f"Blender closed with code {code}")


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


TESTS: list[Callable[[Session], None]] = [
    esc_changes_nothing,
    one_click_makes_a_head_that_one_undo_takes_away,
    an_expression_is_a_click_and_an_undo_step,
    blender_closes_while_the_job_runs,
]


def passes(test: Callable[[Session], None], desktop: Desktop, setup: Setup) -> bool:
    """Run a test in a session of its own and say how it went."""
    title, begun = test.__name__.replace("_", " "), time.monotonic()
    log = setup.out / f"{test.__name__}.log"
    try:
        with Session(desktop, setup, log) as session:
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
    wanted = parser.parse_args()
    setup = Setup(wanted.zip.absolute(), wanted.clip.absolute(), wanted.out)
    for old in [*setup.out.glob("*.png"), *setup.out.glob("*.log")]:
        old.unlink()
    with Desktop() as desktop:
        passed = sum([passes(test, desktop, setup) for test in TESTS])
    failed = len(TESTS) - passed
    print(f"{passed} passed, {failed} failed", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
