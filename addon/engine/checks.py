"""What a JSON file must have: values of a kind, numbers of a shape; otherwise a sentence that says what is missing."""

import math
from collections import Counter
from typing import Any

import numpy as np
from facewright import FacewrightError
from numpy.typing import NDArray


def need(content: Any, key: str, kind: type, where: str = "") -> Any:
    """A value of a kind that must be there."""
    value = content.get(key) if isinstance(content, dict) else None
    # `True` is an `int` to Python.
    if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
        raise FacewrightError(f"{where or 'it'} has no {key}")
    return value


def numbers(rows: Any, shape: tuple[int, int]) -> NDArray[np.float64] | None:
    """Finite numbers of a shape; None if they are not."""
    try:
        values = np.array(rows)
        values = values.reshape(shape) if values.ndim == 2 and values.shape[1] == shape[1] else None
    except ValueError:
        return None
    if values is None or values.dtype.kind not in "if" or not np.isfinite(values).all():
        return None
    return values.astype(np.float64)


def once(names: list[Any], kind: str) -> None:
    """Refuse a list in which anything is there twice."""
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise FacewrightError(f"it has the {kind} {twice[0]} twice")


def number(content: Any, key: str, where: str = "") -> float:
    """A finite number that must be there."""
    value = content.get(key) if isinstance(content, dict) else None
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise FacewrightError(f"{where or 'it'} has no {key}")
    return float(value)


def number_or_none(content: Any, key: str, where: str = "") -> float | None:
    """A finite number, or None where the file says null or nothing."""
    return number(content, key, where) if isinstance(content, dict) and content.get(key) is not None else None
