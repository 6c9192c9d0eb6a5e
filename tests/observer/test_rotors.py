"""Thrust by the rotors' speeds in the filter."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from tests.observer.airframes import f550
from uasfly.airframe import GRAVITY_M_S2, Airframe
from uasfly.messages import Array, FlightMode, OdometrySample, RotorSample, Setpoint, StateEstimate, VehicleSample
from uasfly.observer import Observer
from uasfly.observer.pairs import paired
from uasfly.observer.rotors import FRESH_S, FROZEN_S, RotorThrust
from uasfly.observer.thrust import ThrustHistory

HOVER_RAD_S = 509.5
LEVEL, REST = np.array((1.0, 0.0, 0.0, 0.0)), np.zeros(3)
SAG = 0.1
Speeds = Callable[[int], Array | None]  # (6,) [rad/s] by the number of the sample


def airframe(hover_rad_s: float | None = HOVER_RAD_S) -> Airframe:
    """The f550 with rotors that are known."""
    made = f550(force_density=0.5)
    return made.model_copy(update={"model": made.model.model_copy(update={"hover_rotor_rad_s": hover_rad_s})})


def steady(index: int) -> Array:
    """Speeds of a hover; the last digits change, as measured ones do."""
    return np.asarray(HOVER_RAD_S + 0.1 * np.sin(index + np.arange(6.0)))


def hover(observer: Observer, speeds: Speeds, end_s: float = 2.0, begin_s: float = 0.0) -> StateEstimate:
    """A hover at rest for which it takes more command than the file says: the thrust has fallen by SAG."""
    if begin_s == 0.0:
        observer.add(VehicleSample(-1.0, FlightMode.OFFBOARD, armed=True, in_air=True))
    command = GRAVITY_M_S2 / 28.54209 / (1.0 - SAG)
    for k in range(round(begin_s / 0.02), round(end_s / 0.02)):
        time_s = 0.02 * k
        observer.sent(Setpoint(time_s, 0.0, 0.0, 0.0, 0.0, command), in_offboard=True)
        told = speeds(k)
        if told is not None:
            observer.add(RotorSample(time_s, told))
        observer.add(OdometrySample(time_s, REST, REST, LEVEL, REST))
    estimate = observer.estimate(end_s)
    assert estimate is not None
    return estimate


def test_rotors_tell_a_sag_from_a_downdraft() -> None:
    """By commands the force shows the sag at once; by rotors none, and the ratio of the two is the sag."""
    by_commands, by_rotors = Observer(airframe(None)), Observer(airframe())
    assert hover(by_commands, steady).force_in_world[2] == pytest.approx(-GRAVITY_M_S2 * SAG / (1.0 - SAG), abs=0.05)
    assert abs(hover(by_rotors, steady).force_in_world[2]) < 0.02
    assert by_commands.rotor_ratio is None
    assert by_rotors.rotor_ratio == pytest.approx(1.0 - SAG, abs=0.005)


def test_a_true_downdraft_is_still_force() -> None:
    """Rotors that turn faster to hold the height against it say so."""
    factor = math.sqrt(1.0 + 0.5 / GRAVITY_M_S2)
    estimate = hover(Observer(airframe()), lambda k: factor * steady(k))
    assert estimate.force_in_world[2] == pytest.approx(-0.5, abs=0.05)


def frozen(_: int) -> Array:
    """The same to the last digit."""
    return np.full(6, HOVER_RAD_S)


def stopped(index: int) -> Array:
    """One rotor stands, or says so."""
    return np.asarray(steady(index) * (np.arange(6) != 2))


@pytest.mark.parametrize(
    "garbage",
    [
        lambda _: None,
        lambda k: np.full(6, math.nan) + k,
        lambda k: -steady(k),
        lambda k: 1e30 * steady(k),
        lambda k: steady(k)[:4],
        lambda k: 7.0 / 6.0 * steady(k) * 1.2,
        stopped,
        frozen,
    ],
)
def test_without_rotors_that_can_be_believed_it_flies_by_commands(garbage: Speeds) -> None:
    """Silent, not finite, negative, absurd, too few, of another pole count, one at nil, frozen."""
    by_commands, observer = Observer(airframe(None)), Observer(airframe())
    expected, estimate = hover(by_commands, steady), hover(observer, garbage)
    assert estimate.force_in_world[2] == pytest.approx(expected.force_in_world[2], abs=0.03)
    assert np.isfinite(estimate.force_sigma_m_s2).all()
    assert observer.rotor_ratio is None
    assert abs(hover(observer, steady, 6.0, 2.0).force_in_world[2]) < 0.06  # and it goes back to them


def test_a_trim_of_either_thrust_moves_only_what_acts() -> None:
    """Commands trimmed under rotors leave the force as it is; rotors trimmed move it by the share."""
    observer = Observer(airframe())
    before = hover(observer, steady)
    assert observer.rotor_excess_m_s2 == pytest.approx(-GRAVITY_M_S2 * SAG / (1.0 - SAG), abs=0.05)
    observer.correct_thrust(1.0 - SAG)
    after = observer.estimate(2.0)
    assert after is not None
    np.testing.assert_allclose(after.force_in_world, before.force_in_world, atol=1e-9)
    assert observer.rotor_ratio == pytest.approx(1.0, abs=0.005)
    assert observer.rotor_excess_m_s2 == pytest.approx(0.0, abs=0.03)
    observer.correct_thrust(1.0, 0.95)
    moved = observer.estimate(2.0)
    assert moved is not None
    assert moved.force_in_world[2] - after.force_in_world[2] == pytest.approx(0.05 * GRAVITY_M_S2, abs=0.01)
    np.testing.assert_allclose(moved.velocity_in_world, after.velocity_in_world, atol=2e-3)


def test_thrust_is_a_line_between_samples_and_goes_over_to_the_commands() -> None:
    """A gap is the commands' too, and so is what was before."""
    rotors = RotorThrust(airframe(), ThrustHistory(0.0, 12.0))
    for index, time_s in enumerate((1.0, 1.02, 1.5)):
        assert rotors.add(RotorSample(time_s, math.sqrt(1.0 + 0.1 * index) * steady(index)), flies=False)
    assert rotors.mean(1.009, 1.011) == pytest.approx(1.05 * GRAVITY_M_S2, rel=1e-3)
    assert rotors.mean(0.5, 0.6) == rotors.mean(1.2, 1.3) == rotors.mean(1.6, 1.7) == 12.0
    ahead = [rotors.mean(1.5, 1.5 + 2.0 * x * FRESH_S) for x in (0.0, 0.25, 0.5, 1.0)]
    assert ahead[0] == pytest.approx(1.2 * GRAVITY_M_S2, rel=1e-3)
    assert ahead[-1] == pytest.approx(12.0)
    assert ahead == sorted(ahead)


def test_old_samples_are_left_out_until_the_clock_was_set_back() -> None:
    """One rotor that is frozen for long is enough, too."""
    rotors = RotorThrust(airframe(), ThrustHistory(0.0, 12.0))
    assert rotors.add(RotorSample(5.0, steady(0)), flies=True)
    assert not rotors.add(RotorSample(5.0, steady(1)), flies=True)
    assert not rotors.add(RotorSample(4.9, steady(2)), flies=True)
    assert not rotors.add(RotorSample(math.nan, steady(3)), flies=True)
    assert rotors.add(RotorSample(1.0, steady(4)), flies=True)
    used = [
        rotors.add(RotorSample(1.0 + 0.02 * k, np.append(steady(k)[:5], HOVER_RAD_S)), flies=True)
        for k in range(1, 100)
    ]
    assert all(used[: round(FROZEN_S / 0.02) - 1])
    assert not any(used[round(FROZEN_S / 0.02) + 1 :])


def test_rotors_come_before_the_odometry_that_came_with_them() -> None:
    """In the order in which they came."""
    odometry = OdometrySample(1.0, REST, REST, LEVEL, REST)
    one, other = RotorSample(0.98, steady(0)), RotorSample(1.0, steady(1))
    assert paired([odometry, one, other]) == [one, other, odometry]
