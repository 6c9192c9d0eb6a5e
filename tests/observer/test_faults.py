"""What goes wrong with telemetry, one row a fault, each with what is expected of the filter."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable
from functools import lru_cache

import numpy as np
import pytest

from tests.observer.recorded import Errors, flying_observer, recording, replay
from uasfly.frames import quaternion_from_rotation_vector, quaternion_product
from uasfly.messages import Array, OdometrySample
from uasfly.observer import Observer

Spoil = Callable[[OdometrySample], Iterable[OdometrySample]]
START_S = 4.2
EAST = np.array((1.0, 0.0, 0.0))


def during(start_s: float, end_s: float, change: Callable[[OdometrySample], Iterable[OdometrySample]]) -> Spoil:
    """Spoil the samples of a time span only."""
    return lambda sample: change(sample) if start_s - 1e-9 <= sample.time_s < end_s - 1e-9 else (sample,)


def moved(metres: float) -> Spoil:
    """Position off to the east."""
    return lambda x: (dataclasses.replace(x, position_in_world=x.position_in_world + metres * EAST),)


def sped(metres_per_second: float) -> Spoil:
    """Velocity off to the east."""
    return lambda x: (dataclasses.replace(x, velocity_in_world=x.velocity_in_world + metres_per_second * EAST),)


def turned(radians: float) -> Spoil:
    """Heading off to the left."""
    turn = quaternion_from_rotation_vector(np.array((0.0, 0.0, radians)))
    return lambda x: (
        dataclasses.replace(x, quaternion_body_to_world=quaternion_product(turn, x.quaternion_body_to_world)),
    )


def without(*fields: str) -> Spoil:
    """NaN in some fields."""
    return lambda x: (dataclasses.replace(x, **{name: np.full_like(getattr(x, name), np.nan) for name in fields}),)


def nothing(_: OdometrySample) -> Iterable[OdometrySample]:
    """The sample is lost."""
    return ()


def twice(sample: OdometrySample) -> Iterable[OdometrySample]:
    """The sample comes twice."""
    return (sample, sample)


@dataclasses.dataclass
class Expected:
    """How far the fault may take the estimate from the one without it, in multiples of the filter's steady sigmas.

    Attributes:
        harm: at any time. counters: which must count more than without the fault.
    """

    harm: float
    counters: tuple[str, ...] = ()


EVERYTHING = ("position_in_world", "velocity_in_world", "quaternion_body_to_world", "angular_rate_in_body")
SIGMAS = {"position": 0.005, "velocity": 0.022, "attitude": 0.0017, "force": 0.33}  # m, m/s, rad, m/s^2
LASTING = 3.0  # two seconds after the fault
FAULTS: dict[str, tuple[Spoil, Expected]] = {
    "velocity spike": (during(4.2, 4.21, sped(50.0)), Expected(3.0, ("velocity",))),
    "position spike": (during(4.2, 4.21, moved(-1000.0)), Expected(3.0, ("position",))),
    "attitude spike": (during(4.27, 4.28, turned(3.0)), Expected(3.0, ("attitude",))),
    "a sample of NaN": (during(4.2, 4.21, without(*EVERYTHING)), Expected(3.0, ("non_finite",))),
    "duplicates": (during(3.2, 6.2, twice), Expected(0.0, ("duplicates",))),
    "ten velocity spikes in a row": (during(4.2, 4.3, sped(5.0)), Expected(10.0, ("velocity",))),
    "position jumps by 3 m and returns": (during(4.2, 4.7, moved(3.0)), Expected(10.0, ("position",))),
    "velocity jumps by 1 m/s and returns": (during(4.2, 4.4, sped(1.0)), Expected(12.0, ("velocity",))),
    "0.1 s lost": (during(4.2, 4.3, nothing), Expected(10.0)),
    "every second sample lost": (during(3.2, 6.2, lambda x: (x,) if round(x.time_s * 100) % 2 else ()), Expected(6.0)),
    "velocity off for 1 s": (during(4.2, 5.2, without("velocity_in_world")), Expected(12.0, ("non_finite",))),
    "position off for 1 s": (during(4.2, 5.2, without("position_in_world")), Expected(5.0, ("non_finite",))),
    "attitude off for 1 s": (during(4.2, 5.2, without("quaternion_body_to_world")), Expected(20.0, ("non_finite",))),
    "gyro off for 1 s": (during(4.2, 5.2, without("angular_rate_in_body")), Expected(15.0, ("non_finite",))),
}


@lru_cache
def without_fault() -> tuple[Errors, Observer]:
    """The same flight as it was."""
    observer = flying_observer()
    return replay(observer, recording()), observer


def counted(observer: Observer, name: str) -> int:
    """A counter of the observer, by the name of the sensor or of the field."""
    return observer.counters.rejected[name] if name in observer.counters.rejected else getattr(observer.counters, name)


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_does_no_more_harm_than_it_must(name: str) -> None:
    """The estimate stays within the row's bound of the one without the fault, and comes back to it."""
    spoil, expected = FAULTS[name]
    observer, (clean, baseline) = flying_observer(), without_fault()
    errors = replay(observer, recording(), spoil)
    for part, sigma in SIGMAS.items():
        if part == "position":  # its own; the GNSS bias is there to take what GNSS does
            pairs = zip(errors.estimates, clean.estimates, strict=True)
            harm = np.array([np.linalg.norm(e.position_in_world - c.position_in_world) for e, c in pairs]) / sigma
        else:
            harm = np.linalg.norm(getattr(errors, part) - getattr(clean, part), axis=1) / sigma
        assert harm[: round(100 * START_S) - 101].max() == 0.0
        assert harm.max() <= expected.harm
        assert harm[-100:].max() <= LASTING
    for counter in expected.counters:
        assert counted(observer, counter) > counted(baseline, counter)


@pytest.mark.parametrize("jump_m", [1.0, 3.0, 8.0, -8.0])
def test_a_jump_of_gnss_that_stays_is_an_error_of_gnss(jump_m: float) -> None:
    """Refused for a second at most, then in the bias; the position goes on as if nothing had happened."""
    flight, observer = recording(18.0), flying_observer(18.0)
    errors = replay(observer, flight, during(START_S, 99.0, moved(jump_m)))
    positions = np.array([e.position_in_world - p for e, p in zip(errors.estimates, flight.position, strict=True)])
    biases = np.array([e.gnss_bias_in_world for e in errors.estimates])
    clean = np.array(
        [e.position_in_world - p for e, p in zip(without_fault_18().estimates, flight.position, strict=True)]
    )
    assert 10 < observer.counters.rejected["position"] < 150
    assert np.linalg.norm(positions - clean, axis=1).max() < 0.1
    assert np.abs(np.diff(positions[:, 0])).max() < 0.02
    assert np.abs(biases[-100:, 0] - jump_m).max() < 0.1
    diagnosis = observer.diagnose(flight.duration_s)
    assert diagnosis.jump_m == pytest.approx(abs(jump_m), abs=0.15)
    assert 0.0 < diagnosis.jump_s - START_S < 1.5


@pytest.mark.parametrize("speed_m_s", [0.5, 1.0, 3.0])
def test_gnss_that_drifts_away_takes_the_bias_with_it(speed_m_s: float) -> None:
    """Against a velocity that says otherwise: the position strays no more than 0.6 m, and the diagnosis tells."""
    flight, observer = recording(14.0), flying_observer(14.0)

    def drifting(sample: OdometrySample) -> Iterable[OdometrySample]:
        gone = speed_m_s * max(0.0, sample.time_s - START_S)
        return (dataclasses.replace(sample, position_in_world=sample.position_in_world + np.array((gone, 0.0, 0.0))),)

    errors = replay(observer, flight, drifting)
    positions = np.array([e.position_in_world - p for e, p in zip(errors.estimates, flight.position, strict=True)])
    assert np.linalg.norm(positions, axis=1).max() < 0.6
    assert observer.diagnose(flight.duration_s).drift_m_s == pytest.approx(speed_m_s, rel=0.3)


@lru_cache
def without_fault_18() -> Errors:
    """A longer flight as it was."""
    return replay(flying_observer(18.0), recording(18.0))


def test_a_jump_of_the_heading_that_stays_is_followed_within_two_seconds() -> None:
    """PX4 flies by its own heading: ours has to be the same."""
    flight, observer = recording(), flying_observer()
    errors = replay(observer, flight, during(START_S, 99.0, turned(0.3)))
    heading = np.array(
        [turned_by(flight.quaternion[k], e.quaternion_body_to_world) for k, e in enumerate(errors.estimates)]
    )
    assert np.abs(heading[600:] - 0.3).max() < 0.02


def turned_by(true: Array, estimated: Array) -> float:
    """Turn about the world's z axis from the true to the estimated attitude."""
    inverse = true * (1.0, -1.0, -1.0, -1.0)
    turn = quaternion_product(estimated, inverse)
    return float(2.0 * np.arctan2(turn[3], turn[0]))


def test_without_any_telemetry_the_uncertainty_grows_with_the_error() -> None:
    """Two seconds of silence: the error stays within three of the sigmas, and the filter recovers."""
    flight, observer = recording(), flying_observer()
    errors = replay(observer, flight, during(START_S, START_S + 2.0, nothing))
    for k in range(420, 600, 20):
        estimate = errors.estimates[k]
        assert np.all(np.abs(errors.velocity[k]) < 3.0 * estimate.velocity_sigma_m_s)
        assert np.all(np.abs(errors.position[k]) < 3.0 * estimate.position_sigma_m)
    assert errors.estimates[599].position_sigma_m[0] > 0.5
    assert np.linalg.norm(errors.position[-50:], axis=1).max() < 0.02


@pytest.mark.parametrize("moved_m", [-6.0, 1.0, 4.0])
def test_after_a_silence_the_vehicle_is_where_the_position_says(moved_m: float) -> None:
    """Somebody else has flown it meanwhile, farther than the model can think: found again, and no error of GNSS."""
    flight, observer = recording(), flying_observer()
    end_s = START_S + 1.5

    def silent_then_moved(sample: OdometrySample) -> Iterable[OdometrySample]:
        if sample.time_s < START_S:
            return (sample,)
        return moved(moved_m)(sample) if sample.time_s > end_s else ()

    errors = replay(observer, flight, silent_then_moved)
    left = errors.position[-20:] - moved_m * EAST
    assert np.linalg.norm(left, axis=1).max() < 0.1
    assert np.linalg.norm(errors.estimates[-1].gnss_bias_in_world - flight.bias[-1]) < 0.1
    assert observer.diagnose(flight.duration_s).jump_m == 0.0


def test_a_sensor_that_is_noisier_than_configured_is_found_out() -> None:
    """Velocity noise three times the configured one: the matched sigma follows, and rejections become rare."""
    rng = np.random.default_rng(0)
    flight, observer = recording(), flying_observer()

    def noisier(sample: OdometrySample) -> Iterable[OdometrySample]:
        noise = 0.05 * np.sqrt(8.0) * rng.standard_normal(3)
        return (dataclasses.replace(sample, velocity_in_world=sample.velocity_in_world + noise),)

    replay(observer, flight, noisier)
    moment = observer.moment
    assert moment is not None
    matched = moment.packed[moment.layout.matched][18:27].reshape(3, 3)
    assert np.sqrt(np.trace(matched) / 3.0) == pytest.approx(0.15, rel=0.2)
    assert observer.counters.rejected["velocity"] < 100
