"""What every reference offers to controller and summary, and the error of one that cannot be flown as asked."""

from __future__ import annotations

from typing import Protocol

from uasfly.errors import UasflyError
from uasfly.messages import Array, ReferenceHorizon


class Trajectory(Protocol):
    """A reference over time, at rest before its start and after its end."""

    @property
    def duration_s(self) -> float:
        """Time from start to end [s]."""
        ...

    def sample(self, times_s: Array) -> ReferenceHorizon:
        """Reference at (n,) times [s]; before 0 and after `duration_s` it holds its first and last pose."""
        ...


class TrajectoryError(UasflyError):
    """A leg cannot be flown as asked.

    Args:
        field: field of the mission file, dotted ("legs[2].duration_s").
        text: what was asked, what is possible and how to mend it.
    """

    def __init__(self, field: str, text: str) -> None:
        self.field = field
        self.text = text
        super().__init__(f"{field}: {text}")
