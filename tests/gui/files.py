"""Blender's own windows by mouse and keyboard: its preferences, its file browser, the tab of the extension."""

import time
from pathlib import Path

from session import ANSWER_SECONDS, Session, expect
from steps import point_at_view

# Where Blender 4.3 shows them: from the upper left corner of the list, from the upper right one of the page.
GET_EXTENSIONS = (57, 164)
ARROW, INSTALL_FROM_DISK = (-17, 21), (-99, 144)
# The field for the folder, below the upper edge of the browser's bar; the button, from the lower bar's right edge.
FOLDER_FIELD, EXECUTE_BUTTON = 21, 60
# The fourth tab of the side bar: its middle, from the upper right corner.
TAB = (-8, 185)
INSTALL_SECONDS = 60
MIDDLE = (500, 300)


def install_from_disk(session: Session) -> None:
    """Preferences → Get Extensions → Install from Disk…"""
    # They open around the mouse, and must not reach beyond the screen.
    session.desktop.point(*MIDDLE)
    session.glance()
    session.desktop.press("ctrl+comma")
    session.wait("the preferences open", ANSWER_SECONDS, lambda s: "PREFERENCES NAVIGATION_BAR" in s["regions"])
    # Blender knows only a little later where the window is.
    time.sleep(1.0)
    left, top, _, _ = session.region("PREFERENCES NAVIGATION_BAR")
    click_at(session, left + GET_EXTENSIONS[0], top + GET_EXTENSIONS[1])
    session.wait("the extensions are shown", ANSWER_SECONDS, lambda s: s["section"] == "EXTENSIONS")
    left, top, width, _ = session.region("PREFERENCES WINDOW")
    click_at(session, left + width + ARROW[0], top + ARROW[1])
    click_at(session, left + width + INSTALL_FROM_DISK[0], top + INSTALL_FROM_DISK[1])
    choose_file(session, session.extension.parent, session.extension.name)
    session.wait("the extension is installed", INSTALL_SECONDS, lambda s: s["installed"])
    # So that the picture shows it in the list.
    session.settled()
    session.picture("hour-01-installed")
    to_the_main_window(session)


def to_the_main_window(session: Session) -> None:
    """As by a click on it where there is a window manager: the preferences, which stay open, no longer cover it."""
    session.desktop.bring_forward("Blender 4[.]")
    session.glance()


def click_at(session: Session, x: int, y: int) -> None:
    """Click a place of the screen, where something may have opened just now."""
    session.desktop.point(x, y)
    session.glance()
    session.desktop.click()
    session.glance()


def choose_file(session: Session, folder: Path, name: str) -> None:
    """Type a folder and a name into the file browser that is about to open, and click its button."""
    session.wait("the file browser opens", ANSWER_SECONDS, lambda s: "FILE_BROWSER EXECUTE" in s["regions"])
    point_at_field(session, "FILE_BROWSER UI", FOLDER_FIELD, "params.directory")
    fill(session, str(folder))
    session.wait("the folder is shown", ANSWER_SECONDS, lambda s: Path(s["folder"]) == folder)
    left, top, width, height = session.region("FILE_BROWSER EXECUTE")
    point_at_field(session, "FILE_BROWSER EXECUTE", height // 2, "params.filename")
    fill(session, name)
    session.wait("the name is taken", ANSWER_SECONDS, lambda s: s["file_name"] == name)
    session.desktop.point(left + width - EXECUTE_BUTTON, top + height // 2)
    session.glance()
    session.desktop.click()


def point_at_field(session: Session, region: str, height: int, field: str) -> None:
    left, top, width, _ = session.region(region)
    for x in range(left + width // 8, left + width, 20):
        session.desktop.point(x, top + height)
        if session.glance()["hovered"].endswith(field):
            return
    expect(False, f"the file browser has no field {field}")


def fill(session: Session, text: str) -> None:
    """Replace the text of the field under the mouse."""
    session.desktop.click()
    session.desktop.press("ctrl+a")
    session.desktop.type(text)
    session.desktop.press("Return")


def open_tab(session: Session) -> None:
    """N over the 3D view, and the extension's tab."""
    point_at_view(session)
    session.desktop.press("n")
    session.wait("the side bar opens", ANSWER_SECONDS, lambda s: s["tab"])
    left, top, width, _ = session.rectangle("side_bar")
    click_at(session, left + width + TAB[0], top + TAB[1])
    session.wait("the tab opens", ANSWER_SECONDS, lambda s: s["tab"] == "Facewright")


def save_as(session: Session, file: Path) -> None:
    point_at_view(session)
    session.desktop.press("ctrl+shift+s")
    choose_file(session, file.parent, file.name)
    session.wait("the file is saved", ANSWER_SECONDS, lambda s: s["file"] == str(file))


def open_file(session: Session, file: Path) -> None:
    point_at_view(session)
    session.desktop.press("ctrl+o")
    choose_file(session, file.parent, file.name)
    session.wait("the file is opened", ANSWER_SECONDS, lambda s: s["file"] == str(file))
    # It has remembered all windows that were open.
    to_the_main_window(session)


def append_collection(session: Session, file: Path, name: str) -> None:
    """A new file, and File → Append… a collection of another one into it."""
    point_at_view(session)
    session.desktop.press("ctrl+n")
    session.glance()
    session.desktop.press("g")
    session.wait("the new file is empty", ANSWER_SECONDS, lambda s: s["file"] == "" and not s["values"])
    point_at_view(session)
    session.desktop.press("F4")
    session.glance()
    session.desktop.press("a")
    choose_file(session, file / "Collection", name)
    session.wait("the head is there", ANSWER_SECONDS, lambda s: s["values"])
