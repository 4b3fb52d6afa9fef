"""Writes the docstrings of the native module into its stub, so that they are written once: in Rust.

Run by a Python that has numpy, after `cargo x test` or whatever else leaves the module in target/python.
"""

import ast
import importlib
import sys
import textwrap
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[3]
STUB = ROOT / "rust/python/python/facewright/_native.pyi"
WIDTH = 120


def main() -> None:
    sys.path.insert(0, str(ROOT / "target/python"))
    native, text = importlib.import_module("facewright._native"), STUB.read_text()
    lines = text.splitlines()
    # From the end on: what is before a docstring keeps its lines.
    for node, thing in reversed(documented(ast.parse(text).body, native)):
        docstring = node.body[0]
        indent = docstring.col_offset
        lines[docstring.lineno - 1 : docstring.end_lineno] = written(thing.__doc__, indent)
    STUB.write_text("\n".join(lines) + "\n")


def documented(body: list[ast.stmt], of: Any) -> list[tuple[Any, Any]]:
    """All definitions that have a docstring in the stub, in order, and what they are in the module."""
    found = []
    for node in body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and hasattr(of, node.name):
            thing = getattr(of, node.name)
            if ast.get_docstring(node):
                found.append((node, thing))
            if isinstance(node, ast.ClassDef):
                found += documented(node.body, thing)
    return found


def written(doc: str, indent: int) -> list[str]:
    """A docstring's lines; paragraphs are filled, lines that are indented stay."""
    paragraphs = [filled(paragraph, WIDTH - indent - 3) for paragraph in doc.strip().split("\n\n")]
    text = '"""' + "\n\n".join(paragraphs)
    is_one_line = "\n" not in text and indent + len(text) + 3 <= WIDTH
    text += '"""' if is_one_line else '\n"""'
    return textwrap.indent(text, " " * indent).splitlines()


def filled(paragraph: str, width: int) -> str:
    if paragraph.startswith(" "):
        hanging = {"initial_indent": "    ", "subsequent_indent": "        ", "break_on_hyphens": False}
        return "\n".join(textwrap.fill(line.strip(), width, **hanging) for line in paragraph.splitlines())
    return textwrap.fill(" ".join(paragraph.split()), width, break_on_hyphens=False)


if __name__ == "__main__":
    main()
