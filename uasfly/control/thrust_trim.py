"""Thrust coefficient and vertical wind told apart, slowly: what stays for minutes is the coefficient's error.

Near hover the vertical balance is g = (1 + trim) T + w, with T the thrust that airframe file and voltage promise and w
the force of the wind. One sample cannot tell trim from wind; their course over time can. The trim is a random walk (a
battery that sags, propellers that wear, a payload), the wind a first-order Gauss-Markov process of mean zero: close to
the ground the mean vertical wind is nil. A Kalman filter of these two states (Gelb 1974, Applied Optimal Estimation,
3.6 and 4.2) takes the force from one to the other. How strong the vertical wind is it finds out itself, so that strong
gusts and jets move the trim only slowly: the force low-passed over the wind's time has the density at low frequencies
of the process that is assumed, however fast the true gusts are. A jet that lifts for minutes is taken for thrust in
the end.
"""

from __future__ import annotations

import math

from uasfly.airframe import GRAVITY_M_S2

LIMIT = 0.25  # either way; what is beyond stays in the force
FIRST_SIGMA = 0.05  # of the trim at lift-off: file, payload, charge
WALK_DENSITY = 0.06 / math.sqrt(600.0)  # 1/sqrt(s): 6 % in ten minutes; a battery's 10 % in five lags 0.03 m/s^2 behind
WIND_TIME_S = 3.0  # of the vertical wind's correlation, and of the low-pass that tells how strong it is
LEAST_WIND_M_S2 = 0.1  # standard deviation of the slow part of its force, at least
FIRST_WIND_M_S2 = 0.3
RISE_S, FALL_S = 2.0, 15.0  # over which the variance is followed: a jet counts soon, a lull late
ROTOR_WALK_DENSITY = 0.01 / math.sqrt(600.0)  # where rotor speeds tell the thrust: payload and air change little
NEAR_HOVER_M_S = 0.3  # faster climbs change the rotors' inflow, and with it the thrust: by 3 % at this
LARGEST_SIGMAS = 1.5  # an innovation beyond counts as one of this size (Huber 1964): the first second of a push
LONGEST_STEP_S = 1.0  # what came before a longer pause tells nothing of the wind


class ThrustTrim:
    """Share by which the thrust is more (negative: less) than the airframe file says for command and voltage.

    Attributes:
        trim: -LIMIT..LIMIT.
        walk_density: [1/sqrt(s)] of its random walk.
    """

    def __init__(self) -> None:
        self.trim = 0.0
        self.walk_density = WALK_DENSITY
        self._time_s = -math.inf
        self.lift_off()

    def lift_off(self) -> None:
        """Whatever happened on the ground: the trim is known less well, the wind not at all."""
        self._wind = self._slow = 0.0  # m/s^2: force of the wind, and the force low-passed
        self._variance = FIRST_WIND_M_S2**2  # of the wind's slow part
        self._tt, self._tw, self._ww = FIRST_SIGMA**2, 0.0, self._variance  # covariance of trim and wind

    @property
    def sigma(self) -> float:
        """Standard deviation of the trim."""
        return math.sqrt(self._tt)

    def update(self, time_s: float, force_up_m_s2: float, force_sigma_m_s2: float, climb_m_s: float) -> float:
        """Take in the observer's vertical force in flight; returns the trim. Climbs and bad numbers teach nothing.

        Args:
            time_s: now.
            force_up_m_s2: estimated with the present trim, world z.
            force_sigma_m_s2: its standard deviation.
            climb_m_s: vertical velocity.
        """
        elapsed_s = time_s - self._time_s
        if elapsed_s > 0.0 and math.isfinite(force_up_m_s2 + force_sigma_m_s2) and abs(climb_m_s) < NEAR_HOVER_M_S:
            elapsed_s = min(elapsed_s, LONGEST_STEP_S)
            self._predict(elapsed_s)
            self._find_strength(force_up_m_s2, elapsed_s)
            self._correct(force_up_m_s2, force_sigma_m_s2)
        if math.isfinite(time_s):
            self._time_s = time_s
        return self.trim

    def _predict(self, elapsed_s: float) -> None:
        kept = math.exp(-elapsed_s / WIND_TIME_S)
        self._wind *= kept
        self._tw *= kept
        self._ww = kept * kept * self._ww + (1.0 - kept * kept) * self._variance
        self._tt = min(self._tt + self.walk_density * self.walk_density * elapsed_s, FIRST_SIGMA * FIRST_SIGMA)

    def _find_strength(self, force_m_s2: float, elapsed_s: float) -> None:
        self._slow += (1.0 - math.exp(-elapsed_s / WIND_TIME_S)) * (force_m_s2 - self._slow)
        more = self._slow * self._slow - self._variance
        self._variance += (1.0 - math.exp(-elapsed_s / (RISE_S if more > 0.0 else FALL_S))) * more
        self._variance = max(self._variance, LEAST_WIND_M_S2 * LEAST_WIND_M_S2)

    def _correct(self, force_m_s2: float, sigma_m_s2: float) -> None:
        # The mean thrust: the momentary one answers to the wind, and taken for a slope would tell a trim out of gusts.
        thrust = GRAVITY_M_S2 / (1.0 + self.trim)
        with_trim = thrust * self._tt + self._tw  # covariance of the force with either state
        with_wind = thrust * self._tw + self._ww
        variance = thrust * with_trim + with_wind + sigma_m_s2 * sigma_m_s2
        largest = LARGEST_SIGMAS * math.sqrt(variance)
        innovation = min(max(force_m_s2 - self._wind, -largest), largest)
        self.trim = min(max(self.trim + with_trim / variance * innovation, -LIMIT), LIMIT)
        self._wind += with_wind / variance * innovation
        self._tt -= with_trim * with_trim / variance
        self._tw -= with_trim * with_wind / variance
        self._ww -= with_wind * with_wind / variance
