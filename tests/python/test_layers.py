"""The import arrows of the add-on: panel → operators → actions → {scene, engine}; one importer of the native module."""

import ast
import os
from pathlib import Path

import pytest

ROOT = Path(os.environ.get("FACEWRIGHT_ROOT", Path(__file__).parents[2]))
ADDON = ROOT / "addon"
FILES = sorted(p for p in ADDON.rglob("*.py") if "__pycache__" not in p.parts)

# What a module of a kind may import of the add-on itself.
ALLOWED = {
    "panel": {"operators", "actions", "options", "scene", "modal", "running", "words"},
    "operators": {"actions", "options", "scene", "engine", "jobs", "modal", "running", "delivery", "words"},
    "actions": {"scene", "engine", "jobs", "preferred", "words"},
    "properties": {"actions", "options"},
    "options": {"actions"},
    "following": {"actions"},
    "scene": {"scene", "engine"},
    "engine": {"engine"},
    "jobs": {"engine"},
}


def kind(path: Path) -> str:
    relative = path.relative_to(ADDON)
    return relative.parts[0] if relative.parts[0] in {"scene", "engine"} else relative.stem


def imports(path: Path) -> list[tuple[int, str]]:
    """(level, dotted name) of every import; names imported from a bare relative package count as modules."""
    found: list[tuple[int, str]] = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found += [(0, alias.name) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [node.module] if node.module else [alias.name for alias in node.names]
            found += [(node.level, name) for name in names if name]
    return found


def own_modules(path: Path) -> set[str]:
    """Kinds of the add-on's own modules that a file imports."""
    base = path.relative_to(ADDON).parent
    modules = set()
    for level, name in imports(path):
        if level == 0:
            continue
        start = ADDON / base
        for _ in range(level - 1):
            start = start.parent
        target = start.joinpath(*name.split("."))
        relative = target.relative_to(ADDON)
        modules.add(relative.parts[0] if relative.parts[0] in {"scene", "engine"} else relative.name)
    return modules


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(ADDON)))
def test_imports_follow_the_arrows(path: Path) -> None:
    allowed = ALLOWED.get(kind(path))
    if allowed is not None and path.parent != ADDON or (allowed is not None and kind(path) == "jobs"):
        inside = {"axes", "materials"} if kind(path) == "scene" else set()
        assert own_modules(path) <= allowed | inside


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(ADDON)))
def test_only_the_engine_imports_the_native_module(path: Path) -> None:
    native = {name for level, name in imports(path) if level == 0 and name.split(".")[0] == "facewright"}
    assert not native or kind(path) == "engine"


@pytest.mark.parametrize("path", [p for p in FILES if kind(p) in {"engine", "jobs"}], ids=str)
def test_engine_and_jobs_know_no_blender(path: Path) -> None:
    assert not {name for _, name in imports(path) if name.split(".")[0] in {"bpy", "bmesh", "mathutils"}}
