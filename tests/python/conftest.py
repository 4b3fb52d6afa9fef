"""The library for tests without Blender: the one in the extension's zip."""

import importlib
import os
import sys
from io import BytesIO
from pathlib import Path
from types import ModuleType
from zipfile import ZipFile

import pytest


@pytest.fixture(scope="session")
def facewright(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """The library."""
    folder = tmp_path_factory.mktemp("library")
    with ZipFile(os.environ["FACEWRIGHT_ZIP"]) as extension:
        (wheel,) = (name for name in extension.namelist() if name.endswith(".whl"))
        with ZipFile(BytesIO(extension.read(wheel))) as content:
            content.extractall(folder)
    sys.path.insert(0, str(folder))
    return importlib.import_module("facewright")


@pytest.fixture(scope="session")
def assets(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The generic head and the nets."""
    folder = tmp_path_factory.mktemp("extension")
    with ZipFile(os.environ["FACEWRIGHT_ZIP"]) as extension:
        extension.extractall(folder, [name for name in extension.namelist() if name.startswith("assets/")])
    return folder / "assets"
