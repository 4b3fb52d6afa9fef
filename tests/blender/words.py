"""All words of the extension that an artist reads: of its classes, and of what its panels draw."""

import ast
import importlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import bpy
from conftest import PACKAGE, ROOT

# Keywords of Blender's layouts, and our functions, whose texts are shown.
SHOWN = {"text", "heading", "placeholder"}
# And functions of ours and Blender's that show one of their arguments: which one.
PLACED = {"draw_text": 2, "poll_message_set": 0, "FacewrightError": 0, "say": 0, "sentence": 0}


@dataclass(frozen=True)
class Word:
    """A text, the context that Blender looks it up in, and where it stands: `FACEWRIGHT_OT_track.bl_label`."""

    text: str
    context: str
    where: str


def classes() -> tuple[Any, ...]:
    return importlib.import_module(f"{PACKAGE}.registration").CLASSES


def operator(cls: Any) -> Any:
    """The function of `bpy.ops` that an operator's class stands for."""
    category, name = cls.bl_idname.split(".")
    return getattr(getattr(bpy.ops, category), name)


def operators() -> list[Any]:
    return [cls for cls in classes() if issubclass(cls, bpy.types.Operator)]


def rna(cls: Any) -> Any:
    """What Blender knows of a class."""
    return operator(cls).get_rna_type() if issubclass(cls, bpy.types.Operator) else cls.bl_rna


def own_properties(cls: Any) -> list[Any]:
    """The properties that a class, or what it inherits from, declares."""
    declared = {name for one in cls.__mro__ for name in one.__dict__.get("__annotations__", {})}
    # A group's own `name` hides the one that Blender gives every group.
    return list({prop.identifier: prop for prop in rna(cls).properties if prop.identifier in declared}.values())


def words() -> list[Word]:
    """Labels, descriptions and choices of all classes, in their order."""
    return [word for cls in classes() for word in _of_class(cls) if word.text.strip()]


def _of_class(cls: Any) -> Iterator[Word]:
    name, known = cls.__name__, rna(cls)
    context = known.translation_context
    if issubclass(cls, bpy.types.Operator):
        yield Word(known.name, context, f"{name}.bl_label")
        yield Word(known.description, "*", f"{name}.bl_description")
    elif issubclass(cls, (bpy.types.Panel, bpy.types.Menu)):
        yield Word(cls.bl_label, context, f"{name}.bl_label")
    for prop in own_properties(cls):
        place = f"{name}.{prop.identifier}"
        if prop.is_hidden or not is_named(prop):
            continue
        yield Word(prop.name, prop.translation_context, f"{place}.name")
        yield Word(prop.description, "*", f"{place}.description")
        for item in prop.enum_items_static if prop.type == "ENUM" else ():
            yield Word(item.name, prop.translation_context, f"{place}.{item.identifier}.name")
            yield Word(item.description, "*", f"{place}.{item.identifier}.description")


def is_named(prop: Any) -> bool:
    """Whether a property has a name of its own: others are never shown by it."""
    return prop.name != prop.identifier


def drawn() -> list[Word]:
    """Texts that stand in the code, with braces for what is put in: of panels, reasons of grey buttons, errors."""
    found = []
    for path in sorted((ROOT / "addon").rglob("*.py")):
        module = ast.parse(path.read_text(encoding="utf-8"))
        named = _named(module)
        for node in ast.walk(module):
            for value in _shown(node) if isinstance(node, ast.Call) else ():
                place = f"{path.relative_to(ROOT)}:{value.lineno}"
                found += [Word(text, "*", place) for text in _texts(value, named)]
    return [word for word in found if word.text.strip()]


def looked_up() -> list[Word]:
    """Texts that the code takes from tables, or from the library, and shows in the user's language."""
    tables = {
        "engine.report": lambda module: module.NOT_NEEDED.values(),
        "help.actions": lambda module: (*module.NO_CLIP, *module.MADE_OF_CLIP),
        "calibrate.panel": lambda module: module.HEADINGS,
        "scene.keys": lambda module: (*module.GROUPS, module.OTHER),
        "delivery": lambda module: (module.DRAGGED, module.RENDERED),
        "running": lambda module: (module.STARTING.stage,),
    }
    found = []
    for name, texts in tables.items():
        found += [Word(text, "*", name) for text in texts(importlib.import_module(f"{PACKAGE}.{name}"))]
    for source in sorted((ROOT / "rust").glob("*/src/**/*.rs")):
        code, _, _ = source.read_text(encoding="utf-8").partition("#[cfg(test)]\nmod tests {")
        stages = re.findall(r'\.stage\("([^"]+)"\)', code)
        found += [Word(stage, "*", str(source.relative_to(ROOT))) for stage in stages]
    expressions = (
        (ROOT / "rust" / "head" / "src" / "expressions.rs").read_text(encoding="utf-8").split("#[cfg(test)]")[0]
    )
    names = ["neutral", *re.findall(r'name: "([^"]+)"', expressions)]
    return [*found, *(Word(name.capitalize(), "Operator", "expressions.rs") for name in names)]


def _shown(call: ast.Call) -> list[ast.expr]:
    """What a call shows, if it does."""
    name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
    place = PLACED.get(name, len(call.args))
    return [*call.args[place : place + 1], *(keyword.value for keyword in call.keywords if keyword.arg in SHOWN)]


def _named(module: ast.Module) -> dict[str, list[ast.expr]]:
    """What is assigned to the constants of a module, and to the variables of its functions, by name."""
    named: dict[str, list[ast.expr]] = {}
    for node in ast.walk(module):
        if isinstance(node, ast.Assign):
            for target in node.targets:
                if isinstance(target, ast.Name):
                    named.setdefault(target.id, []).append(node.value)
    return named


def _texts(value: ast.expr, named: dict[str, list[ast.expr]]) -> list[str]:
    """The texts of an expression: of both sides of a choice, and of none that is put together."""
    if isinstance(value, ast.IfExp):
        return [*_texts(value.body, named), *_texts(value.orelse, named)]
    if isinstance(value, ast.Name):
        return [text for assigned in named.get(value.id, []) for text in _texts(assigned, {})]
    return [value.value] if isinstance(value, ast.Constant) and isinstance(value.value, str) else []
