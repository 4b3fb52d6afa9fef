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

    `editors` are Blender's names of those in the window's main area; the test is about the first.
    """

    def __init__(self, desktop: Desktop, setup: Setup, editors: str, log: Path) -> None:
        self.desktop, self._setup, self._editors, self._log = desktop, setup, editors, log

    def __enter__(self) -> "Session":
        self._folder = Path(tempfile.mkdtemp(prefix="facewright-gui-"))
        self._state, self._question = self._folder / "state.json", self._folder / "question"
        self._questions = 0
        geometry = ["--window-geometry", "0", "0", str(SIZE[0]), str(SIZE[1])]
        script = str(Path(__file__).with_name("in_blender.py"))
        with self._log.open("w") as log:
            self._blender = subprocess.Popen(
                ["blender", "--factory-startup", *geometry, "--python", script],
                env=self.desktop.environment | self._environment(),
                stdout=log,
                stderr=subprocess.STDOUT,
            )
        return self

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

    def click_button(self, command: str, columns: Sequence[float] = COLUMNS) -> None:
        """Find a button and click it."""
        self.point_at_button(command, columns)
        self.desktop.click()

    def point_at_button(self, command: str, columns: Sequence[float] = COLUMNS) -> tuple[int, int]:
        """Find a button by moving the mouse down the editor's side bar, as the eye would, in parts of its width.

        Gives its place.
        """
        left, top, width, height = self.rectangle("side_bar")
        for column in columns:
            for y in range(top + SEARCH_STEP, top + height, SEARCH_STEP):
                place = int(left + column * width), y
                self.desktop.point(*place)
                if self.glance()["hovered"] == command:
                    return place
        raise Unexpected(f"the side bar has no button for {command}")

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
