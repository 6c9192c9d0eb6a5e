"""Writes the files people read and write (airframes, cameras): checked first, then put in their place in one step."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel

from uasfly.errors import FileError
from uasfly.files import load_file

M = TypeVar("M", bound=BaseModel)


def write_checked(path: Path, text: str, model: type[M]) -> M:
    """Check a text beside its place, then move it there; a file that is there already keeps its mode.

    Args:
        path: the file; it is either as before or holds all of the text.
        text: YAML, line ends as they shall be.
        model: what it must be.

    Raises:
        FileError: it cannot be written, or is not what the model describes.
    """
    beside = None
    place = path.resolve()  # a link stays one
    try:
        handle, name = tempfile.mkstemp(prefix=f".{place.stem}-", suffix=".yaml", dir=place.parent)
        beside = Path(name)
        with os.fdopen(handle, "w", encoding="utf-8", newline="") as stream:
            stream.write(text)
        checked = _checked(beside, path, model)
        beside.chmod(place.stat().st_mode & 0o777 if place.exists() else 0o644)
        beside.replace(place)
    except OSError as error:
        raise FileError(str(path), [f"it cannot be written: {error.strerror or error}"]) from None
    finally:
        if beside is not None:
            beside.unlink(missing_ok=True)
    return checked


def _checked(beside: Path, path: Path, model: type[M]) -> M:
    try:
        return load_file(beside, model)
    except FileError as error:
        raise FileError(str(path), error.problems) from None  # nobody has heard of the name beside it
