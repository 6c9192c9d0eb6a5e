"""What a preflight check says; it flows like the messages, and the log holds it beside them."""

from __future__ import annotations

import enum
from dataclasses import dataclass


class Verdict(enum.Enum):
    """What a preflight check says."""

    OK = "ok"
    WARNING = "warning"  # the flight goes on, the pilot should know
    STOP = "stop"  # nothing is armed


@dataclass(frozen=True, slots=True)
class PreflightCheck:
    """One line of the preflight check.

    Attributes:
        name: what was looked at; a parameter of PX4 by its own name.
        verdict: what that means for the flight.
        value: what was found, with its unit.
        why: why it matters.
        remedy: what to do about it, "" where all is well.
    """

    name: str
    verdict: Verdict
    value: str
    why: str
    remedy: str = ""
