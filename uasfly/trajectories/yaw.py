"""Yaw over time: what a rule asks along a motion, smooth turns in place, and a bound on the rate.

Yaw is kept as knots joined by cubics (Hermite), unwrapped: it never jumps by a turn.
"""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from uasfly.messages import Array
from uasfly.mission import FacingYaw, FixedYaw, PathYaw
from uasfly.trajectories.pieces import PieceTable
from uasfly.trajectories.segments import Segments, segment_function

KNOT_INTERVAL_S = 0.02
SPEED_UP_S = 0.5  # a turn reaches its highest rate in no less than about this time
UNDEFINED_M = 1e-6  # closer to the faced point, or slower [m/s], than this a rule asks for nothing
SMOOTHING_S = 0.3
PEAK_RATE = 1.88  # of the quintic turn, for unit angle and time: 15/8 and a little for the cubics between the knots
PEAK_ACCELERATION = 10.0 / math.sqrt(3.0)


@dataclass(frozen=True, slots=True)
class YawKnots:
    """Yaw and its rate at times from the start of a span.

    Attributes:
        times_s: (n,), ascending. yaw_rad: (n,), unwrapped. rate_rad_s: (n,), zero at both ends.
        asked_rate_rad_s: highest rate that the rule asked for before it was bounded.
    """

    times_s: Array
    yaw_rad: Array
    rate_rad_s: Array
    asked_rate_rad_s: float = 0.0


def turn_time_s(angle_rad: float, rate_rad_s: float) -> float:
    """Time to turn in place by an angle with at most that rate."""
    angle = abs(angle_rad)
    return max(PEAK_RATE * angle / rate_rad_s, math.sqrt(PEAK_ACCELERATION * angle * SPEED_UP_S / rate_rad_s))


def nearest_turn(yaw_rad: float, reference_rad: float) -> float:
    """The angle equal to `yaw_rad` but for whole turns that is nearest to the reference."""
    return yaw_rad + 2.0 * math.pi * round((reference_rad - yaw_rad) / (2.0 * math.pi))


def constant(yaw_rad: float, duration_s: float) -> YawKnots:
    """One heading."""
    return YawKnots(np.array((0.0, duration_s)), np.array((yaw_rad, yaw_rad)), np.zeros(2))


def turn(start_rad: float, end_rad: float, duration_s: float) -> YawKnots:
    """From one heading to another in exactly that time, at rest at both ends."""
    if start_rad == end_rad:
        return constant(start_rad, duration_s)
    times = _knot_times(duration_s)
    left = times / duration_s * (1.0 - times / duration_s)
    rate = (end_rad - start_rad) / duration_s * 30.0 * left**2
    return YawKnots(times, _quintic(times, start_rad, end_rad, 0.0, duration_s), rate)


def along(
    rule: FixedYaw | PathYaw | FacingYaw, table: PieceTable, before_rad: float, rate_limit_rad_s: float
) -> YawKnots:
    """What a rule asks along a leg, its rate bounded.

    Args:
        rule: the rule; its points are in the table's frame.
        table: the leg's motion.
        before_rad: heading before the leg; kept where the rule asks for nothing.
        rate_limit_rad_s: highest rate; what the rule asks beyond it is followed late.
    """
    if isinstance(rule, FixedYaw):
        return constant(nearest_turn(rule.yaw_rad, before_rad), table.duration_s)
    times = _knot_times(table.duration_s)
    position, velocity, _ = table.sample(times)
    way = velocity[:, :2] if isinstance(rule, PathYaw) else np.array(rule.point_m) - position[:, :2]
    yaw = np.where(np.hypot(way[:, 0], way[:, 1]) > UNDEFINED_M, np.arctan2(way[:, 1], way[:, 0]), np.nan)
    defined = np.flatnonzero(~np.isnan(yaw))
    if defined.size == 0:
        return constant(before_rad, table.duration_s)
    yaw[defined] = np.unwrap(yaw[defined])
    yaw += nearest_turn(float(yaw[defined[0]]), before_rad) - float(yaw[defined[0]])
    _fill_gaps(times, yaw, defined, rate_limit_rad_s)
    if not np.any(yaw != yaw[0]):
        return constant(float(yaw[0]), table.duration_s)
    asked = float(np.max(np.abs(np.diff(yaw)) / np.diff(times)))
    if asked > rate_limit_rad_s:
        yaw = _bounded(times, yaw, rate_limit_rad_s)
    rate = np.zeros_like(yaw)  # a leg begins and ends at rest
    rate[1:-1] = (yaw[2:] - yaw[:-2]) / (times[2:] - times[:-2])
    return YawKnots(times, yaw, rate, asked)


@lru_cache(maxsize=1)
def _yaw_function() -> ca.Function:
    """Yaw [rad] and its rate [rad/s] from the coefficients (4,) of a cubic."""

    def motion(t: ca.SX, row: ca.SX) -> list[ca.SX]:
        yaw = row[0] + t * (row[1] + t * (row[2] + t * row[3]))
        return [yaw, ca.jacobian(yaw, t)]

    return segment_function("uasfly_yaw", 4, motion)


class YawTable:
    """Samples the knots of consecutive spans at many times at once; one table is for one thread.

    Args:
        spans: the knots.
        heading_rad: added to every yaw.
    """

    def __init__(self, spans: list[YawKnots], heading_rad: float = 0.0) -> None:
        widths, coefficients = zip(*(_hermite(span) for span in spans), strict=True)
        self._widths_s, self._coefficients = np.concatenate(widths), np.concatenate(coefficients, axis=1).T
        self._segments = self._turned(heading_rad)

    def turned(self, heading_rad: float) -> YawTable:
        """The same with another heading."""
        result = copy.copy(self)
        result._segments = self._turned(heading_rad)
        return result

    def sample(self, times_s: Array) -> tuple[Array, Array]:
        """Yaw [rad] and yaw rate [rad/s], (n,) each, at (n,) times, which are clamped."""
        yaw, rate = self._segments.sample(times_s)
        return yaw[:, 0], rate[:, 0]

    def _turned(self, heading_rad: float) -> Segments:
        coefficients = self._coefficients.copy()
        coefficients[:, 0] += heading_rad
        return Segments(_yaw_function(), self._widths_s, coefficients)


def _knot_times(duration_s: float) -> Array:
    return np.linspace(0.0, duration_s, max(2, math.ceil(duration_s / KNOT_INTERVAL_S) + 1))


def _quintic(times: Array, start: float, end: float, begin_s: float, duration_s: float) -> Array:
    """Fifth-order step with rate and acceleration zero at both ends."""
    tau = np.clip((times - begin_s) / duration_s, 0.0, 1.0)
    return start + (end - start) * tau**3 * (10.0 - tau * (15.0 - 6.0 * tau))


def _fill_gaps(times: Array, yaw: Array, defined: NDArray[np.intp], rate: float) -> None:
    """Hold the heading before the first and after the last knot with a rule; turn, as early as may be, in between."""
    yaw[: defined[0]] = yaw[defined[0]]
    yaw[defined[-1] :] = yaw[defined[-1]]
    for left in np.flatnonzero(np.diff(defined) > 1):
        a, b = int(defined[left]), int(defined[left + 1])
        start, end = float(yaw[a]), float(yaw[b])
        duration = min(float(times[b] - times[a]), turn_time_s(end - start, rate))
        yaw[a : b + 1] = _quintic(times[a : b + 1], start, end, float(times[a]), duration) if duration > 0.0 else start


def _bounded(times: Array, yaw: Array, rate: float) -> Array:
    """Follow the yaw no faster than the rate, then round the corners by a moving average (which keeps the bound)."""
    step = 0.95 * rate * float(times[1] - times[0])
    followed = [float(yaw[0])]
    for asked in yaw[1:].tolist():
        followed.append(followed[-1] + min(max(asked - followed[-1], -step), step))
    half = max(1, round(0.5 * SMOOTHING_S / float(times[1] - times[0])))
    padded = np.pad(np.array(followed), half, mode="edge")
    return np.convolve(padded, np.full(2 * half + 1, 1.0 / (2 * half + 1)), mode="valid")


def _hermite(span: YawKnots) -> tuple[Array, Array]:
    """Widths (n - 1,) and coefficients (4, n - 1) of t^0..t^3 of the cubics between the knots."""
    width, rise = np.diff(span.times_s), np.diff(span.yaw_rad)
    secant, left, right = rise / width, span.rate_rad_s[:-1], span.rate_rad_s[1:]
    quadratic = (3.0 * secant - 2.0 * left - right) / width
    cubic = (left + right - 2.0 * secant) / width**2
    return width, np.stack((span.yaw_rad[:-1], left, quadratic, cubic))
