"""The double derivative, the wind compensation and their gains."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from tests.control.vehicle import PointMass, circle, f550, fly, hold_at
from uasfly.airframe import Airframe, ModelParameters
from uasfly.control.controller import PidDdController
from uasfly.control.position_gains import ACCELERATION_FILTER_S, position_gains
from uasfly.files import find_file, load_file, shipped_names
from uasfly.messages import Array, ReferenceHorizon, Setpoint
from uasfly.wind.compensation import tilt_offsets

AIRFRAME = f550(delay_s=0.045)
HERE = hold_at((0.0, 0.0, 1.0))
GRAVITY = 9.80665


def _vehicle() -> PointMass:
    return PointMass(AIRFRAME, 0.045, position=np.array((0.0, 0.0, 1.0)))


def _gusts(time_s: float) -> Array:
    phases = 2.0 * math.pi * time_s * np.array((0.11, 0.17, 0.0))
    return np.asarray(np.array((1.0, -0.6, 0.0)) + np.array((0.6, 0.5, 0.0)) * np.sin(phases))


def _margins(model: ModelParameters, *, double_derivative: bool) -> tuple[float, float]:
    """Gain margin [dB] and phase margin [deg] of the horizontal loop, broken at the command."""
    file = load_file(find_file("airframe", "f550"), Airframe)
    gains = position_gains(model, file.backup, double_derivative=double_derivative)
    pid, k = gains.pid.horizontal, gains.double_derivative
    omega = np.logspace(-1.0, 2.0, 20_000)
    s = 1j * omega
    lag = max(model.roll.tau_s, model.pitch.tau_s)
    loop = np.exp(-s * model.command_delay_s) / (lag * s + 1.0)
    loop *= k / (ACCELERATION_FILTER_S * s + 1.0) + pid.kd / s + pid.kp / s**2 + pid.ki / s**3
    size, phase = np.abs(loop), np.degrees(np.unwrap(np.angle(loop)))
    phase -= 360.0 * np.round((phase[0] + 270.0) / 360.0)  # at low frequencies three integrators: -270 deg
    through = np.flatnonzero((size[:-1] >= 1.0) & (size[1:] < 1.0))[-1]
    beyond = np.flatnonzero((phase[through:-1] >= -180.0) & (phase[through + 1 :] < -180.0))[0] + through
    return -20.0 * math.log10(size[beyond]), float(phase[through]) + 180.0


@pytest.mark.parametrize("name", shipped_names("airframe"))
def test_the_rule_leaves_room_on_every_shipped_airframe(name: str) -> None:
    """Ten decibels and fifty degrees with the double derivative; the plain PID has 30 deg and more gain."""
    model = load_file(find_file("airframe", name), Airframe).model
    gain_db, phase_deg = _margins(model, double_derivative=True)
    assert gain_db > 9.9
    assert phase_deg > 50.0
    plain_db, plain_deg = _margins(model, double_derivative=False)
    assert plain_db > 12.0
    assert plain_deg > 30.0


def test_the_rule_is_the_double_ratio() -> None:
    """a_i^2 = 2 a_(i-1) a_(i+1) for T s^4 + s^3 + kd s^2 + kp s + ki."""
    gains = position_gains(AIRFRAME.model, AIRFRAME.backup, double_derivative=False)
    pid = gains.pid.horizontal
    a = (pid.ki, pid.kp, pid.kd, 1.0, 0.045 + 0.14199)
    assert [a[i] ** 2 / (a[i - 1] * a[i + 1]) for i in (1, 2, 3)] == pytest.approx([2.0] * 3)
    assert gains.double_derivative == 0.0
    assert gains.pid.vertical == AIRFRAME.backup.vertical


def test_each_step_of_the_paper_strays_less() -> None:
    """In gusts of 0.6 m/s^2: PID, with the double derivative half of that at most, with the wind half again."""
    controllers = (
        PidDdController(AIRFRAME, double_derivative=False),
        PidDdController(AIRFRAME),
        PidDdController(AIRFRAME, wind=True),
    )
    found = [fly(_vehicle(), it, HERE, 20.0, force=_gusts, force_lag_s=0.1).rms(5.0) for it in controllers]
    assert found[1] < 0.5 * found[0]
    assert found[2] < 0.5 * found[1]


def test_on_a_circle_it_follows_the_acceleration_of_the_reference() -> None:
    """The double derivative acts on the acceleration's error: without wind it adds nothing to brake a turn."""
    vehicle = PointMass(AIRFRAME, 0.045, position=np.array((1.0, 0.0, 1.0)), yaw=-math.pi)
    flight = fly(vehicle, PidDdController(AIRFRAME), circle(), 16.0)
    assert flight.rms(8.0) < 0.08


def test_a_push_tilts_against_itself() -> None:
    """Speed gained without a command (0.5 m/s^2 east for a while) leans west by k times that, beside the PID."""
    quiet, pushed = PidDdController(AIRFRAME), PidDdController(AIRFRAME)
    points = []
    for controller, push in ((quiet, 0.0), (pushed, 0.5)):
        controller.reset(0.0, None)
        for step in range(20):
            velocity = (
                np.array((0.01, 0.0, 0.0)) if push == 0.0 else np.array((0.01 - 0.5 * 0.02 * (19 - step), 0.0, 0.0))
            )
            estimate = dataclasses.replace(_vehicle().estimate(np.zeros(3)), velocity_in_world=velocity)
            point = controller.step(step * 0.02, estimate, HERE, None).setpoint
        points.append(point)
    leans = (points[1].pitch_rad - points[0].pitch_rad) * AIRFRAME.model.pitch.gain
    k = pushed.gains.double_derivative
    assert k == 1.0
    assert leans == pytest.approx(-k * 0.5 / GRAVITY, rel=0.02)


def test_an_accelerometer_can_take_the_place_of_the_velocity() -> None:
    """Handed in, the acceleration is believed, after its filter."""
    controller = PidDdController(AIRFRAME, measured_acceleration=lambda: np.array((0.5, 0.0, 0.0)))
    controller.reset(0.0, None)
    for step in range(30):
        point = controller.step(step * 0.02, _vehicle().estimate(np.zeros(3)), HERE, None).setpoint
    assert point.pitch_rad * AIRFRAME.model.pitch.gain == pytest.approx(-0.5 / GRAVITY, rel=0.02)


@pytest.mark.parametrize("yaw", [0.0, 1.2])
def test_compensation_is_the_papers_tilt(yaw: float) -> None:
    """Standing in known wind from the first step, it leans by eq. 31 and 32, and lifts for the part from above."""
    controller = PidDdController(AIRFRAME, wind=True)
    controller.reset(0.0, None)
    vehicle, force = _vehicle(), np.array((1.2, -0.7, -0.3))
    vehicle.yaw = yaw
    point = controller.step(0.0, vehicle.estimate(force), hold_at((0.0, 0.0, 1.0), yaw), None).setpoint
    model = AIRFRAME.model
    roll, pitch = tilt_offsets(force, yaw, model.k_thrust_m_s2 * point.thrust)
    assert (point.roll_rad * model.roll.gain, point.pitch_rad * model.pitch.gain) == pytest.approx(
        (roll, pitch), abs=1e-6
    )
    assert model.k_thrust_m_s2 * point.thrust * math.cos(roll) * math.cos(pitch) == pytest.approx(GRAVITY + 0.3)


def test_taking_over_again_forgets_the_old_motion() -> None:
    """Between two flights the velocity may change by metres a second: that is no acceleration."""
    controller = PidDdController(AIRFRAME)
    controller.reset(0.0, None)
    fast = dataclasses.replace(_vehicle().estimate(np.zeros(3)), velocity_in_world=np.array((4.0, 0.0, 0.0)))
    for step in range(5):
        controller.step(step * 0.02, fast, HERE, None)
    before = Setpoint(1.0, 0.02, -0.03, 0.0, 0.0, 0.35)
    controller.reset(1.0, before)
    points = [controller.step(1.0 + 0.02 * n, _vehicle().estimate(np.zeros(3)), HERE, None).setpoint for n in range(5)]
    for point in points:
        assert (point.roll_rad, point.pitch_rad) == pytest.approx((0.02, -0.03), abs=1e-3)


def test_a_jump_of_the_estimate_is_bounded() -> None:
    """A velocity that jumps by 10 m/s in a cycle counts as one g for that cycle."""
    controller = PidDdController(AIRFRAME)
    controller.reset(0.0, None)
    estimate = _vehicle().estimate(np.zeros(3))
    controller.step(0.0, estimate, HERE, None)
    controller._filtered(0.02, np.array((10.0, 0.0, 0.0)), np.zeros(3))
    assert controller._acceleration is not None
    assert controller._acceleration[0] <= GRAVITY * (1.0 - math.exp(-0.02 / ACCELERATION_FILTER_S)) + 1e-9


def test_a_reference_that_is_lost_leaves_the_acceleration_alone() -> None:
    """NaN in the reference's acceleration for some cycles does no harm after them."""
    controller = PidDdController(AIRFRAME)
    controller.reset(0.0, None)

    def lost(times: Array) -> ReferenceHorizon:
        horizon = HERE(times)
        return dataclasses.replace(horizon, acceleration_in_world=np.full_like(horizon.acceleration_in_world, math.nan))

    for step in range(10):
        reference = lost if step < 5 else HERE
        point = controller.step(step * 0.02, _vehicle().estimate(np.zeros(3)), reference, None).setpoint
    assert (point.roll_rad, point.pitch_rad) == pytest.approx((0.0, 0.0), abs=1e-9)
