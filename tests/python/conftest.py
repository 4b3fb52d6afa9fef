"""The engine's modules for tests without Blender and the library."""

from collections.abc import Callable, Iterator
from types import ModuleType

import engines
import pytest


@pytest.fixture(scope="module")
def engine_module() -> Iterator[Callable[[str], ModuleType]]:
    """What imports a module of `addon/engine` by its name."""
    with engines.engine() as load:
        yield load
