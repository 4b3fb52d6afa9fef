"""What *Manual* and *Open Report* open, and what a beginner reads."""

from pathlib import Path
from typing import Any

import bpy

from ..engine.report import document
from ..scene import head as scene_head
from ..scene import heads
from ..words import say

MANUAL = Path(__file__).parent.parent / "manual"
INDEX = "index.html"
# What is kept on a text that shows a report: the key of its head.
OWNER = "facewright_report_of"

# The manual's chapter about each feature, by how its operators, and its groups of settings, are called.
PAGES = {
    "report": (("open_report",), ()),
    "export": (("export",), ()),
    "expressions": (("expression", "*key*"), ("keys",)),
    "heads": (("*head*",), ("head",)),
    "cameras": (
        ("calibrate", "*camera*", "*board*", "*rig*", "*calibration*", "*lens*", "*track*", "*motion*", "look_through"),
        ("camera", "board", "rig", "track", "motion"),
    ),
    "first-head": (("reconstruct",), ("clip", "person")),
}
# A beginner's next step, in sentences: without a clip, and with one.
NO_CLIP = (
    "Film a face that turns slowly to both sides: evenly lit, mouth closed, eyes open, the camera on a support",
    "Then choose the film, or a folder of its frames, above",
)
MADE_OF_CLIP = (
    "Reconstruct Face makes a textured head of this clip, in true size if the camera is calibrated",
    "Expressions, Export and the report come with it. Esc stops the work and changes nothing",
)
FILMING, FIRST_HEAD = "filming", "first-head"
# How Blender calls operators, groups of settings, and what a scene has of them, in small letters.
OPERATOR, GROUP, ANY = "bpy.ops.facewright.", "bpy.types.facewright", "bpy.types.*.facewright*"


def manual(page: str = "") -> Path | None:
    """The file of a page, or the manual's first one where it has no such page; None in a zip without a manual."""
    return next((file for file in (MANUAL / f"{page}.html", MANUAL / INDEX) if file.is_file()), None)


def links() -> tuple[str, tuple[tuple[str, str], ...]]:
    """Where Blender's *Online Manual* (F1) finds our pages: a beginning, and endings by names; none without any."""
    if manual() is None:
        return "", ()
    patterns = [(pattern, _name(page)) for page in PAGES for pattern in _patterns(page)]
    others = [(f"{OPERATOR}*", INDEX), (f"{GROUP}*", INDEX), (ANY, INDEX)]
    return f"{MANUAL.as_uri()}/", (*patterns, *others)


def _patterns(page: str) -> list[str]:
    operators, groups = PAGES[page]
    return [*(f"{OPERATOR}{word}*" for word in operators), *(f"{GROUP}{word}*" for word in groups)]


def _name(page: str) -> str:
    file = manual(page)
    return file.name if file is not None else INDEX


def has_report(scene: Any, active: Any) -> bool:
    """Whether there is a head whose report is known."""
    return _reported(scene, active) is not None


def write_report(scene: Any, active: Any) -> Any:
    """The report of the active object's head, or of the last one made, as a text of the file; None without one."""
    head = _reported(scene, active)
    if head is None:
        return None
    key = heads.key_of(head.skin)
    text = next((t for t in bpy.data.texts if t.get(OWNER) == key and t.library is None), None)
    if text is None:
        text = bpy.data.texts.new(f"{head.name} Report")
        text[OWNER] = key
    text.clear()
    text.write(document(head.skin[scene_head.REPORT], head.name))
    text.cursor_set(0)
    return text


def _reported(scene: Any, active: Any) -> Any:
    shown = heads.current(scene, active, scene.facewright_clip.wanted)
    if shown is None or shown[0].skin is None or scene_head.REPORT not in shown[0].skin:
        return None
    return shown[0]


def show_text(window: Any, text: Any) -> None:
    """Show a text in a Text editor of a window, or in a new window of its own."""
    area = next((area for area in window.screen.areas if area.type == "TEXT_EDITOR"), None)
    if area is None:
        before = set(bpy.context.window_manager.windows)
        bpy.ops.wm.window_new()
        (fresh,) = set(bpy.context.window_manager.windows) - before
        area = fresh.screen.areas[0]
        area.type = "TEXT_EDITOR"
    space = area.spaces.active
    space.text, space.show_word_wrap = text, True
    # It is no program.
    space.show_line_numbers = space.show_syntax_highlight = False


def chapter(scene: Any) -> str:
    """The page about a beginner's next step."""
    return FIRST_HEAD if scene.facewright_clip.path else FILMING


def next_step(scene: Any) -> tuple[str, ...]:
    """What a beginner does next, in sentences; none once there is a head."""
    if heads.heads(scene):
        return ()
    steps = MADE_OF_CLIP if scene.facewright_clip.path else NO_CLIP
    return tuple(say(step) for step in steps)
