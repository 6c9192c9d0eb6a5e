"""Monte Carlo: does the filter know how wrong it is?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.stats import chi2

from tests.observer.airframes import f550
from tests.observer.truth import Flights, flights, fly_commands, nees
from uasfly.airframe import Airframe
from uasfly.messages import Array
from uasfly.observer import Observer
from uasfly.observer import states as s

RUNS = 30
DT_S = 0.01
MARKER = np.array((2.0, 0.5, 1.5, *(np.array((0.9, 0.1, -0.3, 0.2)) / np.linalg.norm((0.9, 0.1, -0.3, 0.2)))))
WANDERS = {"velocity_wander_m_s": 0.02, "attitude_wander_rad": 0.003}
SIGHTING_COVARIANCE = np.diag((0.01**2,) * 3 + (0.02**2,) * 3)


@dataclass
class Campaign:
    """Averages over the flights, one row a sample time: whole state, each block of three, each sensor's NIS."""

    whole: Array
    blocks: Array
    innovations: Array
    dof: int


def campaign(
    airframe: Airframe, duration_s: float, seed: int, sighted_s: tuple[float, float] | None = None
) -> Campaign:
    """Fly RUNS flights; the marker is seen at 10 Hz within `sighted_s`; statistics from its second sighting on."""
    rng = np.random.default_rng(seed)
    truth: Flights = flights(airframe, RUNS, rng)
    observers = [Observer(airframe) for _ in range(RUNS)]
    for observer in observers:
        fly_commands(observer, duration_s)
    whole, blocks, innovations = [], [], []
    for k in range(round(duration_s / DT_S) + 1):
        time_s = k * DT_S
        truth.advance(airframe, time_s, rng)
        for observer, sample in zip(observers, truth.odometry(airframe, rng), strict=True):
            observer.add(sample)
        if sighted_s and sighted_s[0] <= time_s < sighted_s[1] and k % 10 == 0:
            for observer, seen in zip(observers, truth.sightings(MARKER, SIGHTING_COVARIANCE, rng), strict=True):
                observer.add(seen)
        if k % 2 or time_s < (sighted_s[0] + 0.1 if sighted_s else 0.05):
            continue
        rows = []
        for run, observer in enumerate(observers):
            error, P = truth.error(observer, run, MARKER), observer.covariance
            parts = [slice(j, j + 3) for j in range(0, len(error), 3)]
            rows.append([nees(error, P), *(nees(error[part], P[part, part]) for part in parts)])
        mean = np.mean(rows, axis=0)
        whole.append(mean[0])
        blocks.append(mean[1:])
        innovations.append([np.mean([o.statistics[sensor][0] for o in observers]) for sensor in s.SENSORS])
    return Campaign(np.array(whole), np.array(blocks), np.array(innovations), len(error))


def share_inside(averages: Array, dof: int) -> float:
    """Share of the sample times at which the average over the flights lies inside its 95 % interval."""
    low, high = chi2.ppf((0.025, 0.975), RUNS * dof) / RUNS
    return float(np.mean((averages > low) & (averages < high)))


@pytest.mark.parametrize("window_s", [1e9, 2.0])
def test_without_a_marker_the_error_is_as_large_as_the_filter_says(window_s: float) -> None:
    """NEES and NIS inside their 95 % bounds with GNSS bias drifting by 0.1 m/sqrt(s) and held; matching off and on."""
    result = campaign(f550(matching_window_s=window_s, gnss_bias_density=0.1, **WANDERS), 3.0, seed=2)
    assert result.dof == 21
    assert share_inside(result.whole, 21) > 0.9
    for block in range(7):
        assert share_inside(result.blocks[:, block], 3) > 0.85
    for sensor in range(3):
        assert share_inside(result.innovations[:, sensor], 3) > 0.9
        assert np.mean(result.innovations[:, sensor]) == pytest.approx(3.0, abs=0.15)


def test_with_a_marker_the_error_is_as_large_as_the_filter_says() -> None:
    """NEES of all 27 numbers inside its 95 % bounds while the bias is free, and held after the marker is lost."""
    airframe = f550(matching_window_s=1e9, gnss_bias_density=0.3, **WANDERS)
    result = campaign(airframe, 4.0, seed=1, sighted_s=(0.5, 2.0))
    assert result.dof == 27
    assert share_inside(result.whole, 27) > 0.9
    for block in range(9):
        assert share_inside(result.blocks[:, block], 3) > 0.75  # slow states: few independent samples in a flight
    for sensor in range(3):
        assert np.mean(result.innovations[:, sensor]) == pytest.approx(3.0, abs=0.15)


def test_an_overconfident_filter_is_caught() -> None:
    """The statistics above mean something: with half the true noise configured they leave their bounds."""
    truth, believed = f550(matching_window_s=1e9), f550(matching_window_s=1e9, velocity_sigma_m_s=0.025)
    rng = np.random.default_rng(3)
    fleet = flights(truth, RUNS, rng)
    observers = [Observer(believed) for _ in range(RUNS)]
    averages = []
    for observer in observers:
        fly_commands(observer, 1.0)
    for k in range(100):
        fleet.advance(truth, k * DT_S, rng)
        for observer, sample in zip(observers, fleet.odometry(truth, rng), strict=True):
            observer.add(sample)
        if k > 50:
            averages.append(np.mean([nees(fleet.error(o, r), o.covariance) for r, o in enumerate(observers)]))
    assert share_inside(np.array(averages), 21) < 0.1
