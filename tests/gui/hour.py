"""An artist's hour with the extension, from its zip to a head in another program, by mouse and keyboard alone.

Slow, because nothing is skipped: Blender starts twice, two heads are made, the extension is installed as a user does
it, buttons are looked for with the mouse, every frame of the animation is looked at twice, and each step is compared
with all that there was at the steps before.
"""

import json
import time
from pathlib import Path

from files import append_collection, choose_file, install_from_disk, open_file, open_tab, save_as
from hour_checks import (
    POSES,
    expect_appended,
    expect_pose,
    expect_right_at,
    expect_same_data,
    expect_still,
    name_in_file,
)
from session import ANSWER_SECONDS, SIZE, Session, State, expect
from side_bar import A_LAST_FRAME, CLICK, pick
from steps import CLIP_FIELD, RECONSTRUCT, RUN_SECONDS, expect_same, finish, point_at_view

OPEN_CLIP = "bpy.ops.facewright.open_clip()"
AUTO_KEYING = 'bpy.data.scenes["Scene"].tool_settings.use_keyframe_insert_auto'
CURRENT_FRAME = 'bpy.data.scenes["Scene"].frame_current'
EXPORT = "bpy.ops.facewright.export()"
TIMELINE = "DOPESHEET_EDITOR HEADER"
FIRST_HEAD, SECOND_HEAD = "Face", "Face.001"
# The part of the demo clip that is used: all but a frame.
LAST = 19
MOST_CLICKS = 5
# Some frames after the last pose, and what is compared in another program: the poses, and between them.
BEYOND, COMPARED = 43, (1, 11, 20, 30, 40)
# How far the head turns from each pose to the next; where the timeline's first and last pose are on the screen.
TURN_DEGREES = 15
STEPS_BACK = 4
RULER = ((39, 762), (195, 762))


def from_the_zip_to_a_textured_head_in_view(session: Session) -> None:
    """How many clicks and seconds it takes from the installed extension to a head that is seen in its colours."""
    install_from_disk(session)
    clicks, begun = session.desktop.clicks, time.monotonic()
    open_tab(session)
    choose_clip(session, session.clip / "frames")
    make_first_head(session)
    clicks, seconds = session.desktop.clicks - clicks, time.monotonic() - begun
    session.picture("hour-head-in-view")
    print(f"        installed zip to textured head: {clicks} clicks and N, {seconds:.0f} s at this mouse's slow pace")
    expect(clicks <= MOST_CLICKS, f"it takes {clicks} clicks instead of {MOST_CLICKS}")


def the_hour(session: Session) -> None:
    install_from_disk(session)
    open_tab(session)
    session.picture("hour-02-tab")
    open_clip(session, session.clip / "frames")
    choose_part(session, LAST)
    session.picture("hour-03-clip")
    stages = [make_first_head(session)]
    session.picture("hour-04-head")
    look_from_in_front(session)
    stages += animate(session)
    scrub(session, stages, range(1, BEYOND + 1))
    stages.append(add_second_person(session, stages[-1]))
    scrub(session, stages, range(17, 24))
    go_through_history(session, stages)
    file = session.folder / "hour.blend"
    save_as(session, file)
    saved = session.settled()
    close(session)
    session.start_again()
    open_file(session, file)
    expect_same_data(saved, session.settled(), "opened again")
    session.picture("hour-10-opened-again")
    truth = export(session)
    append_collection(session, file, FIRST_HEAD)
    expect_appended(saved, session.settled())
    go_to(session, 20)
    expect_still(truth["20"], session.settled()["boxes"])
    # What was appended is selected.
    look_from_in_front(session)
    session.picture("hour-12-appended")


def choose_clip(session: Session, clip: Path) -> None:
    session.type_into(CLIP_FIELD, str(clip))


def open_clip(session: Session, frames: Path) -> None:
    """Choose the first of a folder's frames in the file browser: all of them are the clip."""
    session.click_button(OPEN_CLIP)
    choose_file(session, frames, min(frames.iterdir()).name)
    session.wait("the clip is looked at unasked", ANSWER_SECONDS, lambda s: s["clip"]["looked"])


def choose_part(session: Session, last: int) -> None:
    """Only the first frames of the clip, by a click on the last one's picture."""
    session.click_button(CLICK, (A_LAST_FRAME,))
    pick(session, last)
    session.wait("the last frame is chosen", ANSWER_SECONDS, lambda s: s["clip"]["part"] == [0, last])
    # So that the next picture shows it.
    session.settled()


def type_number(session: Session, number: int) -> None:
    """Replace the number under the mouse."""
    session.desktop.double_click()
    session.desktop.press("ctrl+a")
    session.desktop.type(str(number))
    session.desktop.press("Return")


def make_first_head(session: Session) -> State:
    made = finish(session, RECONSTRUCT)
    seen = session.wait("the view has turned to the head", ANSWER_SECONDS, lambda s: s["heads_seen"][0] > 0.4)
    expect(seen["colours"] == ["TEXTURE"], f"the view shows {seen['colours'][0]} colours")
    return made


def look_from_in_front(session: Session) -> None:
    """Turn the view to what is selected, where an expression is seen best."""
    point_at_view(session)
    session.desktop.press("KP_1")
    session.desktop.press("KP_Decimal")
    # The view turns slowly.
    time.sleep(1.0)
    session.settled()


def animate(session: Session) -> list[State]:
    """With Auto Keying on, an expression and a turn of the head at each of some frames; what there is after each."""
    session.point_in(TIMELINE, AUTO_KEYING)
    session.desktop.click()
    session.wait("auto keying is on", ANSWER_SECONDS, lambda s: s["auto_keying"])
    stages = []
    for frame, name in POSES.items():
        go_to(session, frame)
        session.click_button(f'bpy.ops.facewright.expression(name="{name}")')
        turn(session, TURN_DEGREES if stages else 0)
        stages.append(session.settled())
        expect_pose(stages[-1], FIRST_HEAD, name)
        session.picture(f"hour-05-{name}-at-{frame:02}")
    return stages


def go_to(session: Session, frame: int) -> None:
    """Type a frame's number into the timeline."""
    session.point_in(TIMELINE, CURRENT_FRAME)
    type_number(session, frame)
    at_frame(session, frame)


def turn(session: Session, degrees: int) -> None:
    """Turn what is selected about the vertical."""
    point_at_view(session)
    for key in ("r", "z"):
        session.desktop.press(key)
    session.desktop.type(str(degrees))
    session.desktop.press("Return")
    session.glance()


def scrub(session: Session, stages: list[State], frames: range) -> None:
    """Go through frames by the arrow key, then drag over the timeline: the face is right at each."""
    poses = [stage["values"][FIRST_HEAD] for stage in stages[1 : 1 + len(POSES)]]
    go_to(session, frames[0])
    point_at_view(session)
    for frame in frames:
        expect_right_at(frame, at_frame(session, frame), poses)
        session.desktop.press("Right")
    go_to(session, 1)
    session.desktop.drag(*RULER, steps=20)
    # The window is still busy with the mouse's way.
    session.settled()
    dragged = session.glance()
    expect(dragged["frame"] > 30, f"the drag over the timeline ends at frame {dragged['frame']}")
    expect_right_at(dragged["frame"], dragged, poses)


def at_frame(session: Session, frame: int) -> State:
    """The state when a frame is shown, with what moves in it."""
    session.wait(f"frame {frame} is shown", ANSWER_SECONDS, lambda s: s["frame"] == frame)
    # Blender counts the frame first, and moves everything after that.
    return session.glance()


def add_second_person(session: Session, before: State) -> State:
    """Another clip, another head: the first one stays what it was."""
    choose_clip(session, session.mirrored_clip())
    session.wait("another clip is for a new head", ANSWER_SECONDS, lambda s: s["head"] == "NEW")
    both = finish(session, RECONSTRUCT)
    first = {name for name in before["data"] if name.startswith(("object Face", "image Face", "action "))}
    expect_same(first, before, both)
    expect(set(both["values"]) == {FIRST_HEAD, SECOND_HEAD}, f"the heads are {', '.join(both['values'])}")
    step_back(session)
    session.picture("hour-07-second-person")
    return both


def go_through_history(session: Session, stages: list[State]) -> None:
    """Undo all stages, one after the other, and redo them: shapes, keys, pictures and reports are what they were."""
    point_at_view(session)
    now = session.settled()
    course = [*stages, now]
    counts = [later["undo_steps"] - sooner["undo_steps"] for sooner, later in zip(course, course[1:])]
    for count, wanted in zip(reversed(counts), reversed(stages)):
        for _ in range(count):
            session.desktop.press("ctrl+z")
        expect_same_data(wanted, session.settled(), "undone")
    session.picture("hour-08-undone")
    for count, wanted in zip(counts, course[1:]):
        for _ in range(count):
            session.desktop.press("ctrl+shift+z")
        expect_same_data(wanted, session.settled(), "redone")
    session.picture("hour-09-redone")


def step_back(session: Session) -> None:
    """See more than one head."""
    point_at_view(session)
    session.desktop.turn_wheel(STEPS_BACK)
    # The view moves slowly.
    time.sleep(1.0)
    session.settled()


def close(session: Session) -> None:
    session.desktop.press("ctrl+q")
    code = session.ended(ANSWER_SECONDS)
    expect(code == 0, "Blender does not close" if code is None else f"Blender closed with code {code}")


def export(session: Session) -> dict[str, dict[str, list[float]]]:
    """Write the first head as GLB by the panel's button; where its parts are at some frames."""
    choose_head(session)
    session.click_button(EXPORT)
    file = session.folder / "hour.glb"
    choose_file(session, file.parent, file.name)
    session.wait("the file is written", RUN_SECONDS, lambda _: file.exists())
    session.picture("hour-11-exported")
    truth = {}
    for frame in COMPARED:
        go_to(session, frame)
        boxes = session.settled()["boxes"]
        truth[str(frame)] = {name_in_file(name): box for name, box in boxes.items() if SECOND_HEAD not in name}
    session.keep("hour.glb", file.read_bytes())
    session.keep("hour.json", json.dumps(truth).encode())
    return truth


def choose_head(session: Session) -> None:
    """Look from in front, where the heads stand beside each other, step back, and click the first one."""
    look_from_in_front(session)
    step_back(session)
    session.wait("the first head is in view", ANSWER_SECONDS, lambda s: FIRST_HEAD in s["heads_at"])
    x, y = session.settled()["heads_at"][FIRST_HEAD]
    session.desktop.point(x, SIZE[1] - y)
    session.desktop.click()
    session.wait("the first head is active", ANSWER_SECONDS, lambda s: s["active"] == FIRST_HEAD)
