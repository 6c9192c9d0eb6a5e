"""Thrust coefficient and vertical wind told apart."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from uasfly.airframe import GRAVITY_M_S2
from uasfly.control.thrust_trim import FIRST_SIGMA, LIMIT, NEAR_HOVER_M_S, ThrustTrim

STEP_S = 0.2
FORCE_SIGMA = 0.18  # m/s^2, as the observer tells it
FORCE_NOISE = 0.08  # m/s^2, what is seen in calm


@dataclass
class Hover:
    """Trim [1], true share of the thrust coefficient [1], wind and force [m/s^2], (n,) each, once a step."""

    trim: NDArray[np.float64]
    true: NDArray[np.float64]
    wind: NDArray[np.float64]
    force: NDArray[np.float64]

    @property
    def error(self) -> NDArray[np.float64]:
        """Vertical force that is wrongly told [m/s^2], after the first 20 s."""
        return (self.true - self.trim)[round(20.0 / STEP_S) :] * GRAVITY_M_S2


def gusts(seconds: float, sigma: float, time_s: float, seed: int) -> NDArray[np.float64]:
    """First-order Gauss-Markov force of a vertical wind [m/s^2]."""
    rng, kept = np.random.default_rng(seed), math.exp(-STEP_S / time_s)
    drive = sigma * math.sqrt(1.0 - kept * kept) * rng.standard_normal(round(seconds / STEP_S))
    wind, value = np.empty(len(drive)), sigma * rng.standard_normal()
    for index, push in enumerate(drive.tolist()):
        value = kept * value + push
        wind[index] = value
    return wind


def hover(true: NDArray[np.float64], wind: NDArray[np.float64], seed: int = 0) -> Hover:
    """A vehicle that holds its height with (1 + true) T + wind = g, seen by an observer that believes in the trim."""
    trim, rng = ThrustTrim(), np.random.default_rng([seed, 1])
    trims, forces = np.empty(len(true)), np.empty(len(true))
    for index, (share, push) in enumerate(zip(true.tolist(), wind.tolist(), strict=True)):
        promised = (GRAVITY_M_S2 - push) / (1.0 + share)
        forces[index] = GRAVITY_M_S2 - (1.0 + trim.trim) * promised + FORCE_NOISE * rng.standard_normal()
        trims[index] = trim.update(index * STEP_S, forces[index], FORCE_SIGMA, 0.0)
    return Hover(trims, true, wind, forces)


def sag(share: float, seconds: float) -> NDArray[np.float64]:
    """Thrust that falls evenly by a share."""
    return np.linspace(0.0, -share, round(seconds / STEP_S))


def test_a_sag_in_calm_air_shows_no_wind() -> None:
    """10 % over five minutes: at most 0.1 m/s^2 at any time."""
    flown = hover(sag(0.1, 300.0), np.zeros(1500))
    assert np.abs(flown.error).max() < 0.1
    assert flown.trim[-1] == pytest.approx(-0.1, abs=0.006)


@pytest.mark.parametrize("time_s", [0.5, 2.0])
def test_a_sag_is_told_from_vertical_gusts(time_s: float) -> None:
    """10 % over five minutes in gusts of 0.3 m/s^2, 20 flights: hardly any bias, half of the gusts at most."""
    flights = [hover(sag(0.1, 300.0), gusts(300.0, 0.3, time_s, seed), seed) for seed in range(20)]
    errors = np.array([flown.error for flown in flights])
    assert abs(errors.mean()) < 0.05
    assert math.sqrt(float((errors**2).mean())) < 0.15
    told = np.array([np.corrcoef(flown.force, flown.wind)[0, 1] for flown in flights])
    assert told.min() > 0.8  # the gusts stay in the force


def test_gusts_alone_are_no_sag() -> None:
    """Of 0.3 m/s^2, 3 % of the thrust: 1.5 % RMS, zero in the mean over 20 flights."""
    flights = [hover(np.zeros(1500), gusts(300.0, 0.3, 2.0, seed), seed) for seed in range(20)]
    errors = np.array([flown.error for flown in flights])
    assert math.sqrt(float((errors**2).mean())) < 0.15
    assert abs(errors.mean()) < 0.05


def test_a_jet_in_passing_moves_the_trim_little() -> None:
    """2 m/s^2 for 5 s after a calm minute: a tenth of it, and forgotten within a minute."""
    wind = np.zeros(1000)
    wind[300:325] = 2.0
    flown = hover(np.zeros(1000), wind)
    assert np.abs(flown.trim).max() * GRAVITY_M_S2 < 0.2
    assert abs(flown.trim[625]) * GRAVITY_M_S2 < 0.05


def test_a_step_recovers_within_minutes() -> None:
    """10 % at once, as no wind would stay: a third in one minute, all but 0.1 m/s^2 in two and a half."""
    true = np.where(np.arange(1500) < 300, 0.0, -0.1)
    flown = hover(true, np.zeros(1500))
    left = (flown.true - flown.trim) * GRAVITY_M_S2
    assert abs(left[600]) < 0.65
    assert np.abs(left[1050:]).max() < 0.1


def test_a_payload_is_known_soon_after_lift_off() -> None:
    """Before it has learnt anything the trim is expected to be wrong: 10 s for 9 of 10 %, after a landing again."""
    trim = ThrustTrim()
    for flight, true in enumerate((-0.1, 0.0)):
        trim.lift_off()
        assert trim.sigma == FIRST_SIGMA
        for step in range(round(15.0 / STEP_S)):
            force = GRAVITY_M_S2 * (true - trim.trim) / (1.0 + true)
            trim.update(1000.0 * flight + step * STEP_S, force, FORCE_SIGMA, 0.0)
        assert trim.trim == pytest.approx(true, abs=0.02)
        assert trim.sigma < 0.5 * FIRST_SIGMA


@pytest.mark.parametrize(
    ("force", "climb"),
    [(-1.0, NEAR_HOVER_M_S), (-1.0, -2.0), (-1.0, math.nan), (math.nan, 0.0), (math.inf, 0.0)],
)
def test_climbs_and_bad_numbers_teach_nothing(force: float, climb: float) -> None:
    """The trim stays what it was, and goes on afterwards."""
    trim = ThrustTrim()
    trim.update(0.0, -0.5, FORCE_SIGMA, 0.0)
    before = trim.update(0.2, -0.5, FORCE_SIGMA, 0.0)
    assert trim.update(0.4, force, FORCE_SIGMA, climb) == before
    assert trim.update(0.4, -0.5, FORCE_SIGMA, 0.0) == before  # no time has passed
    assert trim.update(0.6, -0.5, FORCE_SIGMA, 0.0) < before


def test_the_trim_is_bounded() -> None:
    """What lies beyond stays in the force."""
    for force, bound in ((-8.0, -LIMIT), (8.0, LIMIT)):
        trim = ThrustTrim()
        for step in range(6000):
            trim.update(step * STEP_S, force, FORCE_SIGMA, 0.0)
        assert trim.trim == bound
