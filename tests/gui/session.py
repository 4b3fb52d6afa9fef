"""A Blender with a window, and what is seen and done in it."""

import json
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from desktop import SIZE, Desktop

State = dict[str, Any]

START_SECONDS = 120
ANSWER_SECONDS = 60
# The side bar is searched in steps smaller than a button is high.
SEARCH_STEP = 12
# Where in its width.
COLUMNS = (0.3, 0.7, 0.87)
# What is longer than the screen is scrolled: by so many notches of the wheel, so often.
NOTCHES, PAGES, TO_THE_TOP = 12, 4, 60
# From the left border of a side bar to where nothing is drawn.
EDGE = 4


class Unexpected(Exception):
    """What the window shows is not what it should; the message is one sentence."""


def expect(holds: bool, sentence: str) -> None:
    if not holds:
        raise Unexpected(sentence)


@dataclass(frozen=True)
class Setup:
    """What every session is made of."""

    extension: Path
    clip: Path
    out: Path


class Session:
    """Blender with the extension installed and the clip chosen, as a context; user files and state are its own.

    `editors` are Blender's names of those in the window's main area; the test is about the first. Without any it is
    Blender as it starts, with neither extension nor clip.
    """

    def __init__(self, desktop: Desktop, setup: Setup, editors: str, log: Path) -> None:
        self.desktop, self._setup, self._editors, self._log = desktop, setup, editors, log

    def __enter__(self) -> "Session":
        self._folder = Path(tempfile.mkdtemp(prefix="facewright-gui-"))
        self._state, self._question = self._folder / "state.json", self._folder / "question"
        self._questions = 0
        self.folder = self._folder / "work"
        self.folder.mkdir()
        self._places: dict[str, tuple[int, int]] = {}
        self._is_scrolled = False
        self.extension, self.clip = self._setup.extension, self._setup.clip
        self._start("w")
        return self

    def start_again(self) -> None:
        """Blender once more after it was closed, with what its user has set."""
        self._state.unlink()
        self._questions = 0
        self._question.unlink(missing_ok=True)
        self._start("a")
        self.get_ready()

    def _start(self, mode: str) -> None:
        geometry = ["--window-geometry", "0", "0", str(SIZE[0]), str(SIZE[1])]
        script = str(Path(__file__).with_name("in_blender.py"))
        # A fresh Blender's settings are the factory's too, and are kept when it ends.
        settings = ["--factory-startup"] if self._editors else []
        with self._log.open(mode) as log:
            self._blender = subprocess.Popen(
                ["blender", *settings, *geometry, "--python", script],
                env=self.desktop.environment | self._environment(),
                stdout=log,
                stderr=subprocess.STDOUT,
            )

    def get_ready(self) -> None:
        self.wait("Blender opens its window and installs the extension", START_SECONDS, lambda _: True)

    def _environment(self) -> dict[str, str]:
        return {
            "BLENDER_USER_RESOURCES": str(self._folder / "user"),
            "FACEWRIGHT_GUI_ZIP": str(self._setup.extension),
            "FACEWRIGHT_GUI_CLIP": str(self._setup.clip),
            "FACEWRIGHT_GUI_EDITORS": self._editors,
            "FACEWRIGHT_GUI_STATE": str(self._state),
        }

    def __exit__(self, *_: object) -> None:
        if self._blender.poll() is None:
            self._blender.kill()
        self._blender.wait()
        shutil.rmtree(self._folder)

    def state(self) -> State:
        """The last state that Blender wrote; empty before the first."""
        expect(self._blender.poll() is None, f"Blender ended with code {self._blender.returncode}")
        state = json.loads(self._state.read_text()) if self._state.exists() else {}
        expect("error" not in state, f"Blender could not be prepared: {state.get('error')}")
        return state

    def wait(self, what: str, seconds: float, condition: Callable[[State], bool]) -> State:
        """The first state that fulfils a condition."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            state = self.state()
            if state and condition(state):
                return state
            time.sleep(0.02)
        raise Unexpected(f"this did not happen within {seconds:.0f} s: {what}")

    def glance(self) -> State:
        """A state written after everything that was done so far."""
        seen = self.state()["tick"]
        return self.wait("Blender answers", ANSWER_SECONDS, lambda state: state["tick"] > seen + 1)

    def settled(self) -> State:
        """The same with all that was made, which takes Blender longer to tell."""
        self.glance()
        self._questions += 1
        fresh = self._question.with_suffix(".new")
        fresh.write_text(str(self._questions))
        fresh.replace(self._question)
        return self.wait("Blender tells what there is", ANSWER_SECONDS, lambda s: s["answered"] == self._questions)

    def order(self, what: str) -> State:
        """Let something be done with windows, as said in windows.py."""
        orders = self.state()["ordered"] + 1
        order = self._folder / "order"
        fresh = order.with_suffix(".new")
        fresh.write_text(f"{orders} {what}")
        fresh.replace(order)
        return self.wait(what, ANSWER_SECONDS, lambda s: s["ordered"] == orders)

    def click_button(self, command: str, columns: Sequence[float] = COLUMNS) -> None:
        """Find a button and click it."""
        self.point_at_button(command, columns)
        self.desktop.click()

    def point_at_button(self, command: str, columns: Sequence[float] = COLUMNS) -> tuple[int, int]:
        """Find a button in the editor's side bar, as the eye would: where it is, else from its top to its end.

        It is looked for in some parts of the side bar's width. Gives its place.
        """
        if self._is_still_there(command):
            return self._places[command]
        left, top, width, height = self.rectangle("side_bar")
        to_the_top = [-TO_THE_TOP] if self._is_scrolled else []
        for notches in (0, *to_the_top, *[NOTCHES] * PAGES):
            if notches:
                self.scroll(notches)
            if self._found(command, [int(left + column * width) for column in columns], range(top, top + height)):
                return self._places[command]
        raise Unexpected(f"the side bar has no button for {command}")

    def scroll(self, notches: int) -> None:
        """Turn the wheel down, or up, at the side bar's border, where no list would turn instead."""
        left, top, _, height = self.rectangle("side_bar")
        self.desktop.point(left + EDGE, top + height // 2)
        self.desktop.turn_wheel(notches)
        self._is_scrolled = notches > 0

    def _is_still_there(self, command: str) -> bool:
        """Whether a button is where it was found before."""
        return command in self._places and self.hovers_over(command, *self._places[command])

    def hovers_over(self, command: str, x: int, y: int) -> bool:
        """Whether a button is at a place of the screen, where the mouse is then."""
        self.desktop.point(x, y)
        return self.glance()["hovered"] == command

    def _found(self, command: str, across: list[int], down: range) -> bool:
        """Move the mouse down the screen at some places until it is over a button."""
        for x in across:
            for y in down[SEARCH_STEP::SEARCH_STEP]:
                if self.hovers_over(command, x, y):
                    self._places[command] = x, y
                    return True
        return False

    def point_in(self, region: str, command: str) -> None:
        """Find a button of a header by moving the mouse along it."""
        if self._is_still_there(command):
            return
        left, top, width, height = self.region(region)
        y = top + height // 2
        over: list[int] = []
        for x in range(left + SEARCH_STEP, left + width, SEARCH_STEP):
            self.desktop.point(x, y)
            if self.glance()["hovered"] == command:
                over.append(x)
            elif over:
                # Its ends may be arrows, which do something else.
                self._places[command] = (over[0] + over[-1]) // 2, y
                self.desktop.point(*self._places[command])
                self.glance()
                return
        raise Unexpected(f"{region} has no button for {command}")

    def region(self, name: str) -> tuple[int, int, int, int]:
        """Left, top, width and height of the last region of a kind on the screen, such as `FILE_BROWSER EXECUTE`."""
        known = self.glance()["regions"]
        expect(name in known, f"no {name} is shown")
        left, bottom, width, height = known[name]
        return left, SIZE[1] - bottom - height, width, height

    @contextmanager
    def held(self) -> Iterator[None]:
        """Blender stands still meanwhile, so that a short job is not over before a picture is taken."""
        self._blender.send_signal(signal.SIGSTOP)
        try:
            yield
        finally:
            self._blender.send_signal(signal.SIGCONT)

    def rectangle(self, part: str) -> tuple[int, int, int, int]:
        """Left, top, width and height of the editor or its side bar on the screen; Blender counts from the bottom."""
        state = self.state()
        left, bottom, width, height = state[part]
        return left, state["height"] - bottom - height, width, height

    def type_into(self, field: str, text: str) -> None:
        """Replace the text of a field."""
        self.click_button(field)
        self.desktop.press("ctrl+a")
        self.desktop.type(text)
        self.desktop.press("Return")

    def mirrored_clip(self) -> Path:
        """The clip's frames as in a mirror: another person."""
        folder = self._folder / "mirrored"
        folder.mkdir()
        frames = [str(frame) for frame in sorted((self._setup.clip / "frames").iterdir())]
        subprocess.run(["mogrify", "-flop", "-path", str(folder), *frames], check=True)
        return folder

    def keep(self, name: str, content: bytes) -> None:
        """Leave a file in the results."""
        (self._setup.out / name).write_bytes(content)

    def picture(self, name: str) -> None:
        """Save the whole screen to the results."""
        self.desktop.picture(self._setup.out / f"{name}.png")

    def picture_of_editor(self, name: str) -> None:
        """Save the editor with its side bar to the results."""
        self.desktop.picture(self._setup.out / f"{name}.png", self.rectangle("editor"))

    def ended(self, seconds: float) -> int | None:
        """Blender's exit code when it ends within a time."""
        try:
            return self._blender.wait(seconds)
        except subprocess.TimeoutExpired:
            return None
