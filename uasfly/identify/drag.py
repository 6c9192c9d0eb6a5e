"""Drag against airspeed from flights in calm air: to and fro at several speeds, `missions/drag.yaml`.

The drag is right when the wind that it tells is the same wherever and however fast the vehicle flies. So linear and
quadratic part and one steady wind a flight are fitted such that what `uasfly.wind` makes of each moment differs least
from that wind: in metres per second, because that is what the drag is for. Each track flown in both directions keeps
the wind, and a tilt that PX4 has wrong, apart from the drag.

The sigmas are those of clusters of ten seconds (Liang & Zeger 1986), within which errors (gusts, PX4's attitude) hang
together.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from uasfly.errors import UasflyError
from uasfly.messages import Array, StateEstimate
from uasfly.wind.drag_curve import DragCurve
from uasfly.wind.force_kernel import LAG, SAMPLES, STEP_S, WINDOW_S, force_kernel
from uasfly.wind.from_force import air_relative
from uasfly.wind.thrust_free import impulses, slopes, thrust

DENSITY = 0.3  # m/s^2/sqrt(s): how fast the drag of a flight to and fro changes
EVERY = 20  # steps of the kernel's grid between two moments: 0.2 s
CLUSTER_S = 10.0
LONGEST_PAUSE_S = 0.3  # between estimates; a longer one parts two stretches
LEAST_SPEED_M_S, LEAST_MOMENTS = 4.0, 100
FAST_M_S = 2.0  # below, errors of the attitude hide how well the drag fits
STEADIEST_SHARE = 0.01  # no drag is claimed to be known better


@dataclass(frozen=True, slots=True)
class Moments:
    """What a flight tells of the drag, n moments.

    Attributes:
        time_s: (n,). velocities: (n, 3) m/s, world. forces: (n, 2) m/s^2, thrust-free (see `uasfly.wind.thrust_free`).
        slopes: (n, 2) of the body's z axis. thrusts: (n,) m/s^2.
    """

    time_s: Array
    velocities: Array
    forces: Array
    slopes: Array
    thrusts: Array


@dataclass(frozen=True, slots=True)
class IdentifiedDrag:
    """A drag curve with what is known of its errors.

    Attributes:
        drag_1_s, drag_1_m: linear and quadratic part. covariance: (2, 2) of both.
        share: standard deviation of the drag at a given airspeed, relative, from clusters of ten seconds.
        winds: (flights, 2) m/s, steady wind of each flight. residual_m_s: RMS of the told wind around it, one axis.
        fastest_m_s: airspeed up to which the curve was seen. moments: how many were used.
    """

    drag_1_s: float
    drag_1_m: float
    covariance: Array
    share: float
    winds: Array
    residual_m_s: float
    fastest_m_s: float
    moments: int


def moments(estimates: Iterable[StateEstimate]) -> Moments:
    """Moments of one flight, from estimates while it was in the air, in the order of their times."""
    kernel = force_kernel(DENSITY)
    parts = [_of_stretch(stretch, kernel.weights) for stretch in _stretches(list(estimates))]
    if not parts:
        parts = [Moments(np.empty(0), np.empty((0, 3)), np.empty((0, 2)), np.empty((0, 2)), np.empty(0))]
    return Moments(
        np.concatenate([part.time_s for part in parts]),
        np.concatenate([part.velocities for part in parts]),
        np.concatenate([part.forces for part in parts]),
        np.concatenate([part.slopes for part in parts]),
        np.concatenate([part.thrusts for part in parts]),
    )


def identify_drag(flights: list[Moments]) -> IdentifiedDrag:
    """Fit the drag curve to one or more flights.

    Raises:
        UasflyError: where the flights are too short or too slow to tell a linear from a quadratic drag.
    """
    count = sum(len(flight.time_s) for flight in flights)
    fastest = max((float(np.hypot(*flight.velocities[:, :2].T).max(initial=0.0)) for flight in flights), default=0.0)
    if count < LEAST_MOMENTS or fastest < LEAST_SPEED_M_S:
        raise UasflyError(
            f"drag: expected at least {LEAST_MOMENTS * EVERY * STEP_S:.0f} s in the air and {LEAST_SPEED_M_S:g} m/s, "
            f"found {count * EVERY * STEP_S:.0f} s and {fastest:.1f} m/s; fly the mission drag in calm air, with "
            "limits.speed_m_s of the airframe at 10"
        )

    def residuals(unknown: Array) -> Array:
        return np.concatenate(
            [_told_winds(flight, unknown) - unknown[2 + 2 * k : 4 + 2 * k] for k, flight in enumerate(flights)]
        ).ravel()

    start = np.array((0.2, 0.01, *(0.0,) * (2 * len(flights))))
    lower = np.array((1e-3, 0.0, *(-np.inf,) * (2 * len(flights))))
    fit = least_squares(residuals, start, bounds=(lower, np.inf), x_scale=np.maximum(np.abs(start), 0.1))
    covariance = _clustered(fit.jac, fit.fun, flights)[:2, :2]
    drag_1_s, drag_1_m = fit.x[:2].tolist()
    return IdentifiedDrag(
        drag_1_s=drag_1_s,
        drag_1_m=drag_1_m,
        covariance=covariance,
        share=max(_share(flights, fit.x), STEADIEST_SHARE),
        winds=fit.x[2:].reshape(-1, 2),
        residual_m_s=math.sqrt(float(np.mean(fit.fun**2))),
        fastest_m_s=fastest,
        moments=count,
    )


def _stretches(estimates: list[StateEstimate]) -> Iterable[list[StateEstimate]]:
    """Parts without a pause."""
    begin = 0
    for k in range(1, len(estimates) + 1):
        if k == len(estimates) or not 0.0 < estimates[k].time_s - estimates[k - 1].time_s < LONGEST_PAUSE_S:
            if estimates[k - 1].time_s - estimates[begin].time_s > WINDOW_S:
                yield estimates[begin:k]
            begin = k


def _of_stretch(estimates: list[StateEstimate], weights: Array) -> Moments:
    times = np.array([estimate.time_s for estimate in estimates])
    velocities = np.array([estimate.velocity_in_world for estimate in estimates])
    slopes_of = slopes(np.array([estimate.quaternion_body_to_world for estimate in estimates]))
    integral = np.vstack((np.zeros((1, 2)), np.cumsum(impulses(times, velocities, slopes_of), axis=0)))
    grid = np.arange(times[0], times[-1], STEP_S)
    seen = np.column_stack([np.interp(grid, times, axis) for axis in (*integral.T, *velocities.T, *slopes_of.T)])
    smoothed = np.column_stack([np.convolve(axis, weights[::-1], "valid") for axis in (*seen[:, :2].T, seen[:, 4])])
    then = np.arange(SAMPLES - 1, len(grid), EVERY)
    smoothed, then = smoothed[then - (SAMPLES - 1)], then - LAG
    slopes_then = seen[then, 5:7]
    thrusts = np.array([thrust(up, (e, n)) for up, (e, n) in zip(smoothed[:, 2], slopes_then.tolist(), strict=True)])
    return Moments(grid[then], seen[then, 2:5], smoothed[:, :2], slopes_then, thrusts)


def _told_winds(flight: Moments, unknown: Array) -> Array:
    """Wind (n, 2) that each moment tells by a curve."""
    curve = DragCurve(float(unknown[0]), float(unknown[1]))
    winds = np.empty((len(flight.time_s), 2))
    rows = zip(
        flight.forces.tolist(), flight.slopes.tolist(), flight.velocities.tolist(), flight.thrusts.tolist(), strict=True
    )
    for k, ((east_h, north_h), (east_s, north_s), (east_v, north_v, up_v), lift) in enumerate(rows):
        (east, north), _ = air_relative((east_h, north_h), (east_s, north_s), up_v, curve.under_thrust(lift))
        winds[k] = east + east_v, north + north_v
    return winds


def _clusters(flights: list[Moments]) -> NDArray[np.intp]:
    """Number of the cluster (n,) that each moment of all flights belongs to."""
    numbers, first = [], 0
    for flight in flights:
        own = np.floor(flight.time_s / CLUSTER_S).astype(int)
        _, own = np.unique(own, return_inverse=True)
        numbers.append(first + own)
        first += int(own.max(initial=-1)) + 1
    return np.concatenate(numbers)


def _clustered(jacobian: Array, residuals: Array, flights: list[Moments]) -> Array:
    """Covariance of the unknowns with errors that hang together within a cluster."""
    bread = np.linalg.inv(jacobian.T @ jacobian)
    scores = (jacobian * residuals[:, None]).reshape(len(residuals) // 2, 2, -1).sum(axis=1)
    numbers = _clusters(flights)
    sums = np.zeros((int(numbers.max()) + 1, scores.shape[1]))
    np.add.at(sums, numbers, scores)
    result: Array = bread @ (sums.T @ sums) @ bread
    return result


def _share(flights: list[Moments], unknown: Array) -> float:
    """RMS of the drag's error in clusters, relative to the drag's RMS, over fast moments."""
    errors, sizes, numbers = [], [], _clusters(flights)
    for k, flight in enumerate(flights):
        wind = unknown[2 + 2 * k : 4 + 2 * k]
        air = wind - flight.velocities[:, :2]
        told = _told_winds(flight, unknown) - flight.velocities[:, :2]
        speed = np.hypot(*air.T)
        along = np.einsum("ni,ni->n", told, air) / np.maximum(speed, 1e-9)
        slope = unknown[0] + 2.0 * unknown[1] * speed
        errors.append(slope * (along - speed))
        sizes.append(np.where(speed > FAST_M_S, (unknown[0] + unknown[1] * speed) * speed, 0.0))
    error, size = np.concatenate(errors), np.concatenate(sizes)
    fast = size > 0.0
    if not fast.any():
        return 1.0
    counts = np.bincount(numbers[fast])
    used = counts > 0
    mean_error = np.bincount(numbers[fast], error[fast])[used] / counts[used]
    mean_size = np.bincount(numbers[fast], size[fast])[used] / counts[used]
    return math.sqrt(float((mean_error**2).sum() / (mean_size**2).sum()))
