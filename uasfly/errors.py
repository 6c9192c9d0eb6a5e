"""The one exception root. An error says where it is, what was expected, what was found and how to mend it."""

from __future__ import annotations


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
