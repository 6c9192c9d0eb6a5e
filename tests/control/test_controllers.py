"""All controllers, one step at a time: what they send when all is well and when it is not."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest

from tests.control.vehicle import PointMass, circle, f550, fly, hold_at
from uasfly.control.controller import Controller, NmpcController, PidController, PidDdController, ReferenceAt
from uasfly.control.qp import SolveStatus
from uasfly.messages import Array, ReferenceHorizon, Setpoint, StateEstimate

AIRFRAME = f550()
HERE = hold_at((0.0, 0.0, 1.0))
NAN = np.full(3, math.nan)
LIMITS = AIRFRAME.limits

MakeController = Callable[[], Controller]
CONTROLLERS: dict[str, MakeController] = {
    "nmpc": lambda: NmpcController(AIRFRAME),
    "pid": lambda: PidController(AIRFRAME),
    "pid_dd": lambda: PidDdController(AIRFRAME),
    "pid_dd_wind": lambda: PidDdController(AIRFRAME, wind=True),
}
PIDS = [name for name in CONTROLLERS if name != "nmpc"]


@pytest.fixture(params=list(CONTROLLERS))
def controller(request: pytest.FixtureRequest) -> Controller:
    """Each controller in turn."""
    return CONTROLLERS[request.param]()


def _vehicle() -> PointMass:
    return PointMass(AIRFRAME, 0.03, position=np.array((0.0, 0.0, 1.0)))


def _usable(setpoint: Setpoint) -> bool:
    values = dataclasses.astuple(setpoint)
    return (
        all(math.isfinite(value) for value in values)
        and LIMITS.thrust_min <= setpoint.thrust <= LIMITS.thrust_max
        and max(abs(setpoint.roll_rad), abs(setpoint.pitch_rad)) <= LIMITS.tilt_rad
        and abs(setpoint.yaw_rate_rad_s) <= LIMITS.yaw_rate_rad_s
        and -math.pi <= setpoint.yaw_rad < math.pi
    )


def _poisoned(reference_at: ReferenceAt, name: str) -> ReferenceAt:
    def reference(times: Array) -> ReferenceHorizon:
        horizon = reference_at(times)
        return dataclasses.replace(horizon, **{name: np.full_like(getattr(horizon, name), math.nan)})

    return reference


ESTIMATE_FIELDS = (
    "position_in_world",
    "velocity_in_world",
    "quaternion_body_to_world",
    "angular_rate_in_body",
    "force_in_world",
)


@pytest.mark.parametrize("name", ESTIMATE_FIELDS)
@pytest.mark.parametrize("first", [True, False])
def test_an_estimate_with_nan_never_makes_an_unusable_setpoint(controller: Controller, name: str, first: bool) -> None:
    """Each field poisoned, on the very first step and in flight: finite, inside the limits, for two seconds."""
    vehicle = _vehicle()
    controller.reset(0.0, None)
    if not first:
        for step in range(5):
            controller.step(step * 0.02, vehicle.estimate(np.zeros(3)), HERE, 15.0)
    good = vehicle.estimate(np.zeros(3))
    bad = dataclasses.replace(good, **{name: np.full_like(getattr(good, name), math.nan)})
    for step in range(5, 105):
        assert _usable(controller.step(step * 0.02, bad, HERE, 15.0).setpoint)


@pytest.mark.parametrize(
    "name", ["position_in_world", "velocity_in_world", "acceleration_in_world", "yaw_rad", "yaw_rate_rad_s"]
)
def test_a_reference_with_nan_never_makes_an_unusable_setpoint(controller: Controller, name: str) -> None:
    """Likewise for the reference, on the first step and later."""
    vehicle = _vehicle()
    controller.reset(0.0, None)
    poisoned = _poisoned(HERE, name)
    for step in range(60):
        reference = poisoned if step < 3 or step > 10 else HERE
        assert _usable(controller.step(step * 0.02, vehicle.estimate(np.zeros(3)), reference, None).setpoint)


def test_wild_numbers_stay_inside_the_limits(controller: Controller) -> None:
    """Kilometres away, hundreds of metres a second, upside down: every setpoint is one PX4 may have."""
    rng = np.random.default_rng(40)
    controller.reset(0.0, None)
    for step in range(60):
        quaternion = rng.normal(size=4)
        estimate = dataclasses.replace(
            _vehicle().estimate(rng.normal(size=3) * 20.0),
            time_s=step * 0.02,
            position_in_world=rng.normal(size=3) * 1e3,
            velocity_in_world=rng.normal(size=3) * 1e2,
            quaternion_body_to_world=quaternion / np.linalg.norm(quaternion),
            angular_rate_in_body=rng.normal(size=3) * 10.0,
        )
        assert _usable(controller.step(step * 0.02, estimate, HERE, rng.uniform(0.0, 30.0)).setpoint)


def test_the_same_calls_give_the_same_setpoints_bit_for_bit(
    controller: Controller, request: pytest.FixtureRequest
) -> None:
    """Two controllers of a kind, the same flight: equal to the last bit."""
    other = CONTROLLERS[request.node.callspec.params["controller"]]()
    vehicle, rng = _vehicle(), np.random.default_rng(41)
    for one in (controller, other):
        one.reset(0.0, None)
    for step in range(50):
        estimate = dataclasses.replace(
            vehicle.estimate(rng.normal(size=3)), time_s=step * 0.02, position_in_world=rng.normal(size=3)
        )
        first, second = (one.step(step * 0.02, estimate, circle(), 15.0) for one in (controller, other))
        assert first.setpoint == second.setpoint


def test_the_nmpc_flies_its_plan_through_a_short_gap_and_the_backup_through_a_long_one() -> None:
    """NaN for 0.3 s: the plan; beyond 0.5 s: the PIDs; then the solver again. Each counted, each announced once."""
    controller = NmpcController(AIRFRAME)
    gap = (2.0, 3.0)
    texts = []

    def disturb(time: float, estimate: StateEstimate) -> StateEstimate:
        broken = gap[0] - 1e-9 < time < gap[1] - 1e-9
        return dataclasses.replace(estimate, velocity_in_world=NAN) if broken else estimate

    force = np.array((1.0, 0.5, 0.0))
    flight = fly(_vehicle(), controller, circle(), 6.0, disturb=disturb, force=lambda _: force)
    names = [result.fallback for result in flight.results]
    cycles = np.flatnonzero(np.array(names) != "")
    assert (cycles[0], cycles[-1]) == (100, 149)
    assert names[100:124] == ["plan"] * 24
    assert names[125:150] == ["backup"] * 25
    assert controller.fallback_steps == {"plan": 25, "backup": 25}
    texts = [result.text for result in flight.results if result.text]
    assert texts[-3:] == [
        "estimate or reference is not finite: the last plan flies on",
        "estimate or reference is not finite: the backup PIDs fly",
        "the solver flies again",
    ]
    assert all(result.status == SolveStatus.BAD_INPUT for result in flight.results[100:150])
    assert flight.error[:125].max() < 1.5
    assert flight.rms(5.5) < 0.02


def test_on_the_plan_alone_the_vehicle_hardly_leaves_the_path() -> None:
    """Half a second of plan, flown open loop on a circle in known wind, costs less than a centimetre."""

    def disturb(time: float, estimate: StateEstimate) -> StateEstimate:
        return dataclasses.replace(estimate, position_in_world=NAN) if 6.0 <= time < 6.5 else estimate

    vehicle = PointMass(AIRFRAME, 0.03, position=np.array((1.0, 0.0, 1.0)), yaw=-math.pi)
    force = np.array((1.0, 0.5, 0.2))
    flight = fly(vehicle, NmpcController(AIRFRAME), circle(), 6.6, disturb=disturb, force=lambda _: force)
    assert {result.fallback for result in flight.results[300:325]} == {"plan"}
    assert flight.error[300:326].max() < 0.01


def test_a_late_solve_is_replaced_by_what_its_plan_holds_for_later() -> None:
    """With a clock that says 0.1 s a solve, the setpoint is the plan's for 0.1 s later, and called "plan"."""
    ticks = iter(range(10**6))
    controller = NmpcController(AIRFRAME, timer=lambda: 0.1 * next(ticks))
    controller.reset(0.0, None)
    vehicle = PointMass(AIRFRAME, 0.03, position=np.array((0.5, -0.2, 1.1)))
    result = controller.step(0.0, vehicle.estimate(np.zeros(3)), HERE, None)
    assert result.fallback == "plan"
    assert result.solve_ms == pytest.approx(100.0)
    assert "too late" in result.text
    planned = controller.solver.planned_inputs(0.03 + 0.1)
    assert planned is not None
    point = result.setpoint
    np.testing.assert_allclose((point.thrust, point.roll_rad, point.pitch_rad), planned)


def test_without_a_timer_nothing_is_measured(controller: Controller) -> None:
    """The step calls no clock of its own."""
    controller.reset(0.0, None)
    assert controller.step(0.0, _vehicle().estimate(np.zeros(3)), HERE, None).solve_ms == 0.0


def test_a_timer_measures_the_solver(controller: Controller) -> None:
    """With a clock of 1 ms a look the measured time is a few of them."""
    ticks = iter(range(10**6))
    assert isinstance(controller, NmpcController | PidController | PidDdController)
    measured = type(controller)(AIRFRAME, timer=lambda: 1e-3 * next(ticks))
    measured.reset(0.0, None)
    assert measured.step(0.0, _vehicle().estimate(np.zeros(3)), HERE, None).solve_ms == pytest.approx(1.0)


@pytest.mark.parametrize("name", PIDS)
def test_taking_over_the_pid_goes_on_with_what_was_flown(name: str) -> None:
    """The first setpoint of a PID is the one handed over, though position and wind would ask for another."""
    controller = CONTROLLERS[name]()
    before = Setpoint(0.0, 0.05, -0.08, 0.3, 0.0, 0.36)
    controller.reset(0.0, before)
    vehicle = _vehicle()
    vehicle.position, vehicle.yaw = np.array((0.05, -0.05, 0.9)), 0.3
    vehicle.velocity = np.array((0.1, 0.05, 0.0))
    point = controller.step(0.0, vehicle.estimate(np.array((0.6, -0.4, 0.1))), HERE, None).setpoint
    np.testing.assert_allclose(
        (point.roll_rad, point.pitch_rad, point.yaw_rad, point.thrust), (0.05, -0.08, 0.3, 0.36), atol=2e-4
    )


def test_taking_over_in_wind_the_nmpc_does_not_jump() -> None:
    """Hovering tilted into known wind, the first setpoint is that tilt, to a tenth of a degree."""
    force = np.array((1.2, -0.6, 0.0))
    controller, vehicle = NmpcController(AIRFRAME), _vehicle()
    settled = fly(vehicle, NmpcController(AIRFRAME), HERE, 4.0, force=lambda _: force).results[-1].setpoint
    vehicle.time_s = 0.0
    controller.reset(0.0, settled)
    point = controller.step(0.0, vehicle.estimate(force), HERE, None).setpoint
    assert abs(point.roll_rad - settled.roll_rad) < math.radians(0.1)
    assert abs(point.pitch_rad - settled.pitch_rad) < math.radians(0.1)
    assert abs(point.thrust - settled.thrust) < 1e-3


def test_the_plan_is_shown_where_there_is_one() -> None:
    """Predicted positions start near the vehicle and end near the reference; the PIDs have none."""
    vehicle = PointMass(AIRFRAME, 0.03, position=np.array((0.5, 0.0, 1.0)))
    controller = NmpcController(AIRFRAME)
    controller.reset(0.0, None)
    result = controller.step(0.0, vehicle.estimate(np.zeros(3)), HERE, None)
    assert result.predicted_positions is not None
    assert result.predicted_positions.shape == (26, 3)
    np.testing.assert_allclose(result.predicted_positions[0], (0.5, 0.0, 1.0), atol=0.01)
    np.testing.assert_allclose(result.predicted_positions[-1], (0.0, 0.0, 1.0), atol=0.05)
    before = result.predicted_positions.copy()
    controller.step(0.02, dataclasses.replace(vehicle.estimate(np.zeros(3)), time_s=0.02), circle(), None)
    np.testing.assert_array_equal(result.predicted_positions, before)


def test_the_battery_changes_the_thrust(controller: Controller) -> None:
    """At 90 % of the reference voltage and an exponent of two, hover takes 1 / 0.81 of the thrust."""
    controller.reset(0.0, None)
    point = controller.step(0.0, _vehicle().estimate(np.zeros(3)), HERE, 0.9 * 14.8).setpoint
    assert point.thrust == pytest.approx(AIRFRAME.model.hover_thrust / 0.81, rel=1e-3)
    assert controller.k_thrust_m_s2(0.9 * 14.8) == pytest.approx(28.54209 * 0.81)


def test_a_slower_solver_is_announced_with_the_first_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a compiler the first text says so, once."""
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    controller = NmpcController(AIRFRAME)
    controller.reset(0.0, None)
    estimate = _vehicle().estimate(np.zeros(3))
    assert "virtual machine" in controller.step(0.0, estimate, HERE, None).text
    assert controller.step(0.02, estimate, HERE, None).text == ""
