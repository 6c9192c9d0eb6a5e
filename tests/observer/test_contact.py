"""Touch-down: the vehicle stands while PX4 still calls it flying and the thrust goes away."""

from __future__ import annotations

import numpy as np
import pytest

from tests.observer.airframes import f550
from tests.observer.test_observer import LEVEL, ZERO, estimated, in_air, odometry, setpoint
from uasfly.airframe import GRAVITY_M_S2
from uasfly.messages import Array, AttitudeTargetSample, FlightMode, OdometrySample, VehicleSample
from uasfly.observer import Observer
from uasfly.observer.contact import GroundContact

K_THRUST = f550().model.k_thrust_m_s2
HOVER = GRAVITY_M_S2 / K_THRUST


def stood(climbs_m_s: list[float], thrust_m_s2: float, dt_s: float = 0.01) -> list[bool]:
    """What is said of samples of the climb rate."""
    contact, told = GroundContact(), []
    for k, climb_m_s in enumerate(climbs_m_s):
        contact.look(k * dt_s, climb_m_s, thrust_m_s2)
        told.append(contact.stands)
    return told


def test_without_thrust_and_without_falling_it_stands() -> None:
    """Told after 0.15 s, and no longer at the first sample that moves or with thrust again."""
    told = stood([0.02] * 30 + [0.4] + [0.02] * 5, 2.0)
    assert told.index(True) == pytest.approx(15, abs=1)
    assert all(told[16:30])
    assert not any(told[30:])
    assert not any(stood([0.0] * 100, 0.7 * GRAVITY_M_S2))


def test_a_clock_that_was_set_back_makes_no_contact() -> None:
    """It stood at 1 s; in the air at 0.5 s, on a new clock, that is not lately."""
    contact = GroundContact()
    for k in range(100):
        contact.look(0.01 * k, 0.0, 2.0)
    assert contact.stood_lately
    contact.look(0.5, 0.0, GRAVITY_M_S2)
    assert not contact.stood_lately


@pytest.mark.parametrize("share", [0.0, 0.25, 0.49])
def test_a_vehicle_that_is_thrown_up_is_not_taken_for_standing(share: float) -> None:
    """It passes through rest at the top, with whatever thrust."""
    rates = [2.0 - (1.0 - share) * GRAVITY_M_S2 * 0.01 * k for k in range(80)]
    assert rates[-1] < -1.0
    assert not any(stood(rates, share * GRAVITY_M_S2))


def landed(until_s: float, gnss_sigma_m: float) -> Array:
    """Vertical velocity (n,) [m/s] as estimated, every 0.01 s, white noise on GNSS.

    Down at 0.3 m/s, on the ground at 1 s, the thrust is gone at 2 s.
    """
    rng, observer = np.random.default_rng(1), Observer(f550())
    observer.add(VehicleSample(-1.0, FlightMode.LAND, armed=True, in_air=True))
    climbs = []
    for k in range(round(until_s * 100)):
        time_s = 0.01 * k
        observer.add(AttitudeTargetSample(time_s, LEVEL, HOVER * float(np.clip(2.0 - time_s, 0.0, 1.0))))
        down = time_s < 1.0
        velocity = np.array((0.0, 0.0, -0.3 if down else 0.0)) + 0.02 * rng.standard_normal(3)
        position = np.array((0.0, 0.0, 0.3 - 0.3 * min(time_s, 1.0))) + gnss_sigma_m * rng.standard_normal(3)
        observer.add(OdometrySample(time_s, position, velocity, LEVEL, ZERO))
        climbs.append(estimated(observer, time_s).velocity_in_world[2])
    return np.array(climbs)


@pytest.mark.parametrize(("gnss_sigma_m", "lowest_m_s"), [(0.01, -0.15), (0.1, -4.0), (0.2, -0.15)])
def test_after_touch_down_the_estimate_stands_with_the_vehicle(gnss_sigma_m: float, lowest_m_s: float) -> None:
    """The ground takes the weight within a second, PX4 says nothing yet: the estimate does not fall through it.

    With GNSS so bad that no velocity agrees with it, it may fall as long as it takes until standing is noticed.
    """
    climbs = landed(4.0, gnss_sigma_m)
    assert np.abs(climbs[80:100] + 0.3).max() < 0.1
    assert climbs[120:].min() > lowest_m_s
    assert np.abs(climbs[220:]).max() < 0.08


def test_when_px4_takes_over_its_own_thrust_counts_at_once() -> None:
    """Half a second of our last thrust would be a wrong acceleration for so long; in offboard it is only an echo."""
    observer = Observer(f550())
    observer.add(in_air(-1.0))
    for k in range(100):
        observer.sent(setpoint(0.01 * k, HOVER), in_offboard=True)
        observer.add(odometry(0.01 * k))
    observer.add(VehicleSample(1.0, FlightMode.LAND, armed=True, in_air=True))
    for k in range(100, 130):  # it sinks with 2 m/s^2
        observer.add(AttitudeTargetSample(0.01 * k, LEVEL, HOVER - 2.0 / K_THRUST))
        sunk_s = max(0.01 * k - 1.0 - f550().model.command_delay_s, 0.0)
        velocity, position = np.array((0.0, 0.0, -2.0 * sunk_s)), np.array((0.0, 0.0, -(sunk_s**2)))
        observer.add(odometry(0.01 * k, velocity=velocity, position=position))
    estimate = estimated(observer, 1.29)
    assert estimate.velocity_in_world[2] == pytest.approx(-0.52, abs=0.03)
    assert np.abs(estimate.force_in_world).max() < 0.1


def test_a_vehicle_that_hops_off_the_ground_still_counts_as_carried_for_a_look() -> None:
    """With thrust again it is told for 0.2 s more, so that a look ten times a second sees it, and not for longer."""
    observer, carried = Observer(f550()), []
    observer.add(in_air(-1.0))
    for k in range(120):
        observer.sent(setpoint(0.01 * k, 0.3 * HOVER if 30 <= k < 60 else HOVER), in_offboard=True)
        observer.add(odometry(0.01 * k))
        carried.append(observer.carried)
    assert not any(carried[:45])
    assert all(carried[55:75])
    assert not any(carried[90:])


def test_on_the_ground_nothing_counts_as_carried() -> None:
    """That it stands there is no news where PX4 says so itself."""
    observer = Observer(f550())
    observer.add(in_air(-1.0))
    for k in range(60):
        observer.sent(setpoint(0.01 * k, 0.3 * HOVER), in_offboard=True)
        observer.add(odometry(0.01 * k))
    assert observer.carried
    observer.add(VehicleSample(0.6, FlightMode.OFFBOARD, armed=False, in_air=False))
    assert not observer.carried
