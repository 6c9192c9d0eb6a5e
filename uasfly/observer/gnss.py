"""GNSS that is out or runs away: what of a sample may still be used, and when it is no longer followed.

In flight without GNSS, PX4 goes on by inertia: its position is the integral of its velocity and no measurement any
more, and its velocity runs away, the longer the faster.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

from uasfly.messages import HealthSample
from uasfly.observer import states as s
from uasfly.observer.door import Odometry
from uasfly.observer.moment import Verdict

FIX = 3  # GNSS fix type of a three-dimensional position
INERTIAL_DRIFT_M_S2 = 0.03  # PX4's velocity runs away with about this without GNSS (its own simulator)
DRIFT_WINDOW_S = 1.0
SLOWEST_DRIFT_M_S = 0.35
DRIFT_SIGMAS = 4.0  # of the random walk that GNSS is known to have, over the window
LONGEST_ELAPSED_S = 0.2
CONFIRMED_S = 0.1  # for so long it must go on: a single wrong position is no drift
MEMORY_SAMPLES = 30.0  # samples that the filter's memory averages over; a wander does not average out

_POSITION = s.SENSORS[s.POSITION_SENSOR]

Vector = tuple[float, float, float]


class Outage:
    """Whether GNSS is out, as PX4 tells it."""

    def __init__(self, velocity_sigma_m_s: float) -> None:
        self._sigma_m_s = 0.3 * velocity_sigma_m_s  # as small as the matching may make it
        self._had_fix = False
        self._velocity_ok = True
        self._since_s: float | None = None

    @property
    def active(self) -> bool:
        """Whether the position is no measurement now."""
        return self._since_s is not None

    def hear(self, health: HealthSample) -> None:
        """What PX4 says of its estimator and its GNSS; a vehicle that never had a fix flies by something else."""
        self._had_fix |= health.gnss_fix >= FIX
        lost = not health.position_ok or (self._had_fix and health.gnss_fix < FIX)
        self._velocity_ok = health.velocity_ok
        if not lost:
            self._since_s = None
        elif self._since_s is None:
            self._since_s = health.time_s

    def usable(self, odometry: Odometry) -> Odometry:
        """What of a sample is a measurement during the outage."""
        attitude, _, velocity = odometry.use
        since_s = odometry.time_s if self._since_s is None else self._since_s
        runaway = INERTIAL_DRIFT_M_S2 * max(0.0, odometry.time_s - since_s)
        return replace(
            odometry,
            use=(attitude, 0.0, velocity if self._velocity_ok else 0.0),
            velocity_factor=1.0 + MEMORY_SAMPLES * (runaway / self._sigma_m_s) ** 2,
        )


class DriftWatch:
    """Holds the measured position against the velocity: what runs away from it is GNSS, and its bias is set free.

    Slower than the gates notice, so it looks at where GNSS says the vehicle is, minus the integral of its velocity.

    Attributes:
        speed_m_s: at which they part, mean over DRIFT_WINDOW_S.
    """

    def __init__(self, bias_density: float) -> None:
        """Take the random walk [m/sqrt(s)] that is no drift."""
        self._limit_m_s = max(SLOWEST_DRIFT_M_S, DRIFT_SIGMAS * bias_density / math.sqrt(DRIFT_WINDOW_S))
        self._past: deque[tuple[float, Vector]] = deque()
        self._time_s = -math.inf
        self._agreed_s = -math.inf
        self._velocity = [0.0, 0.0, 0.0]
        self._way = (0.0, 0.0, 0.0)
        self.speed_m_s = 0.0
        self._runs_since_s = math.inf

    def look(self, odometry: Odometry, verdicts: tuple[Verdict, ...]) -> None:
        """A sample, and what the gates said of it; a velocity that is refused proves nothing."""
        agrees = True
        for verdict in verdicts:
            agrees &= verdict.accepted or verdict.sensor == _POSITION
        elapsed = odometry.time_s - self._time_s
        if not 0.0 <= elapsed < LONGEST_ELAPSED_S:
            self._past.clear()
            elapsed = 0.0
        self._time_s = odometry.time_s
        if agrees:
            self._agreed_s = odometry.time_s
        elif odometry.time_s - self._agreed_s > LONGEST_ELAPSED_S:
            self._past.clear()
            self.speed_m_s = 0.0
            self._runs_since_s = math.inf
        if agrees and odometry.use[s.VELOCITY_SENSOR]:
            self._velocity = odometry.velocity
        vx, vy, vz = self._velocity
        wx, wy, wz = self._way
        self._way = wx, wy, wz = wx + vx * elapsed, wy + vy * elapsed, wz + vz * elapsed
        if not (agrees and all(odometry.use)):
            return
        x, y, z = odometry.position
        now = (x - wx, y - wy, z - wz)
        past = self._past
        past.append((odometry.time_s, now))
        while past[0][0] < odometry.time_s - DRIFT_WINDOW_S:
            past.popleft()
        self.speed_m_s = math.dist(now, past[0][1]) / DRIFT_WINDOW_S
        if self.speed_m_s <= self._limit_m_s:
            self._runs_since_s = math.inf
        elif self._runs_since_s == math.inf:
            self._runs_since_s = odometry.time_s

    @property
    def runs_away(self) -> bool:
        """Whether GNSS is not to be followed."""
        return self._time_s - self._runs_since_s >= CONFIRMED_S
