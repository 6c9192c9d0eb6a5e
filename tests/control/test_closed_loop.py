"""Controllers in closed loop with an independent vehicle."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from tests.control.vehicle import PointMass, circle, f550, fly, hold_at
from uasfly.airframe import Weights
from uasfly.control.controller import NmpcController, PidController
from uasfly.frames import wrap_angle
from uasfly.messages import Array, StateEstimate

STIFF = Weights(
    position=(600, 600, 600), velocity=(50, 50, 50), tilt=(1, 1), roll=135, pitch=135, thrust=750, terminal=10
)
HERE = hold_at((0.0, 0.0, 1.0))


def _gust(time: float) -> Array:
    """1.5 m/s^2 toward +x and some of it sideways and down, from 2 s to 5 s, edges of 0.3 s."""
    share = float(np.clip((time - 2.0) / 0.3, 0.0, 1.0) - np.clip((time - 5.0) / 0.3, 0.0, 1.0))
    return share * np.array((1.5, -0.5, -0.4))


def _at(airframe_delay_s: float = 0.03, true_delay_s: float = 0.03, weights: Weights = STIFF) -> PointMass:
    vehicle = PointMass(f550(delay_s=airframe_delay_s, weights=weights), true_delay_s)
    vehicle.position = np.array((0.0, 0.0, 1.0))
    return vehicle


def test_it_comes_to_the_reference_and_stays_without_an_offset(backend_name: str) -> None:
    """From 2 m away, in steady wind that is known, turned by 100 degrees: at rest there to a tenth of a millimetre."""
    vehicle = _at()
    vehicle.position, vehicle.yaw = np.array((1.5, -1.0, 0.3)), -1.0
    force = np.array((1.2, -0.7, 0.3))
    controller = NmpcController(vehicle.airframe, backend=backend_name)
    flight = fly(vehicle, controller, hold_at((0.0, 0.0, 1.0), 0.75), 10.0, force=lambda _: force)
    assert flight.error[-1] < 1e-4
    assert abs(wrap_angle(flight.yaw[-1] - 0.75)) < math.radians(0.1)
    assert controller.fallback_steps == {"plan": 0, "backup": 0}


def test_setpoints_respect_the_bounds_and_use_them(backend_name: str) -> None:
    """Five metres away it leans as far as it may and no further."""
    vehicle = _at()
    vehicle.position = np.array((4.0, 3.0, 3.0))
    flight = fly(vehicle, NmpcController(vehicle.airframe, backend=backend_name), HERE, 4.0)
    tilt = vehicle.airframe.limits.tilt_rad
    commands = flight.commands
    assert np.abs(commands[:, 1:]).max() == pytest.approx(tilt)
    assert commands[:, 0].min() >= 0.15
    assert commands[:, 0].max() <= 0.75
    assert flight.error[-1] < 0.1


def test_a_circle_is_flown_to_millimetres_while_turning() -> None:
    """1 m radius in 8 s in wind, facing the centre: under 3 mm and 1 degree, once on it."""
    vehicle = _at()
    vehicle.position, vehicle.yaw = np.array((1.0, 0.0, 1.0)), math.pi
    force = np.array((0.8, 0.3, 0.0))
    flight = fly(vehicle, NmpcController(vehicle.airframe), circle(), 14.0, force=lambda _: force)
    assert flight.rms(5.0) < 0.003
    wanted = math.pi + 2.0 * math.pi / 8.0 * flight.time_s
    errors = [abs(wrap_angle(a - b)) for a, b in zip(flight.yaw, wanted, strict=True)]
    assert max(errors[250:]) < math.radians(1.0)


def test_a_wrong_force_costs_what_the_stiffness_says_and_no_more() -> None:
    """0.2 m/s^2 of error in the force estimate: a constant offset of centimetres, no drift, no oscillation."""
    vehicle = _at()
    flight = fly(vehicle, NmpcController(vehicle.airframe), HERE, 10.0, force_error=(0.2, 0.0, 0.0))
    assert 0.001 < flight.error[-1] < 0.03
    assert np.ptp(flight.error[-100:]) < 1e-4


@pytest.mark.parametrize("delay_s", [0.02, 0.04])
def test_gusts_push_it_only_centimetres(delay_s: float) -> None:
    """1.5 m/s^2 with edges of 0.3 s and a force estimate 0.25 s behind: under 4 cm RMS, under 10 cm at worst."""
    vehicle = _at(delay_s, delay_s)
    flight = fly(vehicle, NmpcController(vehicle.airframe), HERE, 9.0, force=_gust)
    assert flight.rms() < 0.04
    assert flight.error.max() < 0.10
    assert np.degrees(flight.commands[-50:, 1:].std(axis=0)).max() < 0.2


def test_it_damps_out_with_a_slower_attitude_and_more_delay_than_it_believes() -> None:
    """40 ms more dead time and attitude loops a third slower than in the file: gusts still die away."""
    vehicle = _at(0.03, 0.07)
    model = vehicle.airframe.model
    slow = {
        name: axis.model_copy(update={"tau_s": 1.33 * axis.tau_s})
        for name, axis in (("roll", model.roll), ("pitch", model.pitch))
    }
    controller = NmpcController(vehicle.airframe)
    vehicle.airframe = vehicle.airframe.model_copy(update={"model": model.model_copy(update=slow)})
    flight = fly(vehicle, controller, HERE, 10.0, force=_gust)
    assert flight.rms() < 0.06
    assert np.degrees(flight.commands[-100:, 1:].std(axis=0)).max() < 1.0


def test_knowing_the_delay_takes_its_error_away() -> None:
    """60 ms of dead time on a fast circle: with it in the model the path is flown ten times as well as without."""
    errors = []
    for believed in (0.0, 0.06):
        vehicle = _at(believed, 0.06)
        vehicle.position = np.array((1.0, 0.0, 1.0))
        path = circle(period_s=5.0, facing_centre=False)
        errors.append(fly(vehicle, NmpcController(vehicle.airframe), path, 9.0).rms(4.0))
    assert errors[1] < 0.1 * errors[0]


def test_late_estimates_are_brought_up_to_date() -> None:
    """Estimates that are 80 ms old, and say so, cost little on a circle."""
    kept: list[StateEstimate] = []

    def late(time: float, estimate: StateEstimate) -> StateEstimate:
        kept.append(estimate)
        return kept[max(0, len(kept) - 5)]

    vehicle = _at()
    vehicle.position, vehicle.yaw = np.array((1.0, 0.0, 1.0)), math.pi
    flight = fly(vehicle, NmpcController(vehicle.airframe), circle(), 10.0, disturb=late)
    assert flight.rms(5.0) < 0.01


def test_a_sagging_battery_is_no_offset() -> None:
    """At 85 % of the reference voltage thrust falls by 28 %; told the voltage, the height stays."""
    vehicle = _at()
    vehicle.k_thrust *= 0.85**2
    flight = fly(vehicle, NmpcController(vehicle.airframe), HERE, 5.0, voltage_v=0.85 * 14.8)
    assert flight.error[-1] < 1e-3


def test_noise_is_not_amplified_into_shaking() -> None:
    """3 mm, 2 cm/s and 0.05 m/s^2 of white noise each cycle: commands move by less than 2 degrees RMS."""
    rng = np.random.default_rng(50)

    def noisy(time: float, estimate: StateEstimate) -> StateEstimate:
        return dataclasses.replace(
            estimate,
            position_in_world=estimate.position_in_world + 3e-3 * rng.normal(size=3),
            velocity_in_world=estimate.velocity_in_world + 2e-2 * rng.normal(size=3),
            force_in_world=estimate.force_in_world + 5e-2 * rng.normal(size=3),
        )

    vehicle = _at()
    flight = fly(vehicle, NmpcController(vehicle.airframe), HERE, 6.0, disturb=noisy)
    assert flight.rms(1.0) < 0.01
    assert np.degrees(flight.commands[:, 1:].std(axis=0)).max() < 2.0


def test_the_pid_holds_in_wind_it_does_not_know() -> None:
    """Its integral finds a steady force: no offset after half a minute; gusts cost it decimetres, not more."""
    vehicle = _at()
    force = np.array((1.2, -0.7, 0.3))
    flight = fly(vehicle, PidController(vehicle.airframe), HERE, 30.0, force=lambda _: force)
    assert flight.error[-1] < 2e-3
    gusty = fly(_at(), PidController(vehicle.airframe), HERE, 9.0, force=_gust)
    assert gusty.error.max() < 0.5


def test_the_pid_flies_a_circle() -> None:
    """In still air, with the acceleration fed forward: centimetres, and the yaw with it."""
    vehicle = _at()
    vehicle.position, vehicle.yaw = np.array((1.0, 0.0, 1.0)), math.pi
    flight = fly(vehicle, PidController(vehicle.airframe), circle(), 14.0)
    assert flight.rms(6.0) < 0.08


def test_the_nmpc_is_at_least_twice_as_good_as_the_pid_in_gusts() -> None:
    """Same vehicle, same gust."""
    errors = []
    for make in (NmpcController, PidController):
        vehicle = _at()
        errors.append(fly(vehicle, make(vehicle.airframe), HERE, 9.0, force=_gust).rms())
    assert errors[0] < 0.5 * errors[1]
