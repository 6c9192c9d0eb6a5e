"""What has to be cleared before anything is armed."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class Clearance:
    """Whether the preflight check lets the flight go on.

    Attributes:
        needed: a preflight check has to clear each take-off.
        only_check: the flight is over when it is cleared.
        awaited: all else is ready, or has been given up: it is time to judge.
        given: it was cleared.
    """

    needed: bool = False
    only_check: bool = False
    awaited: bool = False
    given: bool = False
