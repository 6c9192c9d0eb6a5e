"""What the three observers make of forces and torques, and of samples as flights have them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from tests.wind.bodies import BODY, moved
from uasfly.errors import UasflyError
from uasfly.messages import Array
from uasfly.wind.acceleration_estimator import AccelerationEstimator
from uasfly.wind.extended_state_observer import ExtendedStateObserver
from uasfly.wind.fuzzy_observer import FuzzyDisturbanceObserver
from uasfly.wind.pole_circle import DP1, DP2

Update = Callable[[float, Array, Array, Array], Array]
PERIOD_S = 0.02
CUTOFF = DP1.cutoff_rad_s
EPSILON_S = 0.05
DISTURBANCE = np.array((2.0, -1.6, 0.8, 0.02, -0.016, 0.008))
INPUTS = np.array((0.5, 0.3, -0.2, -0.02, 0.02, -0.01))


def _fuzzy() -> Update:
    observer = FuzzyDisturbanceObserver(BODY, DP1)
    return lambda time_s, state, inputs, _: observer.update(time_s, state, inputs)


def _extended() -> Update:
    observer = ExtendedStateObserver(BODY, EPSILON_S)
    return lambda time_s, state, inputs, _: observer.update(time_s, state, inputs)


def _acceleration() -> Update:
    return AccelerationEstimator(BODY, CUTOFF).update


ALL = pytest.mark.parametrize("make", [_fuzzy, _extended, _acceleration])


def _watched(update: Update, times: Array) -> Array:
    """Estimates (n, 6) of a constant disturbance on a tumbling body, without noise."""
    start = np.array((1.0, -2.0, 0.5, 2.0, -3.0, 4.0))
    states = moved(BODY, start, times, lambda _: INPUTS + DISTURBANCE)
    accelerations = np.diff(states[:, :3], axis=0, prepend=states[:1, :3]) / np.diff(times, prepend=-1.0)[:, None]
    samples = zip(times.tolist(), states, accelerations, strict=True)
    return np.array([update(time_s, state, INPUTS, acceleration) for time_s, state, acceleration in samples])


@pytest.mark.parametrize(
    ("make", "share"),
    [
        (_fuzzy, lambda t: 1.0 - np.exp(-CUTOFF * t)),
        (_extended, lambda t: 1.0 - (1.0 + t / EPSILON_S) * np.exp(-t / EPSILON_S)),
        (_acceleration, lambda t: 1.0 - np.exp(-CUTOFF * t)),
    ],
)
def test_every_axis_is_the_disturbance_behind_the_observers_low_pass(
    make: Callable[[], Update], share: Callable[[Array], Array]
) -> None:
    """A constant disturbance of a tumbling body shows as the low pass's step response, forces and torques alike."""
    times = np.arange(0.0, 2.0, 0.002)
    found = _watched(make(), times)
    expected = share(times)[:, None] * DISTURBANCE
    np.testing.assert_allclose(found / DISTURBANCE, expected / DISTURBANCE, rtol=0.0, atol=2e-3)
    np.testing.assert_allclose(found[-1], expected[-1], rtol=2e-3)


@ALL
def test_slow_sampling_leaves_no_offset(make: Callable[[], Update]) -> None:
    """At 50 Hz the estimate of a constant disturbance settles on it, though the body tumbles between samples."""
    found = _watched(make(), np.arange(0.0, 3.0, PERIOD_S))
    np.testing.assert_allclose(found[-1], DISTURBANCE, rtol=0.02)


@ALL
def test_samples_that_are_late_or_not_finite_change_nothing(make: Callable[[], Update]) -> None:
    """Repeated, older, without a time, with NaN: the answer is the last one, and what follows is the same."""
    times = np.arange(0.0, 1.0, PERIOD_S)
    undisturbed = _watched(make(), times)
    update = make()

    def pestered(time_s: float, state: Array, inputs: Array, acceleration: Array) -> Array:
        found = update(time_s, state, inputs, acceleration).copy()
        broken = np.full(6, np.nan)
        for other in (
            update(time_s, state + 1.0, inputs, acceleration),
            update(time_s - 0.5, state + 1.0, inputs, acceleration),
            update(np.nan, state, inputs, acceleration),
            update(np.inf, state, inputs, acceleration),
            update(time_s + 0.01, broken, inputs, acceleration),
            update(time_s + 0.01, state, broken, acceleration),
        ):
            np.testing.assert_array_equal(other, found)
        return found

    np.testing.assert_array_equal(_watched(pestered, times), undisturbed)


@ALL
def test_after_a_gap_it_goes_on_from_the_last_disturbance(make: Callable[[], Update]) -> None:
    """A second without samples, in which the vehicle has been anywhere, does not show as a disturbance."""
    update = make()
    last = _watched(update, np.arange(0.0, 2.0, PERIOD_S))[-1].copy()
    elsewhere = np.array((9.0, 9.0, -9.0, 0.0, 0.0, 0.0))
    np.testing.assert_array_equal(update(3.0, elsewhere, INPUTS, np.zeros(3)), last)
    now = elsewhere + PERIOD_S * (INPUTS + last) / BODY.inertias - PERIOD_S * BODY.damping * elsewhere / BODY.inertias
    pushed = (now - elsewhere)[:3] / PERIOD_S
    np.testing.assert_allclose(update(3.0 + PERIOD_S, now, INPUTS, pushed), last, rtol=0.02, atol=1e-3)


def test_noise_on_velocity_costs_as_much_as_the_cut_off_is_high() -> None:
    """DP2 shows white noise of the velocity several times as strong as DP1; the accelerations' estimator not at all."""
    rng = np.random.default_rng(6)
    states = np.zeros((3000, 6))
    states[:, :3] = 0.02 * rng.standard_normal((3000, 3))
    noises = {}
    acceleration = AccelerationEstimator(BODY, CUTOFF)
    updates: dict[str, Callable[[float, Array, Array], Array]] = {
        "DP1": FuzzyDisturbanceObserver(BODY, DP1).update,
        "DP2": FuzzyDisturbanceObserver(BODY, DP2).update,
        "acceleration": lambda t, x, u: acceleration.update(t, x, u, np.zeros(3)),
    }
    for name, update in updates.items():
        found = [update(number * PERIOD_S, state, np.zeros(6)) for number, state in enumerate(states)]
        noises[name] = float(np.sqrt(np.mean(np.array(found)[100:, :3] ** 2)))
    assert noises["DP1"] == pytest.approx(BODY.mass_kg * CUTOFF * 0.02, rel=0.1)
    assert noises["DP2"] > 4.0 * noises["DP1"]
    assert noises["acceleration"] < 1e-2 * noises["DP1"]


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_gains_that_are_not_positive_are_refused(value: float) -> None:
    """The message names the gain."""
    with pytest.raises(UasflyError, match="epsilon_s"):
        ExtendedStateObserver(BODY, value)
    with pytest.raises(UasflyError, match="gain_1_s"):
        AccelerationEstimator(BODY, value)
