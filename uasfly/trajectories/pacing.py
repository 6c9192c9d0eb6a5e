"""The mission's own time as a smooth function of the clock: as planned, slower, held, or back along the way it came."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from uasfly.messages import Array, ReferenceHorizon

CHANGE_S = 1.5  # from one pace to another


class Timed(Protocol):
    """A reference over its own time."""

    def sample(self, times_s: Array) -> ReferenceHorizon:
        """Reference at (n,) times."""
        ...


class Pacing:
    """Mission time s(t) whose rate, the pace, goes from one value to another along a smoothstep; ds/dt is continuous.

    Args:
        clock_s: when it begins.
        mission_s: the mission's time then.
        pace: its rate from then on.
    """

    def __init__(self, clock_s: float, mission_s: float, pace: float) -> None:
        self._clock_s = clock_s
        self._mission_s = mission_s
        self._from = self._to = pace

    @property
    def target(self) -> float:
        """The pace that is gone to."""
        return self._to

    def change(self, clock_s: float, pace: float) -> None:
        """Go to another pace from `clock_s` on."""
        if pace == self._to:
            return
        self._mission_s, self._from = self.mission_time_s(clock_s), self.pace(clock_s)
        self._clock_s, self._to = clock_s, pace

    def mission_time_s(self, clock_s: float) -> float:
        """The mission's time at a time of the clock."""
        return self.at(clock_s)[0]

    def pace(self, clock_s: float) -> float:
        """The rate at a time of the clock."""
        return self.at(clock_s)[1]

    def onto(self, timed: Timed, clock_s: Array) -> ReferenceHorizon:
        """The reference at (n,) times of the clock, with its derivatives by the clock."""
        if self._from == self._to or bool((clock_s >= self._clock_s + CHANGE_S).all()):
            return self._onto_steadily(timed, clock_s)
        mission_s, pace, change = self._at_all(clock_s)
        reference = timed.sample(mission_s)
        velocity, acceleration = reference.velocity_in_world, reference.acceleration_in_world
        return ReferenceHorizon(
            clock_s,
            reference.position_in_world,
            velocity * pace[:, None],
            acceleration * (pace * pace)[:, None] + velocity * change[:, None],
            reference.yaw_rad,
            reference.yaw_rate_rad_s * pace,
        )

    def _onto_steadily(self, timed: Timed, clock_s: Array) -> ReferenceHorizon:
        """The same where the pace does not change, which is nearly always."""
        begin_s, pace = self._clock_s + CHANGE_S, self._to
        reference = timed.sample(self.at(begin_s)[0] + pace * (clock_s - begin_s))
        velocity, acceleration = reference.velocity_in_world, reference.acceleration_in_world
        yaw_rate = reference.yaw_rate_rad_s
        if pace != 1.0:
            velocity, acceleration, yaw_rate = velocity * pace, acceleration * (pace * pace), yaw_rate * pace
        return ReferenceHorizon(
            clock_s, reference.position_in_world, velocity, acceleration, reference.yaw_rad, yaw_rate
        )

    def at(self, clock_s: float) -> tuple[float, float]:
        """The mission's time and its rate at a time of the clock."""
        elapsed = clock_s - self._clock_s
        if self._from == self._to:
            return self._mission_s + self._from * elapsed, self._from
        u = min(max(elapsed / CHANGE_S, 0.0), 1.0)
        change = self._to - self._from
        gone = CHANGE_S * u**3 * (1.0 - 0.5 * u) + max(elapsed - CHANGE_S, 0.0)
        mission = self._mission_s + self._from * elapsed + change * gone
        return mission, self._from + change * u * u * (3.0 - 2.0 * u)

    def _at_all(self, clock_s: Array) -> tuple[Array, Array, Array]:
        """Mission time, pace and its derivative at (n,) times of the clock."""
        elapsed = clock_s - self._clock_s
        u = np.clip(elapsed / CHANGE_S, 0.0, 1.0)
        change = self._to - self._from
        pace = self._from + change * u * u * (3.0 - 2.0 * u)
        gone = CHANGE_S * u**3 * (1.0 - 0.5 * u) + np.maximum(elapsed - CHANGE_S, 0.0)
        mission = self._mission_s + self._from * elapsed + change * gone
        return mission, pace, change * 6.0 * u * (1.0 - u) / CHANGE_S
