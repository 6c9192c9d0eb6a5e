"""Faults as lines of text, for a vehicle that is flying: `{kind: gnss_lost, duration_s: 20}`."""

from __future__ import annotations

import json
from collections.abc import Callable

from pydantic import ValidationError

from uasfly.airframe import FileModel
from uasfly.errors import FileError
from uasfly.file_problems import describe_problems
from uasfly.sim.faults import Fault
from uasfly.yaml_text import parse_yaml

LONGEST_LINE = 4096
SOURCE = "fault line"
EXAMPLE = "{kind: gnss_lost, duration_s: 20}"


class FaultLine(FileModel):
    """A line, as if it stood in a file."""

    fault: Fault


def parse_fault(line: str) -> Fault:
    """A fault from one line of YAML (or JSON); its time is left alone.

    Raises:
        FileError: the line is none; the text says what was expected.
    """
    data = parse_yaml(line, SOURCE).data
    try:
        return FaultLine.model_validate_json(json.dumps({"fault": data}), strict=True).fault
    except ValidationError as error:
        problems = describe_problems(error, FaultLine, lambda _: "")
        raise FileError(SOURCE, [f"{problem} (example: {EXAMPLE})" for problem in problems]) from None


class FaultLines:
    """Takes bytes as they come and hands on a fault a line.

    Args:
        inject: takes the faults.
        complain: takes one text for a line that is none.
    """

    def __init__(self, inject: Callable[[Fault], None], complain: Callable[[str], None]) -> None:
        self._inject = inject
        self._complain = complain
        self._rest = b""

    def feed(self, data: bytes) -> None:
        """Take some bytes; a line that never ends is given up."""
        *lines, self._rest = (self._rest + data).split(b"\n")
        if len(self._rest) > LONGEST_LINE:
            self._rest = b""
            self._complain(f"{SOURCE}: a line longer than {LONGEST_LINE} bytes was left out")
        for line in lines:
            if line.strip():
                self._take(line.decode(errors="replace"))

    def _take(self, line: str) -> None:
        try:
            self._inject(parse_fault(line))
        except FileError as error:
            self._complain(str(error))
