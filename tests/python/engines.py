"""Modules of the add-on's engine without `engine/__init__.py`, which imports the native library."""

import importlib
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

ENGINE = Path(os.environ.get("FACEWRIGHT_ROOT", Path(__file__).parents[2])) / "addon" / "engine"


class Error(Exception):
    """Stands for the library's error."""


@contextmanager
def engine() -> Iterator[Callable[[str], ModuleType]]:
    """Gives what imports a module of the engine; afterwards all is as before."""
    before = set(sys.modules)
    native, package = ModuleType("facewright"), ModuleType("engine")
    native.__dict__["FacewrightError"] = Error
    package.__path__ = [str(ENGINE)]
    kept = sys.modules.get("facewright")
    sys.modules |= {"facewright": native, "engine": package}
    yield lambda name: importlib.import_module(f"engine.{name}")
    for name in [name for name in sys.modules if name == "facewright" or name.split(".")[0] == "engine"]:
        if name not in before or name == "facewright":
            del sys.modules[name]
    if kept is not None:
        sys.modules["facewright"] = kept
