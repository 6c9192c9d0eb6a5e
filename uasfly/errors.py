"""The one exception root. An error says where it is, what was expected, what was found and how to mend it."""

from __future__ import annotations

import os
import traceback
from pathlib import Path

DEBUG_VARIABLE = "UASFLY_DEBUG"
MOST_PROBLEMS = 30  # a file with more is not mended by reading them all
LONGEST_NAME = 60


class UasflyError(Exception):
    """Base of every error that uasfly raises on purpose; the command line prints it and exits with code 2."""

    def __str__(self) -> str:
        """The text, safe to be printed: what a file or a flag holds may stand in it."""
        return printable(super().__str__())


class FileError(UasflyError):
    """A file (mission, airframe, plant, scenario, log) cannot be used.

    Args:
        path: the file as the user named it.
        problems: one text a problem, each naming line, field, what was expected and what was found.
    """

    def __init__(self, path: str, problems: list[str]) -> None:
        self.path = path
        self.problems = [printable(problem) for problem in problems[:MOST_PROBLEMS]]
        if len(problems) > MOST_PROBLEMS:
            self.problems.append(f"and more than {MOST_PROBLEMS} problems in all; mend these first")
        super().__init__("\n".join(f"{path}: {problem}" for problem in self.problems))

    def __reduce__(self) -> tuple[type[FileError], tuple[str, list[str]]]:
        """How it travels between processes; by the text alone it could not be made again, and a pool would hang."""
        return type(self), (self.path, self.problems)


class LinkError(UasflyError):
    """The vehicle cannot be reached, or the connection to it cannot be opened."""


class CommandRefusedError(UasflyError):
    """The vehicle refused a command (arm, mode change, ...) or did not answer it."""


def printable(text: str) -> str:
    """A text without characters that move a terminal's cursor, colour it or hide; they are shown as escapes."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c == "\n" else c.encode("unicode_escape").decode() for c in text)


def shortened(text: str, length: int = LONGEST_NAME) -> str:
    """A name on one line, or the beginning of one that is too long to be shown."""
    text = text.replace("\n", "\\n")
    return text if len(text) <= length else text[: length - 3] + "..."


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
