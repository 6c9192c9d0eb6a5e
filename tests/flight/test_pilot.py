"""The step as a whole, with a scripted vehicle, an observer that knows, and a controller that only listens."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from tests.observer.airframes import f550
from uasfly.control.protocol import ControlResult, ReferenceAt
from uasfly.flight.choices import Engage
from uasfly.flight.pilot import Pilot, StepResult
from uasfly.frames import quaternion_from_euler
from uasfly.messages import (
    Array,
    AttitudeTargetSample,
    FlightMode,
    OdometrySample,
    Phase,
    ReferenceHorizon,
    Request,
    RequestKind,
    RequestResult,
    Sample,
    Setpoint,
    StateEstimate,
    VehicleSample,
)
from uasfly.mission import Mission
from uasfly.observer.diagnosis import Diagnosis

PERIOD_S = 0.02
ZERO = np.zeros(3)
GROUND = np.array([4.0, -3.0, 0.7])
AIRBORNE = np.array([0.1, -0.05, 1.4])  # where the take-off leads to
GOAL = np.array([2.0, 0.0, 1.5])  # of the mission
HORIZON_S = np.arange(0.0, 3.0, 0.05)


def _mission(**changes: Any) -> Mission:
    fields: dict[str, Any] = {
        "name": "there",
        "takeoff": {"height_m": 1.5},
        "legs": [
            {"type": "line", "to_m": [2.0, 0.0, 1.5], "speed_m_s": 1.0},
            {"type": "hover", "position_m": [2.0, 0.0, 1.5], "duration_s": 2.0},
        ],
        "limits": {"geofence": {"radius_m": 6.0}, "altitude_max_m": 5.0},
        "yaw": {"rule": "fixed", "yaw_deg": 0.0},
    }
    return Mission.model_validate({**fields, **changes})


class FakeObserver:
    """Knows exactly where the scripted vehicle is, and remembers what it was told; no rotor tells its speed."""

    carried = False
    rotor_ratio: float | None = None
    rotor_excess_m_s2 = 0.0

    def __init__(self) -> None:
        self.position = GROUND.copy()
        self.velocity = ZERO
        self.yaw_rad = 0.0
        self.blind = False
        self.added: list[Sample] = []
        self.told: list[tuple[Setpoint, bool]] = []

    def add(self, sample: Sample) -> None:
        """Remember a sample."""
        self.added.append(sample)

    def sent(self, setpoint: Setpoint, in_offboard: bool) -> None:
        """Remember a setpoint."""
        self.told.append((setpoint, in_offboard))

    def set_k_thrust(self, k_thrust_m_s2: float) -> None:
        """Check what the filter would divide by."""
        assert k_thrust_m_s2 > 0.0

    def correct_thrust(self, commands: float, rotors: float = 1.0) -> None:
        """Check what the filter would multiply by."""
        assert commands > 0.0
        assert rotors == 1.0

    def take_moved(self) -> list[tuple[int, float]]:
        """Nothing moves."""
        return []

    def diagnose(self, time_s: float, window_s: float) -> Diagnosis:
        """All is well."""
        return Diagnosis(np.full(3, 0.01), np.full(3, 0.01), {}, {}, 0.0, -math.inf, 0.0, True, 0.0, 0)

    def estimate(self, time_s: float) -> StateEstimate | None:
        """The truth."""
        if self.blind:
            return None
        quaternion, sigma = quaternion_from_euler(0.0, 0.0, self.yaw_rad), np.full(3, 0.01)
        position, velocity = self.position.copy(), self.velocity
        return StateEstimate(time_s, position, velocity, quaternion, ZERO, ZERO, ZERO, sigma, sigma, sigma)


@dataclass
class FakeController:
    """Remembers references and resets; its setpoint holds still."""

    resets: list[tuple[float, Setpoint | None]] = field(default_factory=list)
    references: list[ReferenceHorizon] = field(default_factory=list)
    text: str = ""
    fallback: str = ""

    @property
    def fallback_steps(self) -> dict[str, int]:
        """None."""
        return {}

    def k_thrust_m_s2(self, battery_voltage_v: float | None) -> float:
        """Any."""
        return 28.5

    def trim_thrust(self, trim: float) -> float:
        """Take none."""
        return 0.0

    def reset(self, time_s: float, setpoint: Setpoint | None) -> None:
        """Remember."""
        self.resets.append((time_s, setpoint))

    def step(
        self, time_s: float, estimate: StateEstimate, reference_at: ReferenceAt, battery_voltage_v: float | None
    ) -> ControlResult:
        """Look at the reference; hold still."""
        self.references.append(reference_at(time_s + HORIZON_S))
        setpoint = Setpoint(time_s, 0.0, 0.0, 0.0, 0.0, 0.35)
        return ControlResult(setpoint, self.fallback, 0.1, 0, None, self.text)


class Flight:
    """A pilot and a vehicle that does as it is asked and follows the reference exactly."""

    def __init__(
        self, mission: Mission | None = None, engage: Engage = Engage.AUTO, observer: FakeObserver | None = None
    ) -> None:
        self.observer = observer or FakeObserver()
        self.controller = FakeController()
        self.pilot = Pilot(f550(), mission or _mission(), self.observer, self.controller, engage)  # type: ignore[arg-type]
        self.time_s = 50.0
        self.mode, self.armed, self.in_air = FlightMode.HOLD, False, False
        self.target: AttitudeTargetSample | None = None
        self.silent = False
        self.follows = True
        self.asked: list[RequestKind] = []
        self.texts: list[str] = []
        self.steps: list[StepResult] = []
        self._queue: list[Sample] = []

    @property
    def phase(self) -> Phase:
        """Where the flight is."""
        return self.pilot.sequencer.phase

    def step(self) -> StepResult:
        """One cycle."""
        self.time_s += PERIOD_S
        samples, self._queue = self._queue, []
        if not self.silent:
            samples.append(VehicleSample(self.time_s, self.mode, self.armed, self.in_air))
            samples.append(OdometrySample(self.time_s, ZERO, ZERO, np.array([1.0, 0, 0, 0]), ZERO))
        if self.target is not None:
            samples.append(self.target)
        result = self.pilot.step(self.time_s, tuple(samples))
        self.steps.append(result)
        self.texts += [text for _, text in result.status.announcements]
        for request in result.requests:
            self._obey(request)
        reference = result.status.reference_position_in_world
        if self.follows and reference is not None:
            self.observer.position = reference.copy()
        return result

    def until(self, phase: Phase) -> StepResult:
        """Cycle until a phase has begun."""
        for _ in range(3000):
            result = self.step()
            if self.phase is phase:
                return result
        raise AssertionError(f"never came to {phase}, but is in {self.phase}: {self.pilot.sequencer.reason}")

    def run(self, seconds: float) -> None:
        """Let cycles pass."""
        for _ in range(round(seconds / PERIOD_S)):
            self.step()

    def _obey(self, request: Request) -> None:
        self.asked.append(request.kind)
        self._queue.append(RequestResult(self.time_s, request, accepted=True))
        match request.kind:
            case RequestKind.ARM:
                self.armed = True
            case RequestKind.TAKEOFF:
                self.in_air = True
                self.observer.position = GROUND + AIRBORNE
            case RequestKind.OFFBOARD:
                self.mode = FlightMode.OFFBOARD
            case RequestKind.HOLD:
                self.mode = FlightMode.HOLD
            case _:
                self.mode, self.armed, self.in_air = FlightMode.LAND, False, False


def _jumps(flight: Flight) -> float:
    """Largest distance between the reference's first points of two following steps [m]."""
    points = np.array([reference.position_in_world[0] for reference in flight.controller.references])
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).max())


def test_setpoints_leave_while_uasfly_engages_and_flies_and_not_otherwise() -> None:
    """A whole flight: none on the ground, none in PX4's take-off and landing, one a cycle in between."""
    flight = Flight()
    flight.until(Phase.DONE)
    streamed: dict[Phase, list[bool]] = {}
    for result in flight.steps:
        streamed.setdefault(result.status.phase, []).append(result.setpoint is not None)
    for phase in (Phase.PREFLIGHT, Phase.TAKEOFF, Phase.DONE):
        assert not any(streamed[phase]), phase
    assert all(streamed[Phase.ENGAGE][1:])
    assert all(streamed[Phase.LEGS])
    assert flight.asked == [RequestKind.ARM, RequestKind.TAKEOFF, RequestKind.OFFBOARD, RequestKind.LAND]
    assert flight.pilot.done


def test_the_observer_hears_every_sample_and_every_setpoint_with_whether_it_acts() -> None:
    """In engage PX4 flies by itself, so setpoints do not drive the model yet; in the legs they do."""
    flight = Flight()
    flight.until(Phase.LEGS)
    assert flight.observer.told
    assert not any(acts for _, acts in flight.observer.told[:-1])
    before = len(flight.observer.told)
    flight.run(1.0)
    assert all(acts for _, acts in flight.observer.told[before:])
    assert [setpoint for setpoint, _ in flight.observer.told] == [r.setpoint for r in flight.steps if r.setpoint]
    assert sum(isinstance(sample, OdometrySample) for sample in flight.observer.added) == len(flight.steps)


def test_the_mission_starts_from_the_ground_at_the_take_off_point() -> None:
    """Points of the mission count from where the vehicle stood, at whatever height PX4 thinks that is."""
    flight = Flight()
    flight.until(Phase.ENDING)
    np.testing.assert_allclose(flight.observer.position, GROUND + GOAL, atol=1e-6)


def test_a_local_mission_starts_from_px4s_origin() -> None:
    """The frame `local` does not move with the take-off point."""
    flight = Flight(_mission(frame="local", limits={"geofence": {"radius_m": 20.0}}))
    flight.until(Phase.ENDING)
    np.testing.assert_allclose(flight.observer.position, [2.0, 0.0, 1.5], atol=1e-6)


def test_a_vehicle_met_in_the_air_takes_the_ground_below_it() -> None:
    """Where it stood is not known: the origin is below it, at PX4's height zero."""
    flight = Flight()
    flight.armed = flight.in_air = True
    flight.observer.position = np.array([4.0, -3.0, 2.0])
    flight.until(Phase.ENDING)
    np.testing.assert_allclose(flight.observer.position, [6.0, -3.0, 1.5], atol=1e-6)


def test_the_reference_is_continuous_from_hold_to_the_last_leg() -> None:
    """No jump at the hand-over: first it holds where the vehicle is, then it moves off from rest."""
    flight = Flight()
    flight.until(Phase.LEGS)
    held = flight.controller.references[0]
    np.testing.assert_allclose(held.position_in_world, np.tile(GROUND + AIRBORNE, (len(HORIZON_S), 1)))
    first = flight.controller.references[-1]
    np.testing.assert_allclose(first.position_in_world[0], held.position_in_world[0], atol=1e-9)
    np.testing.assert_allclose(first.velocity_in_world[0], ZERO, atol=1e-9)
    flight.until(Phase.ENDING)
    assert _jumps(flight) <= 1.0 * PERIOD_S + 1e-6  # never faster than the mission's 1 m/s


def test_the_hand_over_is_bumpless() -> None:
    """Until offboard, what PX4 is being told is streamed back to it; then the controller starts from just that."""
    flight = Flight()
    flight.until(Phase.TAKEOFF)
    echoed = []
    for _ in range(3000):
        quaternion = quaternion_from_euler(0.05, -0.03, 0.4)
        flight.target = AttitudeTargetSample(flight.time_s, quaternion, 0.41)
        result = flight.step()
        if result.status.phase is Phase.LEGS:
            break
        if result.setpoint is not None:
            echoed.append(result.setpoint)
    assert flight.phase is Phase.LEGS
    ((_, taken),) = flight.controller.resets
    assert taken is not None
    assert len(echoed) > 20
    for setpoint in (*echoed, taken):
        assert (setpoint.roll_rad, setpoint.pitch_rad, setpoint.yaw_rad) == pytest.approx((0.05, -0.03, 0.4))
        assert setpoint.thrust == 0.41


def test_a_target_beyond_the_limits_is_not_echoed() -> None:
    """What is streamed back stays inside the airframe's limits, even if PX4's own modes lean farther."""
    flight = Flight()
    flight.until(Phase.TAKEOFF)
    for _ in range(3000):
        flight.target = AttitudeTargetSample(flight.time_s, quaternion_from_euler(0.9, -0.9, 0.0), 1.0)
        result = flight.step()
        if result.status.phase is Phase.LEGS:
            break
        if result.setpoint is not None:
            limits = flight.pilot.airframe.limits
            assert abs(result.setpoint.roll_rad) <= limits.tilt_rad
            assert abs(result.setpoint.pitch_rad) <= limits.tilt_rad
            assert result.setpoint.thrust <= limits.thrust_max
    assert flight.phase is Phase.LEGS


def test_an_old_attitude_target_is_not_taken_for_the_present_one() -> None:
    """A stream of targets that ended a while ago says nothing about now."""
    flight = Flight()
    flight.target = AttitudeTargetSample(50.0, quaternion_from_euler(0.3, 0.0, 0.0), 0.9)
    flight.until(Phase.LEGS)
    assert {taken for _, taken in flight.controller.resets} == {None}


def test_the_controller_starts_anew_after_a_pause_of_the_stream() -> None:
    """What it planned before the telemetry was lost is not what the vehicle has been doing since."""
    flight = Flight()
    flight.until(Phase.LEGS)
    before = len(flight.controller.resets)
    flight.silent = True
    flight.run(1.0)
    assert flight.steps[-1].setpoint is None
    flight.silent = False
    flight.run(0.1)
    assert flight.steps[-1].setpoint is not None
    assert len(flight.controller.resets) == before + 1


def test_without_an_estimate_nothing_leaves() -> None:
    """The stream stops with the estimate, and the step goes on."""
    flight = Flight()
    flight.until(Phase.LEGS)
    flight.observer.blind = True
    assert flight.step().setpoint is None
    flight.observer.blind = False
    assert flight.step().setpoint is not None


def test_a_mission_that_cannot_be_flown_from_here_ends_before_offboard() -> None:
    """A first leg too far for its time, known in flight only: the vehicle holds and lands, and the reason names it."""
    legs = [{"type": "waypoints", "points": [{"position_m": [0, 0, 1.5]}, {"position_m": [9e3, 0, 1.5]}]}]
    flight = Flight(_mission(legs=legs, limits={}))
    flight.until(Phase.ABORTED)
    assert RequestKind.OFFBOARD not in flight.asked
    assert flight.asked[-2:] == [RequestKind.HOLD, RequestKind.LAND]
    assert "cannot be flown from here: legs[0]" in flight.pilot.sequencer.reason


def test_a_pilot_who_waits_for_his_own_switch_is_not_commanded_to_land() -> None:
    """The same mission with the pilot flying: aborted, and nothing is asked of his vehicle."""
    legs = [{"type": "waypoints", "points": [{"position_m": [0, 0, 1.5]}, {"position_m": [9e3, 0, 1.5]}]}]
    flight = Flight(_mission(legs=legs, limits={}), Engage.PILOT)
    flight.armed = flight.in_air = True
    flight.until(Phase.ABORTED)
    assert flight.asked == []


def test_the_mission_begins_where_the_pilot_switches_to_offboard() -> None:
    """The pilot takes off, flies away and turns for a while, then switches: the reference begins there, at rest."""
    flight = Flight(engage=Engage.PILOT)
    flight.run(3.0)
    flight.armed = flight.in_air = True
    flight.mode = FlightMode.POSITION
    for k in range(200):
        flight.observer.position = GROUND + np.array([0.02 * k, 0.0, 0.3 + 0.01 * k])
        flight.observer.yaw_rad = 0.005 * k
        flight.step()
    assert {result.status.phase for result in flight.steps[:100]} == {Phase.PREFLIGHT}
    assert flight.phase is Phase.ENGAGE
    flight.mode = FlightMode.OFFBOARD
    flight.until(Phase.LEGS)
    first = flight.controller.references[-1]
    np.testing.assert_allclose(first.position_in_world[0], flight.observer.position, atol=0.2)
    assert float(first.yaw_rad[0]) == pytest.approx(flight.observer.yaw_rad, abs=math.radians(10.0))
    np.testing.assert_allclose(first.velocity_in_world[0], ZERO, atol=1e-9)
    flight.until(Phase.ENDING)
    np.testing.assert_allclose(flight.observer.position, GROUND + GOAL, atol=1e-6)


def test_an_interrupted_flight_holds_where_it_is_until_px4_does() -> None:
    """Announced is holding: the reference stops at the vehicle instead of flying the mission on."""
    flight = Flight()
    flight.until(Phase.LEGS)
    flight.run(2.0)
    here = flight.observer.position.copy()
    flight.pilot.interrupt(flight.time_s, "stopped by Ctrl-C")
    flight.step()
    reference = flight.controller.references[-1]
    np.testing.assert_allclose(reference.position_in_world, np.tile(here, (len(HORIZON_S), 1)))
    assert flight.asked[-1] is RequestKind.HOLD


def test_a_breach_of_the_fence_holds_and_lands() -> None:
    """Blown out of the fence for half a second: the reference stays where the vehicle is, the reason says how far."""
    flight = Flight()
    flight.until(Phase.LEGS)
    flight.follows = False
    flight.observer.position = outside = GROUND + np.array([8.0, 0.0, 1.5])
    flight.until(Phase.ENDING)
    np.testing.assert_allclose(flight.controller.references[-1].position_in_world[0], outside)
    flight.until(Phase.ABORTED)
    assert "outside the geofence: 8.0 m" in flight.pilot.sequencer.reason
    assert flight.asked[-2:] == [RequestKind.HOLD, RequestKind.LAND]


def test_what_the_controller_says_is_announced_once_each_time_it_says_it() -> None:
    """Texts of controller, driver and phases come with the next status, and the name of a fallback with its step."""
    flight = Flight()
    flight.until(Phase.LEGS)
    flight.pilot.announce(3, "the log stopped")
    flight.controller.text, flight.controller.fallback = "the last plan flies on", "plan"
    status = flight.step().status
    assert status.announcements == ((3, "the log stopped"), (4, "the last plan flies on"))
    assert status.fallback == "plan"
    flight.controller.text = flight.controller.fallback = ""
    status = flight.step().status
    assert (status.announcements, status.fallback) == ((), "")


def test_status_tells_leg_and_progress() -> None:
    """The way to the first leg does not count; then leg and progress grow to the end."""
    flight = Flight(_mission(legs=[{"type": "hover", "position_m": [1.0, 0.0, 1.5], "duration_s": 2.0}] * 2))
    flight.until(Phase.DONE)
    legs = [result.status for result in flight.steps if result.status.phase is Phase.LEGS]
    assert (legs[0].leg, legs[0].leg_started) == (-1, False)
    assert sorted({status.leg for status in legs}) == [-1, 0, 1]
    started = [status.leg_started for status in legs]
    assert started == sorted(started)
    progress = [status.progress for status in legs]
    assert progress == sorted(progress)
    assert 0.0 <= progress[0] < 0.02
    assert 0.98 < progress[-1] <= 1.0
    assert flight.steps[-1].status.progress == 1.0
    others = [result.status for result in flight.steps if result.status.phase is not Phase.LEGS]
    assert {status.reference_position_in_world is None for status in others} == {True}
    assert {status.leg for status in others} == {-1}


def test_leaving_ends_the_flight_at_once() -> None:
    """A broken driver stops the stream in that moment and is told to ask for hold."""
    flight = Flight()
    flight.until(Phase.LEGS)
    flight.pilot.leave(flight.time_s, "internal error")
    result = flight.step()
    assert flight.pilot.done
    assert result.setpoint is None
    assert result.status.reason == "internal error"
    assert flight.pilot.sequencer.hand_over


def test_the_same_samples_give_the_same_answers() -> None:
    """Nothing but its arguments enters the step."""
    once, twice = Flight(), Flight()
    once.until(Phase.DONE)
    twice.until(Phase.DONE)
    assert [result.setpoint for result in once.steps] == [result.setpoint for result in twice.steps]
    first: list[Array] = [r.position_in_world for r in once.controller.references]
    second: list[Array] = [r.position_in_world for r in twice.controller.references]
    np.testing.assert_array_equal(first, second)
