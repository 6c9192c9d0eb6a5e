"""The one exception root. An error says where it is, what was expected, what was found and how to mend it."""

from __future__ import annotations

import os
import traceback
from pathlib import Path

DEBUG_VARIABLE = "UASFLY_DEBUG"


class UasflyError(Exception):
    """Base of every error that uasfly raises on purpose; the command line prints it and exits with code 2."""


class FileError(UasflyError):
    """A file (mission, airframe, plant, scenario, log) cannot be used.

    Args:
        path: the file as the user named it.
        problems: one text a problem, each naming line, field, what was expected and what was found.
    """

    def __init__(self, path: str, problems: list[str]) -> None:
        self.path = path
        self.problems = problems
        super().__init__("\n".join(f"{path}: {problem}" for problem in problems))


class LinkError(UasflyError):
    """The vehicle cannot be reached, or the connection to it cannot be opened."""


class CommandRefusedError(UasflyError):
    """The vehicle refused a command (arm, mode change, ...) or did not answer it."""


def describe_error(error: BaseException) -> str:
    """One line about any error; for one that was not raised on purpose also its kind and place.

    Where the environment variable UASFLY_DEBUG is set its traceback goes to standard error.
    """
    if isinstance(error, UasflyError):
        return str(error)
    if os.environ.get(DEBUG_VARIABLE):
        traceback.print_exception(error)
    frames = traceback.extract_tb(error.__traceback__)
    place = f" in {Path(frames[-1].filename).name}, line {frames[-1].lineno}" if frames else ""
    return f"internal error: {type(error).__name__}: {error}{place} (set {DEBUG_VARIABLE}=1 for all of it)"
