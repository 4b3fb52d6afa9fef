"""A virtual screen with a mouse and a keyboard."""

import os
import subprocess
from pathlib import Path

SIZE = (1280, 800)


class Desktop:
    """An X server without a screen, as a context."""

    def __enter__(self) -> "Desktop":
        read, write = os.pipe()
        screen = ["-screen", "0", f"{SIZE[0]}x{SIZE[1]}x24", "+extension", "GLX", "-nolisten", "tcp"]
        self._server = subprocess.Popen(
            ["Xvfb", "-displayfd", str(write), *screen], pass_fds=[write], stderr=subprocess.DEVNULL
        )
        os.close(write)
        with os.fdopen(read) as display:
            number = display.readline().strip()
        if not number:
            raise RuntimeError("Xvfb does not start: no window can be opened")
        self.display = f":{number}"
        self.clicks = 0
        return self

    def __exit__(self, *_: object) -> None:
        self._server.terminate()
        self._server.wait()

    @property
    def environment(self) -> dict[str, str]:
        """The environment of a program that shall open its window here."""
        return os.environ | {"DISPLAY": self.display, "LIBGL_ALWAYS_SOFTWARE": "1"}

    def point(self, x: int, y: int) -> None:
        """Move the mouse; from the upper left corner of the screen."""
        # Two motions, because Blender finds the button under the mouse while the mouse moves.
        self._hand("mousemove", str(x - 2), str(y), "mousemove", str(x), str(y))

    def click(self) -> None:
        self.clicks += 1
        self._hand("click", "1")

    def double_click(self) -> None:
        self.clicks += 2
        self._hand("click", "--repeat", "2", "--delay", "50", "1")

    def click_and_press(self, key: str) -> None:
        """Both at once: the program gets the key right after the click, however busy it is."""
        self._hand("click", "1", "key", key)

    def press(self, key: str) -> None:
        """Press a key or keys by the X names: `Escape`, `ctrl+z`."""
        self._hand("key", key)

    def drag(self, start: tuple[int, int], to: tuple[int, int], steps: int) -> None:
        """Press the mouse's button at a place and let it go at another, with some stops between."""
        self.point(*start)
        self._hand("mousedown", "1")
        for step in range(1, steps + 1):
            self.point(*(a + (b - a) * step // steps for a, b in zip(start, to)))
        self._hand("mouseup", "1")

    def bring_forward(self, name: str) -> None:
        """What a click on a window does where there is a window manager; by an expression for its name."""
        self._hand("search", "--name", name, "windowraise", "windowfocus")

    def turn_wheel(self, notches: int) -> None:
        """Down by some notches, or up by a negative number."""
        self._hand("click", "--repeat", str(abs(notches)), "--delay", "5", "5" if notches > 0 else "4")

    def type(self, text: str) -> None:
        self._hand("type", text)

    def picture(self, path: Path, rectangle: tuple[int, int, int, int] | None = None) -> None:
        """Save what is on the screen, or a part of it (left, top, width, height)."""
        left, top, width, height = rectangle or (0, 0, *SIZE)
        part = ["-crop", f"{width}x{height}+{left}+{top}", "+repage", "-strip", "-define", "png:compression-level=9"]
        subprocess.run(["import", "-window", "root", *part, str(path)], env=self.environment, check=True)

    def _hand(self, *actions: str) -> None:
        subprocess.run(["xdotool", *actions], env=self.environment, check=True)
