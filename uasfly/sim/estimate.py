"""Sensors reduced to an estimate as PX4's filter gives it: truth, plus the errors that the scenario names.

Position carries white noise and, with GNSS, the random walk of Kalaitzakis & Vitzilaios 2023, eq. 11; both change with
each new position. Velocity and attitude carry white noise in each sample and a slow wander (first-order Gauss-Markov).
Without GNSS the estimate goes on by inertia alone: its position runs away with the square of time, and after
EKF2_NOAID_TOUT PX4 calls position and velocity invalid; when GNSS returns the position jumps back.
"""

from __future__ import annotations

import math
from array import array
from collections import deque
from typing import NamedTuple

import numpy as np

from uasfly.frames import quaternion_from_rotation_vector, quaternion_product
from uasfly.messages import OdometrySample
from uasfly.sim.noise_rows import NoiseRows
from uasfly.sim.scenario import Gnss, Sensors

CONVERGED_S = 2.0  # after boot; PX4's simulator needs 2.1 s until it has a heading and a position
DEAD_RECKONING_S = 5.0  # EKF2_NOAID_TOUT
RECOVERY_S = 5.4  # of sound GNSS until PX4's estimator is sure of its position again (recording: 4.7 to 5.7 s)
PROBATION_S = 1.0  # from then until the commander relies on it (recording: 6.3 to 6.5 s of sound GNSS)
_WANDER_STEPS = 10  # the wander is renewed every tenth step: its time constant is seconds
_DEAD_RECKONING_M_S2 = 0.03  # sigma of the acceleration error that inertia is left with; assumed
_USUAL_ACCURACY_M = 0.3

# columns of a noise row
_GYRO = slice(0, 3)
_ATTITUDE = slice(3, 6)
_VELOCITY = slice(6, 9)
_POSITION = slice(9, 12)
_WALK = slice(12, 15)
_WANDER = slice(15, 21)
_LOST = slice(21, 23)
_WIDTH = 23

Vector = tuple[float, float, float]


class _Truth(NamedTuple):
    """What delayed samples need of a past step."""

    position: Vector
    velocity: Vector
    attitude: tuple[float, float, float, float]


class Estimate:
    """PX4's estimate of one vehicle's motion.

    Args:
        sensors: figures of the scenario.
        rng: source of all its noise.
        plant_state: the plant's state (see `body`), read at every step.
        step_s: time of a step.

    Attributes:
        position, velocity: estimate now, world [m], [m/s].
        attitude_error: (3,) [rad] small rotation in the body, without the white noise of single samples.
        gyro_error: (3,) [rad/s], new in every step.
        gnss_available: whether GNSS (or motion capture) gives positions.
        reset_counter: grows when the position jumps.
        engaged_for_s: time since the vehicle first went into offboard, None before; set from outside.
    """

    def __init__(self, sensors: Sensors, rng: np.random.Generator, plant_state: array[float], step_s: float) -> None:
        self._sensors = sensors
        self._state = plant_state
        self._step_s = step_s
        self._noise = NoiseRows(rng, _WIDTH)
        self._steps = 0
        self._next_position_s = 0.0
        self._bias: list[float] = list(sensors.gnss.initial_bias_m) if sensors.gnss else [0.0, 0.0, 0.0]
        self._held = [0.0, 0.0, 0.0]
        self._decay = math.exp(-_WANDER_STEPS * step_s / sensors.wander_time_s)
        self._wander = [sigma * n for sigma, n in zip(self._wander_sigmas(), self._noise.row[_WANDER], strict=True)]
        self._lost_since_s: float | None = None
        self._found_since_s = -math.inf
        self._lost_acceleration = (0.0, 0.0)
        self._drift = [0.0, 0.0]
        self._drift_velocity = [0.0, 0.0]
        longest = max(sensors.delays.position_s, sensors.delays.velocity_s, sensors.delays.attitude_s)
        self._past: deque[_Truth] | None = deque(maxlen=1 + round(longest / step_s)) if longest > 0.0 else None
        self.position: Vector = (0.0, 0.0, 0.0)
        self.velocity: Vector = (0.0, 0.0, 0.0)
        self.attitude_error = array("d", self._wander[3:])
        self.gyro_error = array("d", [0.0, 0.0, 0.0])
        self.gnss_available = True
        self.gnss_offset: Vector = (0.0, 0.0, 0.0)
        self.reset_counter = 0
        self.engaged_for_s: float | None = None
        self.advance()

    def advance(self) -> None:
        """Draw the errors of the present step; call once a step, with the plant's state in place."""
        noise = self._noise
        noise.advance()
        sigma = self._sensors.angular_rate_noise_rad_s
        a, b, c = noise.row[_GYRO]
        gyro = self.gyro_error
        gyro[0], gyro[1], gyro[2] = sigma * a, sigma * b, sigma * c
        if self._steps % _WANDER_STEPS == 0:
            self._renew_wander()
        if self._past is not None:
            state = self._state
            self._past.append(_Truth(_triple(state, 0), _triple(state, 3), (state[6], state[7], state[8], state[9])))
        now = self._steps * self._step_s
        if not self.gnss_available:
            self._drift_away()
        elif now >= self._next_position_s - 1e-9:
            self._renew_position(now)
        self._steps += 1

    def refresh(self) -> None:
        """Work out `position` and `velocity` for the present step."""
        state, row, wander, held = self._state, self._noise.row, self._wander, self._held
        if self._past is None:
            x, y, z, vx, vy, vz = state[0:6]
        else:
            delays = self._sensors.delays
            x, y, z = self._before(delays.position_s).position
            vx, vy, vz = self._before(delays.velocity_s).velocity
        sigma = self._sensors.velocity_noise_m_s
        na, nb, nc = row[_VELOCITY]
        drift, drift_velocity = self._drift, self._drift_velocity
        self.position = (x + held[0] + drift[0], y + held[1] + drift[1], z + held[2])
        self.velocity = (
            vx + wander[0] + sigma * na + drift_velocity[0],
            vy + wander[1] + sigma * nb + drift_velocity[1],
            vz + wander[2] + sigma * nc,
        )

    def odometry(self, time_s: float) -> OdometrySample:
        """The estimate as ODOMETRY gives it, with the white noise of a single sample."""
        self.refresh()
        state = self._state
        attitude = state[6:10] if self._past is None else self._before(self._sensors.delays.attitude_s).attitude
        white = self._sensors.attitude_noise_rad
        (ea, eb, ec), (na, nb, nc) = self.attitude_error, self._noise.row[_ATTITUDE]
        error = np.array((ea + white * na, eb + white * nb, ec + white * nc))
        quaternion = quaternion_product(np.array(attitude), quaternion_from_rotation_vector(error))
        (ra, rb, rc), (ga, gb, gc) = state[10:13], self.gyro_error
        rate = np.array((ra + ga, rb + gb, rc + gc))
        return OdometrySample(
            time_s, np.array(self.position), np.array(self.velocity), quaternion, rate, self.reset_counter
        )

    def set_gnss(self, available: bool) -> None:
        """Take the source of positions away, or give it back."""
        if available == self.gnss_available:
            return
        self.gnss_available = available
        now = self._steps * self._step_s
        if available:
            self._found_since_s = now if self._gave_up(now) else -math.inf
            self._lost_since_s = None
            jumped = math.hypot(*self._drift) > _USUAL_ACCURACY_M
            self.reset_counter = (self.reset_counter + jumped) % 256
            self._drift, self._drift_velocity = [0.0, 0.0], [0.0, 0.0]
            self._next_position_s = now
        else:
            self._lost_since_s = now
            a, b = self._noise.row[_LOST]
            self._lost_acceleration = (_DEAD_RECKONING_M_S2 * a, _DEAD_RECKONING_M_S2 * b)

    @property
    def position_ok(self) -> bool:
        """Whether PX4 calls position and horizontal velocity valid."""
        now = self._steps * self._step_s
        return now >= CONVERGED_S and not self._gave_up(now) and now - self._found_since_s >= RECOVERY_S

    @property
    def position_trusted(self) -> bool:
        """Whether PX4's commander relies on the position: valid, and that for a while."""
        now = self._steps * self._step_s - PROBATION_S
        return self.position_ok and now >= CONVERGED_S and now - self._found_since_s >= RECOVERY_S

    @property
    def attitude_ok(self) -> bool:
        """Whether the attitude is valid."""
        return self._steps * self._step_s >= CONVERGED_S

    @property
    def horizontal_accuracy_m(self) -> float:
        """What the filter thinks of its horizontal position [m]: grows with the square of the time without GNSS."""
        lost = 0.0 if self._lost_since_s is None else self._steps * self._step_s - self._lost_since_s
        return math.hypot(_USUAL_ACCURACY_M, 0.05 * lost * lost)

    @property
    def position_bias(self) -> Vector:
        """Slow error of the position source [m]."""
        x, y, z = (b + offset for b, offset in zip(self._bias, self.gnss_offset, strict=True))
        return x, y, z

    def _gave_up(self, now: float) -> bool:
        return self._lost_since_s is not None and now - self._lost_since_s > DEAD_RECKONING_S

    def _before(self, delay_s: float) -> _Truth:
        past = self._past
        assert past is not None
        return past[max(0, len(past) - 1 - round(delay_s / self._step_s))]

    def _wander_sigmas(self) -> tuple[float, ...]:
        velocity, attitude = self._sensors.velocity_wander_m_s, self._sensors.attitude_wander_rad
        return velocity, velocity, velocity, attitude, attitude, attitude

    def _renew_wander(self) -> None:
        decay, fresh = self._decay, math.sqrt(1.0 - self._decay**2)
        triples = zip(self._wander, self._wander_sigmas(), self._noise.row[_WANDER], strict=True)
        self._wander = [decay * old + fresh * sigma * n for old, sigma, n in triples]
        self.attitude_error[:] = array("d", self._wander[3:])

    def _renew_position(self, now: float) -> None:
        period = 1.0 / self._sensors.position_rate_hz
        self._next_position_s = max(self._next_position_s + period, now)
        gnss = self._sensors.gnss
        if gnss is not None and self._walks(gnss):
            walk = gnss.random_walk_m_sqrt_s * math.sqrt(period)
            self._bias = [b + walk * n for b, n in zip(self._bias, self._noise.row[_WALK], strict=True)]
        white, noise = self._sensors.position_white_sigma_m, self._noise.row[_POSITION]
        self._held = [b + white * n + offset for b, n, offset in zip(self._bias, noise, self.gnss_offset, strict=True)]

    def _walks(self, gnss: Gnss) -> bool:
        if gnss.walk_from_s is None:
            return True
        return self.engaged_for_s is not None and self.engaged_for_s >= gnss.walk_from_s

    def _drift_away(self) -> None:
        dt = self._step_s
        for axis in (0, 1):
            self._drift_velocity[axis] += self._lost_acceleration[axis] * dt
            self._drift[axis] += self._drift_velocity[axis] * dt


def _triple(state: array[float], start: int) -> Vector:
    return state[start], state[start + 1], state[start + 2]
