"""The window's tests of the panels: frames, expressions, controls, report and calibration."""

from session import ANSWER_SECONDS, Session, expect
from steps import HAPPINESS, RECONSTRUCT, difference, expect_one_step, finish, undo

# What a click on a frame does, and where in the side bar's width its choices are.
CLICK = 'bpy.data.scenes["Scene"].facewright_clip.click'
A_LAST_FRAME, LEAVE_OUT = 0.4, 0.75
ADD_CONTROLS = "bpy.ops.facewright.add_controls()"
CALIBRATE = "bpy.ops.facewright.calibrate()"
OPEN_REPORT = "bpy.ops.facewright.open_report()"
SAVE_DRAWING = "bpy.ops.facewright.save_calibration_picture()"
# How far a handle is dragged, pixels.
DRAG = 12
# Notches of the wheel, as far as the panels go that are above.
TO_THE_CONTROLS, TO_THE_TABLE = 20, 18


def frames_are_chosen_with_the_eyes(session: Session) -> None:
    session.wait("the clip is looked at unasked", ANSWER_SECONDS, lambda s: s["clip"]["looked"])
    session.picture_of_editor("frames")
    pick(session, 3)
    session.wait("the part begins there", ANSWER_SECONDS, lambda s: s["clip"]["part"] == [3, 20])
    session.click_button(CLICK, (LEAVE_OUT,))
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
    # The panel is below all others.
    session.scroll(TO_THE_CONTROLS)
    session.glance()
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
    session.scroll(TO_THE_TABLE)
    session.point_at_button(SAVE_DRAWING)
    session.picture_of_editor("calibration-table")
