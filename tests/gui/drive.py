"""The tests in a real Blender window: each in a fresh session, by mouse and keyboard alone.

A failure leaves `NAME-failed.png` and `NAME.log` in the results. The last line is `N passed, N failed`.
"""

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

from clip_editor import (
    esc_while_it_solves_changes_nothing,
    esc_while_it_tracks_changes_nothing,
    solving_shows_the_motion_that_one_undo_takes_away,
    tracking_a_clip_writes_markers_that_one_undo_takes_away,
)
from desktop import Desktop
from film import Film, measure
from hour import from_the_zip_to_a_textured_head_in_view, the_hour
from many_heads import (
    a_second_person_is_a_second_head,
    an_update_that_is_undone_gives_back_shape_and_skin,
    heads_are_chosen_named_copied_and_removed_in_the_list,
)
from meanwhile import (
    a_drag_is_not_disturbed,
    a_head_grows_while_it_works_and_esc_takes_it_away,
    a_new_file_meanwhile_ends_the_work,
    an_undo_meanwhile_is_an_undo_and_the_head_comes_all_the_same,
    blender_closes_while_the_job_runs,
    edit_mode_entered_meanwhile_mixes_nothing,
    esc_changes_nothing,
)
from session import ANSWER_SECONDS, Session, Setup, Unexpected, expect
from side_bar import (
    a_handle_is_dragged_and_its_key_moves,
    an_expression_is_a_click_and_an_undo_step,
    frames_are_chosen_with_the_eyes,
    the_report_opens_as_a_text_in_one_undo_step,
    the_table_of_the_calibration_is_read_at_the_side_bars_usual_width,
)
from steps import PARTS, RECONSTRUCT, difference, expect_one_step, finish, point_at_view, press_escape, start, undo
from two_windows import a_head_comes_into_its_scene_beside_another, a_window_that_is_closed_ends_its_work

# Basis, the ARKit keys, the visemes.
KEYS = 1 + 52 + 15


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


def a_head_is_seen_at_once_before_what_stands_in_its_place(session: Session) -> None:
    point_at_view(session)
    session.desktop.press("alt+h")
    finish(session, RECONSTRUCT)
    seen = session.wait("the view has turned to the head", ANSWER_SECONDS, lambda s: s["heads_seen"][0] > 0.4)
    expect(seen["colours"] == ["TEXTURE"], f"the view shows {seen['colours'][0]} colours")
    session.picture("seen-at-once")


Test = Callable[[Session], None]

# By the editors in the window's main area; the test is about the first.
TESTS: dict[str, list[Test]] = {
    # Blender as it starts, without the extension.
    "": [
        from_the_zip_to_a_textured_head_in_view,
        the_hour,
    ],
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
        *(a_head_comes_into_its_scene_beside_another, a_window_that_is_closed_ends_its_work),
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


def of_film(film: Film) -> Test:
    """The measurement of a film as a test."""

    def the_time_that_a_film_takes(session: Session) -> None:
        measure(session, film)

    return the_time_that_a_film_takes


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
    parser.add_argument(
        "--film", type=Path, help="also measure how long this film takes; a video or a folder of frames"
    )
    parser.add_argument("--first", type=int, default=0, help="its first frame that is used")
    parser.add_argument("--last", type=int, default=0, help="its last one")
    parser.add_argument("--only", default="", help="a part of the names of the tests to run")
    wanted = parser.parse_args()
    setup = Setup(wanted.zip.absolute(), wanted.clip.absolute(), wanted.out)
    for old in [file for kind in ("*.png", "*.log", "*.glb", "*.json") for file in setup.out.glob(kind)]:
        old.unlink()
    with Desktop() as desktop:
        tests = [(test, editors) for editors, tests in TESTS.items() for test in tests if wanted.only in test.__name__]
        if wanted.film:
            tests.append((of_film(Film(wanted.film.absolute(), wanted.first, wanted.last)), ""))
        results = [passes(test, editors, desktop, setup) for test, editors in tests]
    if not wanted.film:
        print("skipped the time that a film takes: none is given by --film", flush=True)
    passed, failed = results.count(True), results.count(False)
    print(f"{passed} passed, {failed} failed", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
