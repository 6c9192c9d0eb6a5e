"""The pure step: measurements in, one setpoint and one status out. No sockets, clocks, files, threads or asyncio.

The same step serves the live flight, the rehearsal and the replay of a log: same input, same output, bit for bit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uasfly.airframe import Airframe
from uasfly.control.controller import Controller, ControlResult
from uasfly.flight.monitors import Monitors
from uasfly.flight.sequencer import EndingAction, Engage, Sequencer
from uasfly.flight.view import VehicleView
from uasfly.frames import euler_from_quaternion
from uasfly.messages import Array, Phase, ReferenceHorizon, Request, Sample, Setpoint, StateEstimate, Status
from uasfly.mission import Mission
from uasfly.observer.observer import Observer
from uasfly.trajectories.hold import HoldTrajectory
from uasfly.trajectories.mission_trajectory import MissionTrajectory
from uasfly.trajectories.trajectory import TrajectoryError


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
        self._origin: Array | None = None
        self._planned: MissionTrajectory | None = None  # starts where the vehicle holds while it engages
        self._trajectory: MissionTrajectory | None = None  # the planned one, once the legs fly
        self._legs_start_s = 0.0
        self._leg_started = False
        self._hold: HoldTrajectory | None = None

    @property
    def done(self) -> bool:
        """Whether the flight has ended, one way or another."""
        return self.sequencer.phase in (Phase.DONE, Phase.ABORTED)

    def interrupt(self, time_s: float, reason: str) -> None:
        """The operator wants it to end: once, hold and then the ending; twice, hand over at once."""
        self.sequencer.interrupt(time_s, reason)

    def announce(self, severity: int, text: str) -> None:
        """Have a text told with the next step's status."""
        self.sequencer.announcements.append((severity, text))

    def reference_at(self, times_s: Array) -> ReferenceHorizon:
        """Reference at absolute times (n,) [s, host], in the world frame."""
        if self._trajectory is not None:
            reference = self._trajectory.sample(times_s - self._legs_start_s)
            return ReferenceHorizon(
                times_s,
                reference.position_in_world,
                reference.velocity_in_world,
                reference.acceleration_in_world,
                reference.yaw_rad,
                reference.yaw_rate_rad_s,
            )
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

        sequencer = self.sequencer
        before = sequencer.phase
        legs_done = self._trajectory is not None and time_s - self._legs_start_s >= self._trajectory.duration_s
        requests = sequencer.step(time_s, self.view, estimate, legs_done)
        if sequencer.phase is not before:
            self._phase_changed(time_s, estimate)
        if estimate is not None and sequencer.phase is Phase.LEGS and self._origin is not None:
            breach = self.monitors.check(time_s, estimate, self._origin)
            if breach:
                sequencer.end(time_s, breach)

        setpoint, control = None, None
        if sequencer.streaming and estimate is not None:
            control = self._control(time_s, estimate)
            setpoint = control.setpoint
            self.observer.sent(setpoint, in_offboard=sequencer.in_offboard)
            if control.text:
                sequencer.announcements.append((4, control.text))
        return StepResult(setpoint, requests, self._status(time_s, estimate, control), control)

    def _control(self, time_s: float, estimate: StateEstimate) -> ControlResult:
        if self._hold is None:
            self._start_streaming(time_s, estimate)
        return self.controller.step(time_s, estimate, self.reference_at, self.view.voltage_v)

    def _start_streaming(self, time_s: float, estimate: StateEstimate) -> None:
        """Hold where the vehicle is; the first setpoint continues what the vehicle was being told."""
        _, _, yaw = euler_from_quaternion(estimate.quaternion_body_to_world)
        self._hold = HoldTrajectory(estimate.position_in_world, yaw)
        self._reset_controller(time_s)
        assert self._origin is not None
        try:
            # Some tens of milliseconds of work, so it is done now, while PX4 still flies the vehicle by itself.
            self._planned = MissionTrajectory(
                self.mission,
                self.airframe.limits,
                start_position=self._hold.position_in_world,
                start_yaw=self._hold.yaw_rad,
                takeoff_in_world=self._origin,
            )
        except TrajectoryError as error:
            self.sequencer.end(time_s, f"the mission cannot be flown from here: {error}")

    def _reset_controller(self, time_s: float) -> None:
        """Let the controller start from what the vehicle was last being told."""
        target = self.view.attitude_target
        last = None
        if target is not None:
            roll, pitch, yaw_target = euler_from_quaternion(target.quaternion_body_to_world)
            last = Setpoint(target.time_s, roll, pitch, yaw_target, 0.0, target.thrust)
        self.controller.reset(time_s, last)

    def _phase_changed(self, time_s: float, estimate: StateEstimate | None) -> None:
        phase = self.sequencer.phase
        if estimate is None:
            return
        if phase is Phase.TAKEOFF or (phase is Phase.ENGAGE and self._origin is None):
            self._origin = self._origin_of(estimate, on_ground=phase is Phase.TAKEOFF)
        elif phase is Phase.LEGS:
            self._trajectory, self._legs_start_s = self._planned, time_s
            self._reset_controller(time_s)  # until now PX4 flew: what was sent did not act, nor may it be integrated

    def _origin_of(self, estimate: StateEstimate, *, on_ground: bool) -> Array:
        if self.mission.frame == "local":
            return np.zeros(3)
        origin = estimate.position_in_world.copy()
        if not on_ground:
            origin[2] = 0.0  # already flying: PX4's local origin lies on the ground where it booted
        return origin

    def _status(self, time_s: float, estimate: StateEstimate | None, control: ControlResult | None) -> Status:
        sequencer = self.sequencer
        leg = self.leg_at(time_s)
        self._leg_started |= leg >= 0
        reference, progress = None, 0.0
        if sequencer.phase is Phase.LEGS and self._trajectory is not None:
            elapsed = time_s - self._legs_start_s
            progress = min(1.0, max(0.0, elapsed / self._trajectory.duration_s))
            reference = self._trajectory.sample(np.array([elapsed])).position_in_world[0]
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
