"""The window's tests of the Clip editor: the face's tracks, and the motion that they tell."""

from session import ANSWER_SECONDS, Session, State, expect
from steps import RUN_SECONDS, difference, expect_one_step, expect_stopped, finish, stop, undo

TRACK = "bpy.ops.facewright.track()"
SOLVE = "bpy.ops.facewright.motion()"
LOOK_THROUGH = "bpy.ops.facewright.look_through()"
MIN_TRACKS = 60
OWN_CAMERA = "Own Camera"
MOTION = {"object Face Head", "object Face Camera", "object Face Points", "action Face Camera"}


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


def esc_while_it_tracks_changes_nothing(session: Session) -> None:
    stop(session, TRACK, "tracks-")


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
