"""How long a real film takes in the window; only when one is given, as none is part of the project."""

import os
import time
from dataclasses import dataclass
from pathlib import Path

from files import install_from_disk, open_tab
from hour import choose_clip, type_number
from session import ANSWER_SECONDS, Session, expect
from steps import RECONSTRUCT, RUN_SECONDS

PART_OF_THE_CLIP = 'bpy.data.scenes["Scene"].facewright_clip.use_range'
FIRST_USED = 'bpy.data.scenes["Scene"].facewright_clip.shown_first'
LAST_USED = 'bpy.data.scenes["Scene"].facewright_clip.shown_last'


@dataclass(frozen=True)
class Film:
    """A video or a folder of frames, and the first and last frame to use, counted from 0."""

    path: Path
    first: int
    last: int


def measure(session: Session, film: Film) -> None:
    """From the click on the button to the head in view, and when each step of the work began; prints the figures."""
    install_from_disk(session)
    open_tab(session)
    choose_clip(session, film.path)
    session.click_button(PART_OF_THE_CLIP)
    session.wait("a part of the clip is used", ANSWER_SECONDS, lambda s: s["clip"]["part"])
    for field, number in ((LAST_USED, film.last), (FIRST_USED, film.first)):
        session.point_at_button(field)
        type_number(session, number)
    session.wait("the frames are chosen", ANSWER_SECONDS, lambda s: s["clip"]["part"] == [film.first, film.last])
    session.point_at_button(RECONSTRUCT)
    load, begun = os.getloadavg()[0], time.monotonic()
    session.desktop.click()
    stages = stages_of(session, begun)
    seen = session.wait("the head is in view", ANSWER_SECONDS, lambda s: s["heads_seen"][0] > 0.0)
    seconds = time.monotonic() - begun
    session.picture("film")
    expect(seen["colours"] == ["TEXTURE"], f"the view shows {seen['colours'][0]} colours")
    course = ", ".join(f"{stage or 'start'} from {at:.1f}" for stage, at in stages.items())
    frames = film.last - film.first + 1
    print(
        f"        {frames} frames of {film.path.name}: {seconds:.1f} s in the window; {course}; load {load:.1f} before"
    )


def stages_of(session: Session, begun: float) -> dict[str, float]:
    """When each step of the running work was first seen, seconds after the click."""
    stages: dict[str, float] = {}
    session.wait("the click starts the job", ANSWER_SECONDS, lambda s: s["running"])
    until = time.monotonic() + RUN_SECONDS
    while (state := session.state())["running"]:
        expect(time.monotonic() < until, "the work does not end")
        stages.setdefault(state["stage"], time.monotonic() - begun)
        time.sleep(0.02)
    return stages
