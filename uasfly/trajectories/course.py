"""What a leg needs to know to become motion: its limits, where the vehicle comes from, and how fast it may turn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from uasfly.messages import Array
from uasfly.trajectories.profile import MotionLimits


@dataclass(frozen=True, slots=True)
class Course:
    """Surroundings of a leg.

    Attributes:
        field: the leg in the mission file ("legs[2]"), for errors.
        limits: acceleration and jerk of this leg.
        speed_m_s: speed of moves that give none.
        start: (3,) where the leg before it ends [m].
        turn_time_s: time to turn in place by an angle [rad], or None when the nose does not follow the path.
    """

    field: str
    limits: MotionLimits
    speed_m_s: float
    start: Array
    turn_time_s: Callable[[float], float] | None = None

    def stop_time_s(self, asked_s: float, angle_rad: float) -> float:
        """A stop as long as asked, and long enough to turn to where the path goes on."""
        return asked_s if self.turn_time_s is None else max(asked_s, self.turn_time_s(angle_rad))
