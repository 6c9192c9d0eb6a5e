"""The observer's times: odometry as it comes in flight, without and with a marker in the state."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from uasfly.airframe import Airframe
from uasfly.bench.timing import Figures, as_in_flight
from uasfly.frames import quaternion_from_euler
from uasfly.messages import FlightMode, MarkerSample, OdometrySample, Setpoint, VehicleSample
from uasfly.observer.observer import Observer

INTERVAL_S = 0.01  # PX4's odometry comes at 100 Hz
SWING_M, SWING_S = 0.2, 8.0
WARM_UP = 200
MARKER_COVARIANCE = np.diag((0.005**2,) * 3 + (0.01**2,) * 3)


@dataclass(frozen=True, slots=True)
class ObserverFigures:
    """Times of the observer [ms].

    Attributes:
        odometry: one call of `add` with an odometry sample: a prediction over 10 ms, an update by a pose (position and
            attitude) and one by a velocity, gates and covariance matching included.
        with_marker: a marker's pose and an odometry sample, two predictions and three updates, the marker in the state.
    """

    odometry: Figures
    with_marker: Figures


def measure_observer(airframe: Airframe, samples: int) -> ObserverFigures:
    """Feed so many odometry samples of a vehicle that swings around a point, first without, then with a marker."""
    plain, marked = (_times(airframe, samples, with_marker=with_marker) for with_marker in (False, True))
    return ObserverFigures(plain, marked)


def _times(airframe: Airframe, samples: int, *, with_marker: bool) -> Figures:
    rng, clock = np.random.default_rng(1), time.perf_counter
    observer = Observer(airframe, prepared_markers=1 if with_marker else 0)
    observer.add(VehicleSample(0.0, FlightMode.OFFBOARD, True, True))
    times = []
    with as_in_flight():
        for count, (odometry, marker) in enumerate(_flight(WARM_UP + samples, rng)):
            observer.sent(_hover(airframe, odometry.time_s), in_offboard=True)
            started = clock()
            if with_marker:
                observer.add(marker)
            observer.add(odometry)
            elapsed = clock() - started
            observer.estimate(odometry.time_s)
            if count >= WARM_UP:
                times.append(1e3 * elapsed)
    figures = Figures.of(times)
    assert figures is not None
    return figures


def _hover(airframe: Airframe, time_s: float) -> Setpoint:
    return Setpoint(time_s, 0.0, 0.0, 0.0, 0.0, airframe.model.hover_thrust)


def _flight(count: int, rng: np.random.Generator) -> Iterator[tuple[OdometrySample, MarkerSample]]:
    """Odometry, and the sighting of a marker half an interval before it, 2 m in front of the point."""
    rate = 2.0 * math.pi / SWING_S
    for step in range(1, count + 1):
        now = step * INTERVAL_S
        position = SWING_M * np.array((math.cos(rate * now), math.sin(rate * now), 0.0))
        velocity = SWING_M * rate * np.array((-math.sin(rate * now), math.cos(rate * now), 0.0))
        roll, pitch = rng.normal(0.0, 0.003, 2).tolist()
        yield (
            OdometrySample(
                now,
                position + rng.normal(0.0, 0.01, 3),
                velocity + rng.normal(0.0, 0.03, 3),
                quaternion_from_euler(roll, pitch, 0.0),
                np.zeros(3),
            ),
            MarkerSample(
                now - 0.5 * INTERVAL_S,
                1,
                np.array((2.0, 0.0, 0.0)) - position + rng.normal(0.0, 0.005, 3),
                quaternion_from_euler(0.0, 0.0, float(rng.normal(0.0, 0.01))),
                MARKER_COVARIANCE,
            ),
        )
