"""Blower jets: the speed of the air at a point, its turbulence, the stop watch and the hand that holds the blower."""

from __future__ import annotations

import math
from bisect import bisect_right

import numpy as np

from uasfly.sim.wind.noise import NormalTriples
from uasfly.sim.wind.settings import JetSchedule, JetSettings, RadialTable

Vector = tuple[float, float, float]

# The turbulence's filter is renewed when the speed on the axis has changed by this much since the last time.
RENEWAL = 0.05

# Floor of the speed in the turbulence's time constant, far away from the nozzle.
LOWEST_SPEED_M_S = 1.0

_NOTHING = (0.0, 0.0, 0.0)
_LOG2 = math.log(2.0)


def interpolate(points: tuple[tuple[float, float], ...], abscissa: float) -> float:
    """Piecewise linear value of ascending (abscissa, value) points; the end values hold outside."""
    after = bisect_right(points, (abscissa, math.inf))
    if after == 0:
        return points[0][1]
    if after == len(points):
        return points[-1][1]
    (x0, y0), (x1, y1) = points[after - 1], points[after]
    return y0 + (y1 - y0) * (abscissa - x0) / (x1 - x0)


def speed_on_axis(points: tuple[tuple[float, float], ...], distance_m: float) -> float:
    """Speed [m/s] on the axis `distance_m` from the nozzle: 0 behind it, the table, then a decay with 1 / distance.

    The speed of a free round jet falls with 1 / distance (Pope, Turbulent Flows, section 5.1).
    """
    if distance_m < 0.0:
        return 0.0
    last_distance_m, last_speed_m_s = points[-1]
    if distance_m > last_distance_m:
        return last_speed_m_s * last_distance_m / distance_m
    return interpolate(points, distance_m)


def schedule_gate(schedule: JetSchedule, engaged_time_s: float | None) -> float:
    """How far the blower is open, 0..1, at a time on the stop watch [s]; 0 before it starts."""
    if engaged_time_s is None or engaged_time_s < schedule.start_s:
        return 0.0
    gate = _rise(engaged_time_s - schedule.start_s, schedule.edge_s)
    if schedule.end_s is not None and engaged_time_s >= schedule.end_s:
        gate = 1.0 - _rise(engaged_time_s - schedule.end_s, schedule.edge_s)
    return gate


def _rise(elapsed_s: float, edge_s: float) -> float:
    if elapsed_s >= edge_s:
        return 1.0
    return 0.5 - 0.5 * math.cos(math.pi * elapsed_s / edge_s)


class Jet:
    """One blower in flight.

    The turbulence is one Ornstein-Uhlenbeck process along the axis and two across it, discretised exactly; its sigma is
    `intensity` (across: times `cross_fraction`) of the mean speed at the vehicle, its time constant `length_scale_m`
    over the speed on the axis there. Every step draws three random numbers, whatever the vehicle does.

    Args:
        settings: what the scenario file says.
        rng: source of the noise.
        step_s: time between two calls of `step` [s].
    """

    def __init__(self, settings: JetSettings, rng: np.random.Generator, step_s: float) -> None:
        self._schedule = settings.schedule
        self._axis_points = settings.axis_speed
        radial = settings.radial
        self._table = radial.points if isinstance(radial, RadialTable) else None
        self._half_width_m, self._spread = (
            (0.0, 0.0) if isinstance(radial, RadialTable) else (radial.half_width_at_nozzle_m, radial.spread)
        )
        self._direction = dx, dy, dz = settings.direction_in_world
        azimuth = math.radians(settings.azimuth_deg)
        self._level = sx, sy = -math.sin(azimuth), math.cos(azimuth)  # horizontal unit vector across the axis
        self._upright = (-dz * sy, dz * sx, dx * sy - dy * sx)  # direction x level
        self._distance_m = settings.distance_m
        self._aim_x, self._aim_y, self._aim_z = settings.aim_m
        lag_s = settings.follow_lag_s
        share = 1.0 - math.exp(-step_s / lag_s) if lag_s > 0.0 else 1.0
        self._follow_height = 0.0 if settings.follow == "none" else share
        self._follow_level = share if settings.follow == "vehicle" else 0.0
        self._intensity = settings.turbulence.intensity
        self._cross_intensity = settings.turbulence.intensity * settings.turbulence.cross_fraction
        self._length_scale_m = settings.turbulence.length_scale_m
        self._step_s = step_s
        self._noise = NormalTriples(rng)
        self._along, self._across, self._up = self._noise.draw()
        self._tuned_speed_m_s = 0.0
        self._decay = 1.0
        self._drive = 0.0

    @property
    def nozzle_in_world(self) -> Vector:
        """Where the hand holds the nozzle now [m]."""
        dx, dy, dz = self._direction
        d = self._distance_m
        return self._aim_x - d * dx, self._aim_y - d * dy, self._aim_z - d * dz

    def step(self, position_in_world: Vector, engaged_time_s: float | None) -> Vector:
        """Velocity of the jet's air (x, y, z) [m/s] at the vehicle, one step later.

        Args:
            position_in_world: the vehicle [m].
            engaged_time_s: time on the stop watch [s]; None before it starts.
        """
        x, y, z = position_in_world
        self._aim_z += self._follow_height * (z - self._aim_z)
        if self._follow_level:
            self._aim_x += self._follow_level * (x - self._aim_x)
            self._aim_y += self._follow_level * (y - self._aim_y)
        noise_along, noise_across, noise_up = self._noise.draw()
        gate = schedule_gate(self._schedule, engaged_time_s)
        if gate == 0.0:
            return _NOTHING

        dx, dy, dz = self._direction
        x -= self._aim_x
        y -= self._aim_y
        z -= self._aim_z
        beyond_aim = x * dx + y * dy + z * dz
        distance = self._distance_m + beyond_aim
        axis_speed = speed_on_axis(self._axis_points, distance)
        if axis_speed == 0.0:
            return _NOTHING
        offset = math.sqrt(max(0.0, x * x + y * y + z * z - beyond_aim * beyond_aim))
        speed = gate * axis_speed * self._fraction(offset, distance)

        if abs(axis_speed - self._tuned_speed_m_s) > RENEWAL * self._tuned_speed_m_s:
            self._tune(axis_speed)
        decay, drive = self._decay, self._drive
        self._along = decay * self._along + drive * noise_along
        self._across = decay * self._across + drive * noise_across
        self._up = decay * self._up + drive * noise_up
        along = speed * (1.0 + self._intensity * self._along)
        across = speed * self._cross_intensity * self._across
        up = speed * self._cross_intensity * self._up
        sx, sy = self._level
        ux, uy, uz = self._upright
        return along * dx + across * sx + up * ux, along * dy + across * sy + up * uy, along * dz + up * uz

    def _fraction(self, offset_m: float, distance_m: float) -> float:
        if self._table is None:
            ratio = offset_m / (self._half_width_m + self._spread * distance_m)
            return math.exp(-_LOG2 * ratio * ratio)
        if offset_m >= self._table[-1][0]:
            return 0.0
        return interpolate(self._table, offset_m)

    def _tune(self, axis_speed_m_s: float) -> None:
        self._tuned_speed_m_s = axis_speed_m_s
        time_constant_s = self._length_scale_m / max(axis_speed_m_s, LOWEST_SPEED_M_S)
        self._decay = math.exp(-self._step_s / time_constant_s)
        self._drive = math.sqrt(1.0 - self._decay * self._decay)
