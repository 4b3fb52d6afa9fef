"""The window's tests of an artist with two main windows, each of which shows a scene of its own."""

from session import ANSWER_SECONDS, Session, State, expect
from steps import PARTS, RECONSTRUCT, RUN_SECONDS, difference, start

NAMES = {part.removeprefix("object ") for part in PARTS}


def a_head_comes_into_its_scene_beside_another(session: Session) -> None:
    start(session, RECONSTRUCT)
    session.order("another window with another scene")
    session.wait("the job ends", RUN_SECONDS, lambda s: not s["running"])
    made = session.settled()
    session.picture("two-windows")
    expect(made["windows"] == 2, f"there are {made['windows']} windows")
    expect(set(made["held"]["Scene"]) >= NAMES, f"the scene of the work holds {made['held']['Scene']}")
    expect(not made["held"]["Other"], f"the other scene holds {made['held']['Other']}")


def a_window_that_is_closed_ends_its_work(session: Session) -> None:
    before = start(session, RECONSTRUCT)
    session.order("another window with another scene")
    session.order("close the first window")
    session.wait("that ends the job", ANSWER_SECONDS, lambda s: s["windows"] == 1 and not s["running"])
    session.order("show the first scene")
    after = session.settled()
    expect(without_scenes(after) == without_scenes(before), f"something is changed: {difference(before, after)}")
    session.picture("one-window-left")


def without_scenes(state: State) -> dict[str, str | int]:
    """What there is, but for the other window's scene."""
    return {name: what for name, what in state["data"].items() if name != "scenes"}
