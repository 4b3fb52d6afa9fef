"""The list of heads, by mouse: a row is chosen, named, copied and removed, and each is one step."""

from session import ANSWER_SECONDS, Session, State, expect

DUPLICATE, REMOVE = "bpy.ops.facewright.duplicate_head()", "bpy.ops.facewright.remove_head()"


# All rows are buttons of this number.
ROWS = 'bpy.data.scenes["Scene"].facewright_heads.index'
ROW_HEIGHT = 20


def choose(session: Session, number: int, head: str) -> State:
    """Click a row of the list, counted from 0; the state after."""
    point_at_row(session, number)
    session.desktop.click()
    session.wait(f"{head} is chosen", ANSWER_SECONDS, lambda s: s["head"] == head)
    return session.settled()


def point_at_row(session: Session, number: int) -> None:
    left, top = session.point_at_button(ROWS)
    while session.hovers_over(ROWS, left, top - ROW_HEIGHT):
        top -= ROW_HEIGHT
    session.desktop.point(left, top + number * ROW_HEIGHT)
    session.glance()


def rename(session: Session, number: int, name: str) -> State:
    """Double-click a row of the list and type another name; the state after."""
    point_at_row(session, number)
    session.desktop.click()
    session.desktop.click()
    session.glance()
    session.desktop.press("ctrl+a")
    session.desktop.type(name)
    session.desktop.press("Return")
    session.wait(f"a head is called {name}", ANSWER_SECONDS, lambda s: name in s["smiles"])
    return session.settled()


def duplicate(session: Session) -> State:
    """Click the button beside the list; the state after."""
    before = session.settled()
    session.click_button(DUPLICATE)
    session.wait("there is one head more", ANSWER_SECONDS, lambda s: len(s["smiles"]) == len(before["smiles"]) + 1)
    return session.settled()


def remove(session: Session) -> State:
    """Click the button beside the list; the state after."""
    before = session.settled()
    session.click_button(REMOVE)
    session.wait("there is one head less", ANSWER_SECONDS, lambda s: len(s["smiles"]) == len(before["smiles"]) - 1)
    return session.settled()


def expect_alike(state: State, first: str, second: str) -> None:
    """Two heads have the same shapes and pictures."""
    data = state["data"]
    for kind in ("object {}", "object {} tongue", "image {} skin", "image {} eyes"):
        one, other = (str(data[kind.format(head)]).split()[0] for head in (first, second))
        expect(one == other, f"{kind.format(second)} is not what {kind.format(first)} is")
