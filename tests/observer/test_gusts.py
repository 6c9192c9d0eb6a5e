"""The force's process noise follows the gusts."""

from __future__ import annotations

import numpy as np
import pytest

from tests.observer.airframes import f550
from tests.observer.truth import flights, fly_commands, nees
from uasfly.messages import Array
from uasfly.observer import Observer
from uasfly.observer import states as s
from uasfly.observer.gusts import AS_CONFIGURED, LAG_S, MOST, Gusts

DT_S = 0.02
DENSITY = 0.5


def watched(forces: Array, gusts: Gusts = AS_CONFIGURED, start_s: float = 0.0) -> Gusts:
    """The gusts after forces (n, 3), one every DT_S."""
    for k, (x, y, z) in enumerate(forces.tolist()):
        gusts = gusts.after(start_s + k * DT_S, (x, y, z), DENSITY)
    return gusts


def walks(densities: tuple[float, float, float], duration_s: float, seed: int) -> Array:
    """Random walks (n, 3) of three densities."""
    steps = np.random.default_rng(seed).standard_normal((round(duration_s / DT_S), 3))
    return np.asarray(np.cumsum(steps * densities * DT_S**0.5, axis=0))


def test_each_axis_finds_the_density_of_its_walk() -> None:
    """Walks of 2, 1.5 and 0.5 times the configured density: the mean of ten flights is right within an eighth."""
    found = np.mean([np.sqrt(watched(walks((1.0, 0.75, 0.25), 20.0, seed)).shares) for seed in range(10)], axis=0)
    np.testing.assert_allclose(found[:2], (2.0, 1.5), rtol=0.125)
    assert found[2] == pytest.approx(1.0, abs=0.02)


def test_a_sudden_wind_is_noticed_at_once_and_forgotten_when_it_is_over() -> None:
    """A step of 2 m/s^2 between two samples takes the density to 1.9 times; half a minute later it is as before."""
    before, after = np.zeros((30, 3)), np.tile((2.0, 0.0, 0.0), (1, 1))
    struck = watched(np.concatenate((before, after)))
    highest = 2.0 / (3.0 * DENSITY * LAG_S**0.5)  # less where the lag is a sample longer
    assert highest * 0.975 < np.sqrt(struck.shares[0]) <= highest
    assert struck.shares[1:] == (1.0, 1.0)
    assert watched(np.tile(after, (1500, 1)), struck, 31 * DT_S).shares == pytest.approx((1.0, 1.0, 1.0), abs=0.01)


def test_no_event_takes_the_density_beyond_its_bound() -> None:
    """A force of 1 km/s^2 counts as the most that is believed."""
    assert watched(np.concatenate((np.zeros((30, 3)), np.full((1, 3), 1e3)))).shares == (MOST**2,) * 3


def test_forces_on_both_sides_of_a_gap_are_not_compared() -> None:
    """After 0.3 s without an estimate the lag begins again."""
    calm = watched(np.zeros((30, 3)))
    assert watched(np.full((20, 3), 5.0), calm, 29 * DT_S + 0.3).shares == (1.0, 1.0, 1.0)


def test_the_vertical_acceleration_takes_its_part_of_strong_gusts() -> None:
    """Variances: the force's by the share, the acceleration's vertically by its power 1.5; unchanged as configured."""
    assert AS_CONFIGURED.motion_noise(0.5, 0.1) == pytest.approx((0.25,) * 3 + (0.01,) * 3)
    expected = (0.25, 0.5, 1.0, 0.01, 0.01, 0.08)
    assert Gusts((1.0, 2.0, 4.0)).motion_noise(0.5, 0.1) == pytest.approx(expected)


def horizontal_force_nees(believed_density: float, true_density: float) -> float:
    """Mean NEES (two degrees of freedom) of ten flights, from the fifth to the tenth second."""
    rng = np.random.default_rng(5)
    truth, believed = f550(force_density=true_density), f550(force_density=believed_density)
    fleet, observers, found = flights(truth, 10, rng), [Observer(believed) for _ in range(10)], []
    for observer in observers:
        fly_commands(observer, 10.0)
    block = slice(s.D_FORCE.start, s.D_FORCE.start + 2)
    for k in range(500):
        fleet.advance(truth, k * DT_S, rng)
        for run, (observer, sample) in enumerate(zip(observers, fleet.odometry(truth, rng), strict=True)):
            observer.add(sample)
            if k >= 250 and k % 10 == 0:
                found.append(nees(fleet.error(observer, run)[block], observer.covariance[block, block]))
    return float(np.mean(found))


def test_in_gusts_stronger_than_configured_the_filter_knows_how_wrong_its_force_is() -> None:
    """Monte Carlo, 2.5 times the configured density: NEES within 0.7 of its two degrees of freedom (9 if fixed)."""
    assert horizontal_force_nees(0.4, 1.0) == pytest.approx(2.0, abs=0.7)


def test_in_gusts_as_configured_the_filter_stays_as_it_is() -> None:
    """Monte Carlo: NEES within 0.4 of its two degrees of freedom."""
    assert horizontal_force_nees(1.0, 1.0) == pytest.approx(2.0, abs=0.4)
