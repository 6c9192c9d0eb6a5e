"""One flight recorded once, for tests that spoil it in many ways."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from tests.observer.airframes import f550
from tests.observer.truth import flights, fly_commands, turn_between
from uasfly.messages import Array, MarkerSample, OdometrySample, StateEstimate
from uasfly.observer import Observer

DT_S = 0.01
MARKER = np.array((2.0, 0.5, 1.5, 0.8, 0.0, 0.6, 0.0))
SIGHTING_COVARIANCE = np.diag((0.005**2,) * 3 + (0.01**2,) * 3)


@dataclass
class Recording:
    """Samples at 100 Hz, sightings at 10 Hz and the truth at the samples' times, GNSS bias included."""

    odometry: list[OdometrySample]
    sightings: list[MarkerSample]
    position: Array
    velocity: Array
    quaternion: Array
    force: Array
    bias: Array

    @property
    def duration_s(self) -> float:
        """Time of the last sample."""
        return self.odometry[-1].time_s

    def in_order(self) -> list[OdometrySample | MarkerSample]:
        """Samples and sightings by their time."""
        samples: list[OdometrySample | MarkerSample] = [*self.odometry, *self.sightings]
        return sorted(samples, key=lambda sample: sample.time_s)


@lru_cache
def recording(duration_s: float = 8.0, gnss_bias_density: float = 1e-3, seed: int = 3) -> Recording:
    """A flight of the f550 in a wandering wind force."""
    airframe, rng = f550(gnss_bias_density=gnss_bias_density), np.random.default_rng(seed)
    truth = flights(airframe, 1, rng)
    result = Recording([], [], *(np.empty((0, n)) for n in (3, 3, 4, 3, 3)))
    rows: list[list[Array]] = [[], [], [], [], []]
    for k in range(round(duration_s / DT_S) + 1):
        truth.advance(airframe, k * DT_S, rng)
        result.odometry.append(truth.odometry(airframe, rng)[0])
        if k % 10 == 5:
            result.sightings.append(truth.sightings(MARKER, SIGHTING_COVARIANCE, rng)[0])
        for row, value in zip(
            rows, (truth.position, truth.velocity, truth.quaternion, truth.force, truth.bias), strict=True
        ):
            row.append(value[0].copy())
    result.position, result.velocity, result.quaternion, result.force, result.bias = map(np.array, rows)
    return result


def flying_observer(duration_s: float = 8.0, **noise: float) -> Observer:
    """An observer of the f550 that knows all commands of the recorded flight."""
    observer = Observer(f550(**noise))
    fly_commands(observer, duration_s)
    return observer


@dataclass
class Errors:
    """Estimate minus truth, one row a sample: position (without the bias), velocity, attitude, force."""

    position: Array
    velocity: Array
    attitude: Array
    force: Array
    estimates: list[StateEstimate]


def replay(
    observer: Observer, flight: Recording, spoil: Callable[[OdometrySample], Iterable[OdometrySample]] = lambda x: (x,)
) -> Errors:
    """Feed a recording through `spoil`; compare the estimate with the truth (position + bias) after each sample."""
    rows: list[list[Array]] = [[], [], [], []]
    estimates = []
    for k, sample in enumerate(flight.odometry):
        for spoilt in spoil(sample):
            observer.add(spoilt)
        estimate = observer.estimate(sample.time_s)
        assert estimate is not None
        estimates.append(estimate)
        rows[0].append(estimate.position_in_world + estimate.gnss_bias_in_world - flight.position[k] - flight.bias[k])
        rows[1].append(estimate.velocity_in_world - flight.velocity[k])
        rows[2].append(turn_between(flight.quaternion[k], estimate.quaternion_body_to_world))
        rows[3].append(estimate.force_in_world - flight.force[k])
    position, velocity, attitude, force = map(np.array, rows)
    return Errors(position, velocity, attitude, force, estimates)
