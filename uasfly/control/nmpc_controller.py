"""The controller: NMPC by real-time iteration, delay predicted, wind force compensated, and a net below it."""

from __future__ import annotations

import math

import numpy as np

from uasfly.airframe import Airframe
from uasfly.control.authority import holdable_force, nearby
from uasfly.control.backup import PositionPid
from uasfly.control.delay import LONGEST_PREDICTION_S, DelayPredictor, inputs_of, state_of
from uasfly.control.iteration import RealTimeIteration
from uasfly.control.parts import Attitude, SetpointGuard
from uasfly.control.problem import problem_from_airframe
from uasfly.control.protocol import ControlResult, ReferenceAt, Timer
from uasfly.control.qp import SolveStatus
from uasfly.control.thrust_map import ThrustMap
from uasfly.control.yaw import YawController
from uasfly.frames import wrap_angle
from uasfly.messages import Array, ReferenceHorizon, Setpoint, StateEstimate
from uasfly.model import controller_parameters

DEADLINE_SHARE = 0.8  # of a control period: a solve that takes longer is late
LONGEST_PLAN_AGE_S = 0.5  # the plan flies open loop for so long, then the backup PIDs take over

_REASONS = {
    SolveStatus.CONVERGED: "the solve came too late",
    SolveStatus.INEXACT: "the solve came too late",
    SolveStatus.FAILED: "the solve failed",
    SolveStatus.BAD_INPUT: "estimate or reference is not finite",
}


class NmpcController:
    """Kalaitzakis 2023, eq. 10, each cycle: predict to when the command acts, solve, send the first input.

    A solve that fails, or takes longer than `deadline_s`, is replaced by the inputs that the last plan holds for the
    time at which the command acts; a plan older than 0.5 s by the backup PIDs, whose integral starts from the force
    estimate.

    Args:
        airframe: model, limits, weights and gains.
        timer: clock in seconds that measures the solver; without one nothing is measured and nothing is ever late.
        backend: "auto", "c" or "vm", see `iteration.make_backend`.
        deadline_s: a solve that took longer counts as late; by default 80 % of a control period.
    """

    def __init__(
        self,
        airframe: Airframe,
        timer: Timer | None = None,
        backend: str = "auto",
        deadline_s: float | None = None,
    ) -> None:
        self._airframe = airframe
        self._timer = timer
        self._deadline_s = DEADLINE_SHARE / airframe.controller.rate_hz if deadline_s is None else deadline_s
        self.solver = RealTimeIteration(problem_from_airframe(airframe), backend)
        self._times = self.solver.problem.grid.time_s
        self._delay = DelayPredictor(airframe.model)
        self._yaw = YawController(airframe.yaw_pid, airframe.limits.yaw_rate_rad_s)
        self._backup = PositionPid(airframe.backup, airframe.model, airframe.limits)
        self._thrust_map = ThrustMap(airframe)
        self._guard = SetpointGuard(airframe.limits, airframe.model.hover_thrust)
        self._counts = {"plan": 0, "backup": 0}
        self._fallback = ""
        self._time_s: float | None = None
        self._force = np.zeros(3)
        self._commanded: Array | None = None  # thrust, roll and pitch that act until the next setpoint does
        self._announcement = self.solver.announcement

    @property
    def fallback_steps(self) -> dict[str, int]:
        """See `Controller.fallback_steps`."""
        return dict(self._counts)

    def k_thrust_m_s2(self, battery_voltage_v: float | None) -> float:
        """See `Controller.k_thrust_m_s2`."""
        return self._thrust_map.k_thrust_m_s2(battery_voltage_v)

    def trim_thrust(self, trim: float) -> float:
        """See `Controller.trim_thrust`."""
        self._thrust_map.trim = trim
        return trim

    def reset(self, time_s: float, setpoint: Setpoint | None) -> None:  # noqa: ARG002 - the protocol's signature
        """Take over: the prediction starts from `setpoint` acting, the yaw setpoint from its yaw, the plan anew."""
        self.solver.drop_plan()
        self._delay.reset(setpoint)
        self._yaw.reset(None if setpoint is None else setpoint.yaw_rad)
        self._backup.reset()
        self._fallback, self._time_s = "", None
        self._commanded = None if setpoint is None else np.array(inputs_of(setpoint))

    def step(
        self, time_s: float, estimate: StateEstimate, reference_at: ReferenceAt, battery_voltage_v: float | None
    ) -> ControlResult:
        """One cycle, see `Controller.step`."""
        acts_s = time_s + self._airframe.model.command_delay_s
        k_thrust = self._thrust_map.update(time_s, battery_voltage_v)
        reference = reference_at(acts_s + self._times)
        attitude = Attitude.of(estimate)
        ahead_s = min(max(acts_s - estimate.time_s, 0.0), LONGEST_PREDICTION_S)
        status, solve_s = self._solve(estimate, attitude, reference, k_thrust, acts_s)
        yaw, yaw_rate = self._yaw.step(
            time_s,
            attitude.yaw_rad + attitude.yaw_rate_rad_s * ahead_s,
            attitude.yaw_rate_rad_s,
            float(reference.yaw_rad[0]),
            float(reference.yaw_rate_rad_s[0]),
        )
        inputs, fallback = self._choose(status, solve_s, acts_s)
        elapsed = 0.0 if self._time_s is None else time_s - self._time_s
        self._time_s = time_s
        if inputs is None:
            heading = attitude.yaw_rad if math.isfinite(attitude.yaw_rad) else yaw
            inputs = self._fly_backup(elapsed, estimate, reference, heading, k_thrust)
        text = self._announce(fallback, status)
        setpoint = self._guard.setpoint(time_s, inputs, yaw, yaw_rate)
        self._delay.sent(setpoint)
        self._commanded = np.array(inputs_of(setpoint))
        planned = fallback != "backup"
        return ControlResult(
            setpoint=setpoint,
            fallback=fallback,
            solve_ms=1e3 * solve_s,
            status=int(status),
            predicted_positions=self.solver.workspace.states[:, :3].copy() if planned else None,
            text=text,
        )

    def _solve(
        self, estimate: StateEstimate, attitude: Attitude, reference: ReferenceHorizon, k_thrust: float, acts_s: float
    ) -> tuple[SolveStatus, float]:
        """Fill the solver's data and solve; status and the seconds it took."""
        force, work, reference_yaw = estimate.force_in_world, self.solver.workspace, float(reference.yaw_rad[0])
        state = state_of(estimate.position_in_world, estimate.velocity_in_world, attitude.roll_rad, attitude.pitch_rad)
        yaws = attitude.yaw_rad + attitude.yaw_rate_rad_s + reference_yaw
        if not math.isfinite(sum(state.tolist()) + sum(force.tolist()) + yaws):
            return SolveStatus.BAD_INPUT, 0.0
        self._force = force
        force = holdable_force(force, self._airframe.limits, k_thrust)
        parameters = controller_parameters(self._airframe.model, force, k_thrust)
        work.initial[:], yaw_rad = self._delay.predict(
            state, attitude.yaw_rad, attitude.yaw_rate_rad_s, parameters, estimate.time_s, acts_s
        )
        error = wrap_angle(reference_yaw - yaw_rad)
        np.subtract(reference.yaw_rad, self._yaw.remaining_error(error, self._times), out=work.yaw)
        work.parameters[:], work.force[:] = parameters, force
        work.position[:] = nearby(reference.position_in_world, work.initial[:3])
        work.velocity[:] = reference.velocity_in_world
        work.acceleration[:] = reference.acceleration_in_world
        if self._timer is None:
            return self.solver.solve(acts_s, before=self._commanded), 0.0
        started = self._timer()
        status = self.solver.solve(acts_s, before=self._commanded)
        return status, self._timer() - started

    def _choose(self, status: SolveStatus, solve_s: float, acts_s: float) -> tuple[Array | None, str]:
        """Inputs (3,) of the plan and the name of the fallback; None for the inputs where the PIDs must fly."""
        solved = status in (SolveStatus.CONVERGED, SolveStatus.INEXACT)
        if solved and solve_s <= self._deadline_s:
            return self.solver.workspace.inputs[0], ""
        if solved:
            # Late, but the freshest plan there is: take from it what it holds for when the command really acts.
            acts_s += min(solve_s, LONGEST_PLAN_AGE_S)
        start = self.solver.plan_start_s
        inputs = self.solver.planned_inputs(acts_s)
        if inputs is None or start is None or acts_s - start > LONGEST_PLAN_AGE_S + 1e-9:
            return None, "backup"
        return inputs, "plan"

    def _fly_backup(
        self, elapsed_s: float, estimate: StateEstimate, reference: ReferenceHorizon, yaw_rad: float, k_thrust: float
    ) -> Array:
        if self._fallback != "backup":
            self._backup.reset(-self._force)
        return self._backup.step(
            elapsed_s,
            reference.position_in_world[0] - estimate.position_in_world,
            reference.velocity_in_world[0] - estimate.velocity_in_world,
            estimate.velocity_in_world,
            reference.acceleration_in_world[0],
            yaw_rad,
            k_thrust,
        )

    def _announce(self, fallback: str, status: SolveStatus) -> str:
        """Count the fallback; a text when it begins, changes or ends."""
        before, self._fallback = self._fallback, fallback
        text, self._announcement = self._announcement, ""
        if fallback:
            self._counts[fallback] += 1
        if fallback == before:
            return text
        if not fallback:
            return "the solver flies again"
        flies = "the last plan flies on" if fallback == "plan" else "the backup PIDs fly"
        return f"{_REASONS[status]}: {flies}"
