"""The interface in other languages: texts for all of it, none too many, and Blender shows them."""

import re
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import bpy
import pytest
from conftest import ROOT
from test_help import report
from tracking import module
from words import Word, drawn, looked_up, words

LANGUAGES: dict[str, dict[str, str]] = module("translations").LANGUAGES
EVERY = pytest.mark.parametrize("language", LANGUAGES)
# Blender's own names of them.
LOCALES = {"de": "de_DE", "fr": "fr_FR", "ja": "ja_JP", "zh_HANS": "zh_HANS"}
# Those in which every tooltip, reason and message is there too.
WHOLE = {"de"}
# Groups of settings and operators whose tooltips every language has: of what a beginner sees.
MAIN = ("FacewrightClip.", "FacewrightKeys.", "FACEWRIGHT_OT_reconstruct.", "FACEWRIGHT_OT_survey.") + tuple(
    f"FACEWRIGHT_OT_{name}."
    for name in ("open_clip", "pick_frame", "frames_from_timeline", "use_all_frames", "export", "expression", "manual")
)


def every() -> list[Word]:
    return [*words(), *drawn(), *looked_up()]


def is_needed(word: Word) -> bool:
    """Whether every language must have it: labels, what panels draw, and what a beginner's tooltips say."""
    is_label = word.where.endswith((".name", ".bl_label"))
    is_shown = word.where.split(":")[0].endswith(("panel.py", "running.py", "report.py"))
    return is_label or is_shown or word.where.startswith(MAIN) or word in looked_up()


def braces(text: str) -> set[str]:
    return set(re.findall(r"{(\w*)}", text))


@EVERY
def test_no_text_is_translated_that_the_interface_does_not_have(language: str) -> None:
    known = {word.text for word in every()}
    assert not [text for text in LANGUAGES[language] if text not in known]


@EVERY
def test_every_label_is_translated(language: str) -> None:
    needed = {word.text for word in every() if language in WHOLE or is_needed(word)}
    assert len(needed) > 250
    assert not sorted(needed - LANGUAGES[language].keys())


@EVERY
def test_a_translation_keeps_what_is_put_in_and_how_it_ends(language: str) -> None:
    for text, said in LANGUAGES[language].items():
        assert said.strip() == said and said, text
        assert braces(said) == braces(text), text
        assert said.endswith("…") == text.endswith("…"), text
        # Blender puts the full stop there itself.
        assert not said.endswith((".", "。")) and "  " not in said, text


@pytest.fixture
def in_german(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if Blender had been built with languages, which its Python module is not."""
    monkeypatch.setattr(module("words"), "pgettext_iface", lambda text: LANGUAGES["de"].get(text, text))


@pytest.mark.usefixtures("in_german")
def test_what_is_put_together_is_in_the_users_language() -> None:
    running, progress = module("running"), module("engine").Progress
    assert running.bar_text(progress("track", 0.5, None, (3, 8))) == "3 von 8: Tracken"
    assert running.time_left(130.0) == "Noch 3 min, Esc bricht ab"
    actions, settings = module("reconstruct.actions"), bpy.context.scene.facewright_clip
    settings.path = str(ROOT / "tests/data/clip/frames")
    count = settings.frames
    assert actions.length_line(settings) == (f"{count} Frames", True)
    settings.use_range, settings.first, settings.last = True, 0, 1
    assert actions.length_line(settings) == (f"2 von {count} Frames", True)
    text = report((True, "yaw", "yaw +3°"), (False, "alike", "looks like a better frame that is used"))
    said = ["Aus 1 Frame, 500 Punkte", "1 Frame nicht gebraucht: wie ein besserer"]
    assert actions.report_lines(text)[:2] == said
    summary, parse = module("engine.report").summary, module("engine.report").parse
    assert summary(parse(text))[0] == "Made from 1 frame, 500 points"


@pytest.mark.usefixtures("in_german")
def test_a_grey_button_says_why_in_the_users_language() -> None:
    for name, said in (
        ("reconstruct", "Zuerst einen Clip wählen"),
        ("mark_head", LANGUAGES["de"][module("heads.actions").NONE_YET]),
        ("add_controls", "Zuerst ein Gesicht rekonstruieren"),
        ("expression", "Zuerst ein Gesicht rekonstruieren"),
    ):
        with pytest.raises(RuntimeError, match=re.escape(said)):
            getattr(bpy.ops.facewright, name)()


@pytest.mark.usefixtures("in_german")
def test_a_sentence_in_lines_is_translated_before_it_is_broken() -> None:
    context: Any = SimpleNamespace(
        region=SimpleNamespace(width=240), preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))
    )
    lines: list[str] = []
    layout: Any = SimpleNamespace(
        column=lambda **_: SimpleNamespace(label=lambda text, **_: lines.append(text)),
    )
    module("running").draw_text(layout, context, module("track.panel").NO_CLIP)
    assert len(lines) > 3 and " ".join(lines) == LANGUAGES["de"][module("track.panel").NO_CLIP]


@pytest.fixture
def speak() -> Iterator[Callable[[str], None]]:
    """Sets Blender's language."""
    if not bpy.app.build_options.international:
        pytest.skip("this Blender was built without languages, as its Python modules are")
    view = bpy.context.preferences.view
    before = view.language

    def set_language(language: str) -> None:
        view.language = LOCALES[language]
        view.use_translate_interface = view.use_translate_tooltips = view.use_translate_reports = True

    yield set_language
    view.language = before


@EVERY
def test_blender_shows_them(language: str, speak: Callable[[str], None]) -> None:
    pgettext, texts = bpy.app.translations.pgettext, LANGUAGES[language]
    module("translations").unregister()
    speak(language)
    own = {(word.context, word.text) for word in every() if pgettext(word.text, word.context) != word.text}
    module("translations").register()
    speak(language)
    for word in every():
        if word.text in texts and (word.context, word.text) not in own:
            assert pgettext(word.text, word.context) == texts[word.text], word
    settings, layout = bpy.context.scene.facewright_clip, bpy.types.UILayout
    assert layout.enum_item_name(settings, "method", "paper") == texts["Paper"]
    about = texts["The steps of Liang, Pan, Chen 2004"]
    assert layout.enum_item_description(settings, "method", "paper") == about
    assert module("running").time_left(None) == texts["Esc cancels"]
    with pytest.raises(RuntimeError, match=texts["Choose a clip first"]):
        bpy.ops.facewright.reconstruct()
    # Most of what is shown is ours.
    assert len(own) < 0.25 * len(texts)
