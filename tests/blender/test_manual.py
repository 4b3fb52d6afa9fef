"""The manual is true: what it shows exists, and what it names as a button is one."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import bpy
import pytest
from conftest import ROOT
from tracking import module

MANUAL = ROOT / "docs/manual"
CHAPTERS = sorted(MANUAL.glob("*.md"))
LINK = re.compile(r"!?\[([^\]]*)\]\(([^)#]*)(?:#([^)]*))?\)")
# Italics alone are names of ours; bold ones are Blender's, or another program's.
NAME = re.compile(r"(?<!\*)\*([^*\n]+)\*(?!\*)")
CODE = re.compile(r"`[^`]*`|^    .*$", re.MULTILINE)
MOST_BYTES, MOST_BYTES_OF_ALL = 150_000, 3_000_000


def prose(chapter: Path) -> str:
    return CODE.sub("", chapter.read_text("utf-8"))


def anchors(chapter: Path) -> set[str]:
    heads = re.findall(r"^#+ (.*)$", chapter.read_text("utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", head.lower()).replace(" ", "-") for head in heads}


@pytest.mark.parametrize("chapter", CHAPTERS, ids=lambda chapter: chapter.stem)
def test_every_picture_and_page_that_a_chapter_names_exists(chapter: Path) -> None:
    links = LINK.findall(prose(chapter))
    assert links, "a chapter leads somewhere"
    for _, target, anchor in links:
        file = chapter.parent / target if target else chapter
        assert file.is_file() and MANUAL in file.parents, f"{chapter.name} names {target}"
        assert not anchor or anchor in anchors(file), f"{chapter.name} names {target}#{anchor}"


def test_every_picture_is_shown_and_small_enough_to_be_carried() -> None:
    named = {MANUAL / target for chapter in CHAPTERS for _, target, _ in LINK.findall(prose(chapter))}
    pictures = set((MANUAL / "pictures").iterdir())
    assert pictures and pictures <= named, f"not shown: {[picture.name for picture in pictures - named]}"
    assert set(CHAPTERS) <= named | {MANUAL / "index.md"}, "the contents lead to every chapter"
    sizes = [picture.stat().st_size for picture in pictures]
    assert max(sizes) <= MOST_BYTES and sum(sizes) <= MOST_BYTES_OF_ALL


@pytest.mark.parametrize("chapter", CHAPTERS, ids=lambda chapter: chapter.stem)
def test_every_label_that_a_chapter_names_is_one_of_ours(generic_face: bpy.types.Object, chapter: Path) -> None:
    known = {*labels(), *expressions(generic_face)}
    assert {"Reconstruct Face", "Strength", "Happiness", "New Head"} <= known and "Make Coffee" not in known
    wrong = [name for name in NAME.findall(prose(chapter)) if name not in known]
    assert not wrong, f"{chapter.name} names {wrong}"


def labels() -> Iterator[str]:
    """What can be read on the add-on's buttons and fields."""
    for cls in module("registration").CLASSES:
        yield from (getattr(cls, "bl_label", ""), getattr(cls, "bl_category", ""))
        # Those of what it is mixed from too.
        for declared in (d for base in cls.__mro__ for d in base.__dict__.get("__annotations__", {}).values()):
            options = getattr(declared, "keywords", {})
            yield options.get("name", "")
            # Choices that are listed while they are shown come below.
            if isinstance(options.get("items"), (list, tuple)):
                yield from (item[1] for item in options["items"] if item)
    yield from (label for _, label, _ in module("reconstruct.actions").choices(bpy.context.scene))
    for file in (ROOT / "addon").rglob("*.py"):
        yield from texts(ast.parse(file.read_text("utf-8")))


def expressions(face: bpy.types.Object) -> Iterator[str]:
    """The buttons of a face's expressions."""
    return (name.capitalize() for name in module("animate.actions").names(face))


def texts(code: ast.Module) -> Iterator[str]:
    """What a panel writes on its buttons."""
    for node in ast.walk(code):
        if isinstance(node, ast.keyword) and node.arg == "text":
            # One of two, as it may be.
            yield from (str(part.value) for part in ast.walk(node.value) if isinstance(part, ast.Constant))
