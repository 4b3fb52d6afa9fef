"""Text files, written whole or not at all."""

import os
from pathlib import Path

from facewright import FacewrightError


def write_text(path: str, text: str) -> None:
    """Write a file in one step; one that is there stays as it is when that fails."""
    part = Path(f"{path}.part")
    try:
        part.write_text(text, encoding="utf-8")
        os.replace(part, path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise FacewrightError(f"{path} cannot be written: {error.strerror}") from error
