"""The pure step: measurements in, one setpoint and one status out. No sockets, clocks, files, threads or asyncio.

The same step serves the live flight, the rehearsal and the replay of a log: same input, same output, bit for bit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from uasfly.airframe import Airframe
from uasfly.control.controller import Controller, ControlResult
from uasfly.flight.monitors import Monitors
from uasfly.flight.sequencer import EndingAction, Engage, Sequencer
from uasfly.flight.view import VehicleView
from uasfly.frames import euler_from_quaternion, wrap_angle
from uasfly.messages import Array, Phase, ReferenceHorizon, Request, Sample, Setpoint, StateEstimate, Status
from uasfly.mission import Mission
from uasfly.observer.observer import Observer
from uasfly.trajectories.glide import Glide
from uasfly.trajectories.hold import HoldTrajectory
from uasfly.trajectories.mission_trajectory import MissionTrajectory
from uasfly.trajectories.trajectory import TrajectoryError

HOLD_RADIUS_M = 0.2  # while the vehicle engages, the point to hold at follows it beyond this distance
HOLD_YAW_RAD = math.radians(10.0)  # and beyond this turn
GLIDE_S = 2.0  # in this time the reference goes from where the vehicle is to that point
PLAN_AFTER_S = 0.2  # held for so long, the mission is planned from there
TARGET_FRESH_S = 0.5  # an older attitude target is not what the vehicle is being told


@dataclass(frozen=True, slots=True)
class StepResult:
    """What a step wants: a setpoint to send (None: send nothing), requests to the vehicle, and what it has to say."""

    setpoint: Setpoint | None
    requests: tuple[Request, ...]
    status: Status
    control: ControlResult | None


class Pilot:
    """Flies one mission: observer, controller and phases behind one call a cycle."""

    def __init__(
        self, airframe: Airframe, mission: Mission, observer: Observer, controller: Controller, engage: Engage
    ) -> None:
        self.airframe = airframe
        self.mission = mission
        self.observer = observer
        self.controller = controller
        self.view = VehicleView()
        self.sequencer = Sequencer(engage, mission.takeoff.height_m, EndingAction(mission.ending.action))
        self.monitors = Monitors(mission.limits)
        self._phase = self.sequencer.phase  # as far as this object has followed it
        self._ground: Array | None = None  # where the vehicle last stood
        self._origin: Array | None = None
        self._planned: MissionTrajectory | None = None  # starts where the vehicle holds while it engages
        self._trajectory: MissionTrajectory | None = None  # the planned one, while the legs fly
        self._legs_start_s = 0.0
        self._leg_started = False
        self._hold: HoldTrajectory | None = None
        self._hold_since_s = 0.0
        self._glide: Glide | None = None  # from where the vehicle is when the legs begin onto the planned start
        self._streamed = False

    @property
    def done(self) -> bool:
        """Whether the flight has ended, one way or another."""
        return self.sequencer.phase in (Phase.DONE, Phase.ABORTED)

    def interrupt(self, time_s: float, reason: str) -> None:
        """The operator wants it to end: once, hold and then the ending; twice, hand over at once."""
        self.sequencer.interrupt(time_s, reason)

    def leave(self, time_s: float, reason: str) -> None:
        """Something is broken: end the flight at once, see `Sequencer.leave`."""
        self.sequencer.leave(time_s, reason)

    def announce(self, severity: int, text: str) -> None:
        """Have a text told with the next step's status."""
        self.sequencer.announcements.append((severity, text))

    def reference_at(self, times_s: Array) -> ReferenceHorizon:
        """Reference at absolute times (n,) [s, host], in the world frame."""
        if self._trajectory is not None:
            reference = self._trajectory.sample(times_s - self._legs_start_s)
            absolute = replace(reference, time_s=times_s)
            return absolute if self._glide is None else self._glide.onto(absolute)
        assert self._hold is not None
        return self._hold.sample(times_s)

    def leg_at(self, time_s: float) -> int:
        """Index of the leg that the reference flies at an absolute time, -1 in transitions and outside."""
        if self._trajectory is None or self.sequencer.phase is not Phase.LEGS:
            return -1
        elapsed = time_s - self._legs_start_s
        return self._trajectory.leg_at(elapsed) if self._trajectory.in_leg(elapsed) else -1

    def step(self, time_s: float, samples: tuple[Sample, ...]) -> StepResult:
        """One control cycle.

        Args:
            time_s: now, host time [s].
            samples: what has arrived since the last cycle.
        """
        self.view.update(samples)
        for sample in samples:
            self.observer.add(sample)
        self.observer.set_k_thrust(self.controller.k_thrust_m_s2(self.view.voltage_v))
        estimate = self.observer.estimate(time_s)

        if estimate is not None and not (self.view.armed or self.view.in_air):
            self._ground = estimate.position_in_world

        sequencer = self.sequencer
        legs_done = self._trajectory is not None and time_s - self._legs_start_s >= self._trajectory.duration_s
        requests = sequencer.step(time_s, self.view, estimate, legs_done)
        setpoint, control = None, None
        if estimate is not None:
            self._follow_phase(time_s, estimate, legs_done)
            if sequencer.phase is Phase.LEGS and self._origin is not None:
                breach = self.monitors.check(time_s, estimate, self._origin)
                if breach:
                    sequencer.end(time_s, breach)
                    self._follow_phase(time_s, estimate, legs_done)
        if sequencer.streaming and estimate is not None:
            setpoint = None if sequencer.in_offboard else self._echo(time_s)
            if setpoint is None:
                if not self._streamed:
                    self._reset_controller(time_s)
                control = self.controller.step(time_s, estimate, self.reference_at, self.view.voltage_v)
                setpoint = control.setpoint
                if control.text:
                    sequencer.announcements.append((4, control.text))
            self.observer.sent(setpoint, in_offboard=sequencer.in_offboard)
        self._streamed = setpoint is not None
        return StepResult(setpoint, requests, self._status(time_s, estimate, control), control)

    def _follow_phase(self, time_s: float, estimate: StateEstimate, legs_done: bool) -> None:
        """Reference and origin for the phase that the flight is in now."""
        before, self._phase = self._phase, self.sequencer.phase
        changed = before is not self._phase
        if changed and self._phase is Phase.TAKEOFF:
            self._origin = self._origin_of(estimate)
        elif self._phase is Phase.ENGAGE:
            if changed:
                self._hold = self._planned = None
                self._origin = self._origin if before is Phase.TAKEOFF else self._origin_of(estimate)
            self._hold_and_plan(time_s, estimate)
        elif changed and self._phase is Phase.LEGS:
            self._start_legs(time_s, estimate)
        elif changed and self._phase is Phase.ENDING and not legs_done:
            self._trajectory = None
            self._hold_here(time_s, estimate)  # what has been announced; the reference would fly on

    def _hold_and_plan(self, time_s: float, estimate: StateEstimate) -> None:
        """Keep the point to hold at where the vehicle is; the mission begins there, wherever the pilot has flown to."""
        if self._hold is None or self._strayed(self._hold, estimate):
            self._hold_here(time_s, estimate)
            self._planned = None
        if self._planned is None and time_s - self._hold_since_s >= PLAN_AFTER_S:
            self._plan(time_s)  # some tens of milliseconds of work, done while PX4 still flies the vehicle by itself

    def _strayed(self, hold: HoldTrajectory, estimate: StateEstimate) -> bool:
        way = estimate.position_in_world - hold.position_in_world
        _, _, yaw = euler_from_quaternion(estimate.quaternion_body_to_world)
        return float(way @ way) > HOLD_RADIUS_M**2 or abs(wrap_angle(yaw - hold.yaw_rad)) > HOLD_YAW_RAD

    def _hold_here(self, time_s: float, estimate: StateEstimate) -> None:
        _, _, yaw = euler_from_quaternion(estimate.quaternion_body_to_world)
        self._hold, self._hold_since_s = HoldTrajectory(estimate.position_in_world, yaw), time_s

    def _plan(self, time_s: float) -> None:
        assert self._hold is not None
        assert self._origin is not None
        try:
            self._planned = MissionTrajectory(
                self.mission,
                self.airframe.limits,
                start_position=self._hold.position_in_world,
                start_yaw=self._hold.yaw_rad,
                takeoff_in_world=self._origin,
            )
        except TrajectoryError as error:
            self.sequencer.end(time_s, f"the mission cannot be flown from here: {error}")

    def _start_legs(self, time_s: float, estimate: StateEstimate) -> None:
        """From now on the reference moves; until now PX4 flew, so the controller starts anew from what it was told."""
        if self._hold is None or self._strayed(self._hold, estimate):
            self._hold_here(time_s, estimate)
            self._planned = None
        if self._planned is None:
            self._plan(time_s)
        self._trajectory, self._legs_start_s = self._planned, time_s
        assert self._hold is not None
        _, _, yaw = euler_from_quaternion(estimate.quaternion_body_to_world)
        offset = estimate.position_in_world - self._hold.position_in_world
        self._glide = Glide(offset, wrap_angle(yaw - self._hold.yaw_rad), time_s, GLIDE_S)
        self._reset_controller(time_s)

    def _reset_controller(self, time_s: float) -> None:
        """Let the controller start from what the vehicle was last being told."""
        self.controller.reset(time_s, self._told(time_s))

    def _told(self, time_s: float) -> Setpoint | None:
        """What PX4's attitude controller is being asked for, None where that is not known freshly."""
        target = self.view.attitude_target
        if target is None or abs(time_s - target.time_s) > TARGET_FRESH_S:
            return None
        roll, pitch, yaw = euler_from_quaternion(target.quaternion_body_to_world)
        if not math.isfinite(roll + pitch + yaw + target.thrust):
            return None
        return Setpoint(target.time_s, roll, pitch, yaw, 0.0, target.thrust)

    def _echo(self, time_s: float) -> Setpoint | None:
        """Until PX4 is in offboard: what it is being told anyway, within the limits, so that the switch is no bump."""
        told = self._told(time_s)
        if told is None:
            return None
        limits = self.airframe.limits
        return replace(
            told,
            time_s=time_s,
            roll_rad=min(max(told.roll_rad, -limits.tilt_rad), limits.tilt_rad),
            pitch_rad=min(max(told.pitch_rad, -limits.tilt_rad), limits.tilt_rad),
            thrust=min(max(told.thrust, limits.thrust_min), limits.thrust_max),
        )

    def _origin_of(self, estimate: StateEstimate) -> Array:
        if self.mission.frame == "local":
            return np.zeros(3)
        if self._phase is Phase.TAKEOFF:
            return estimate.position_in_world
        if self._ground is not None:
            return self._ground
        x, y, _ = estimate.position_in_world.tolist()
        return np.array((x, y, 0.0))  # met in the air: PX4's local origin lies on the ground where it booted

    def _status(self, time_s: float, estimate: StateEstimate | None, control: ControlResult | None) -> Status:
        sequencer = self.sequencer
        leg = self.leg_at(time_s)
        self._leg_started |= leg >= 0
        reference, progress = None, 0.0
        if sequencer.phase is Phase.LEGS and self._trajectory is not None:
            elapsed = time_s - self._legs_start_s
            progress = min(1.0, max(0.0, elapsed / self._trajectory.duration_s))
            reference = self.reference_at(np.array([time_s])).position_in_world[0]
        elif sequencer.phase in (Phase.ENDING, Phase.DONE):
            progress = 1.0
        announcements = tuple(sequencer.announcements)
        sequencer.announcements.clear()
        return Status(
            time_s=time_s,
            phase=sequencer.phase,
            leg=leg,
            leg_started=self._leg_started and sequencer.phase is Phase.LEGS,
            progress=progress,
            estimate=estimate,
            reference_position_in_world=reference,
            fallback=control.fallback if control is not None else "",
            reason=sequencer.reason,
            announcements=announcements,
        )
