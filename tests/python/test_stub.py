"""The stub of the native module, which is what editors and type checkers read, says what the module has."""

import ast
import importlib
import inspect
import os
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

ROOT = Path(os.environ.get("FACEWRIGHT_ROOT", Path(__file__).parents[2]))
PACKAGE = ROOT / "target/python/facewright"
STUB = ast.parse((ROOT / "rust/python/python/facewright/_native.pyi").read_text())
DEFINITIONS = {node.name: node for node in STUB.body if isinstance(node, ast.FunctionDef | ast.ClassDef)}
CLASSES = [node for node in DEFINITIONS.values() if isinstance(node, ast.ClassDef) and not node.name.startswith("_")]

# A parameter as (name, kind, default).
Parameter = tuple[str, Any, Any]


@pytest.fixture(scope="module")
def native() -> Iterator[ModuleType]:
    built = [path for path in PACKAGE.glob("_native.*") if path.suffix in (".so", ".pyd")]
    assert built, f"{PACKAGE} holds no native module: run `cargo x test`"
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(PACKAGE.parent)
        yield importlib.import_module("facewright._native")


def test_the_stub_names_what_the_module_has(native: ModuleType) -> None:
    assert public(vars(native)) == public(names(STUB.body))


def test_the_package_hands_on_what_the_module_has(native: ModuleType) -> None:
    package = ast.parse((ROOT / "rust/python/python/facewright/__init__.py").read_text())
    exported = next(
        ast.literal_eval(node.value)
        for node in package.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__"
    )
    assert public(vars(native)) <= set(exported)


@pytest.mark.parametrize("node", CLASSES, ids=lambda node: node.name)
def test_the_stub_names_what_a_class_has(native: ModuleType, node: ast.ClassDef) -> None:
    kind = getattr(native, node.name)
    assert public(dir(kind()) if is_dataclass(node) else vars(kind)) == public(names(whole(node)))
    assert {name for name in names(node.body) if name.startswith("__")} <= set(dir(kind))
    if is_dataclass(node):
        return
    bases = {ast.unparse(base) for base in node.bases if not isinstance(base, ast.Subscript)}
    assert bases == {base.__name__ for base in kind.__bases__} - {"object"}


def test_functions_take_what_the_stub_says(native: ModuleType) -> None:
    for name, node in DEFINITIONS.items():
        if isinstance(node, ast.FunctionDef):
            agree(name, taken(getattr(native, name)), said(node))


@pytest.mark.parametrize("node", CLASSES, ids=lambda node: node.name)
def test_methods_take_what_the_stub_says(native: ModuleType, node: ast.ClassDef) -> None:
    kind = getattr(native, node.name)
    constructor = fields(node) if is_dataclass(node) else None
    for method in (method for method in node.body if isinstance(method, ast.FunctionDef)):
        marks = [ast.unparse(mark) for mark in method.decorator_list]
        parameters = said(method) if "staticmethod" in marks else said(method)[1:]
        if method.name in ("__init__", "__new__"):
            constructor = parameters
        elif not any(mark == "property" or mark.endswith("setter") for mark in marks):
            bound = "staticmethod" in marks or "classmethod" in marks
            agree(method.name, taken(getattr(kind, method.name))[0 if bound else 1 :], parameters)
    if not issubclass(kind, Exception):
        found = taken(kind) if kind.__text_signature__ else None
        # The order of keywords says nothing.
        agree(node.name, sorted(found or []) if is_dataclass(node) else found, constructor)


def test_help_shows_the_docstrings_of_the_stub(native: ModuleType) -> None:
    differ: dict[str, str | None] = {}
    for path, node in defined(STUB.body, ""):
        thing: Any = native
        for name in path.split("."):
            thing = getattr(thing, name)
        if words(thing.__doc__) != words(ast.get_docstring(node)):
            differ[path] = thing.__doc__
    assert not differ, "run rust/xtask/python/stub.py"


def test_all_that_is_public_has_a_docstring() -> None:
    assert [path for path, node in defined(STUB.body, "") if not words(ast.get_docstring(node))] == []


def is_dataclass(node: ast.ClassDef) -> bool:
    """Options are no dataclasses, but the stub lets a type checker take them for some, with bases that share fields."""
    return any(ast.unparse(mark).startswith("dataclass") for mark in node.decorator_list)


def whole(node: ast.ClassDef) -> list[ast.stmt]:
    """What a class of the stub holds; for a dataclass, with what its bases do."""
    bases = [base.id for base in node.bases if isinstance(base, ast.Name)] if is_dataclass(node) else []
    inherited = [whole(other) for other in STUB.body if isinstance(other, ast.ClassDef) and other.name in bases]
    return [*(statement for body in inherited for statement in body), *node.body]


def fields(node: ast.ClassDef) -> list[Parameter]:
    """The keywords of a dataclass's constructor by the stub, in the alphabet's order."""
    declared = [field for field in whole(node) if isinstance(field, ast.AnnAssign)]
    absent, kind = inspect.Parameter.empty, inspect.Parameter.KEYWORD_ONLY
    return sorted((ast.unparse(f.target), kind, value(f.value) if f.value else absent) for f in declared)


def public(of: Any) -> set[str]:
    return {name for name in of if not name.startswith("_")}


def names(body: list[ast.stmt]) -> set[str]:
    """What is defined or declared; type variables and imports are the stub's own."""
    defined = {node.name for node in body if isinstance(node, ast.FunctionDef | ast.ClassDef)}
    return defined | {ast.unparse(node.target) for node in body if isinstance(node, ast.AnnAssign)}


def said(node: ast.FunctionDef) -> list[Parameter]:
    """A function's parameters by the stub."""
    kinds, parameters, absent = inspect.Parameter, node.args, inspect.Parameter.empty
    first = [(a, kinds.POSITIONAL_ONLY) for a in parameters.posonlyargs]
    first += [(a, kinds.POSITIONAL_OR_KEYWORD) for a in parameters.args]
    defaults = [absent] * (len(first) - len(parameters.defaults)) + [value(d) for d in parameters.defaults]
    found: list[Parameter] = [(a.arg, kind, default) for (a, kind), default in zip(first, defaults)]
    if parameters.vararg:
        found.append((parameters.vararg.arg, kinds.VAR_POSITIONAL, absent))
    for a, default in zip(parameters.kwonlyargs, parameters.kw_defaults):
        found.append((a.arg, kinds.KEYWORD_ONLY, value(default) if default else absent))
    if parameters.kwarg:
        found.append((parameters.kwarg.arg, kinds.VAR_KEYWORD, absent))
    return found


def value(node: ast.expr) -> Any:
    try:
        return ast.literal_eval(node)
    except ValueError:
        return ast.unparse(node)


def taken(function: Any) -> list[Parameter]:
    """A function's parameters by the module itself."""
    return [(p.name, p.kind, p.default) for p in inspect.signature(function).parameters.values()]


def agree(name: str, module: list[Parameter] | None, stub: list[Parameter] | None) -> None:
    """The module shows a default that is no literal in Rust as an ellipsis: there the stub alone says what it is."""
    if module and stub and len(module) == len(stub):
        hidden = [m[2] is ... and s[2] is not inspect.Parameter.empty for m, s in zip(module, stub)]
        module = [(m[0], m[1], s[2] if unknown else m[2]) for m, s, unknown in zip(module, stub, hidden)]
    assert module == stub, name


def defined(body: list[ast.stmt], prefix: str) -> list[tuple[str, ast.FunctionDef | ast.ClassDef]]:
    """(dotted name, definition) of all that is public in the stub."""
    found = []
    for node in body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
            found.append((prefix + node.name, node))
            if isinstance(node, ast.ClassDef):
                found += defined(node.body, f"{node.name}.")
    return found


def words(text: str | None) -> list[str]:
    return (text or "").split()
