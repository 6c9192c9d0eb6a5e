"""The baseline: the backup PIDs of Kalaitzakis 2023 as the only controller (`--controller pid`)."""

from __future__ import annotations

import numpy as np

from uasfly.airframe import Airframe, Backup
from uasfly.control.backup import PositionPid
from uasfly.control.delay import inputs_of
from uasfly.control.parts import Attitude, SetpointGuard, all_finite
from uasfly.control.protocol import ControlResult, ReferenceAt, Timer
from uasfly.control.qp import SolveStatus
from uasfly.control.thrust_map import ThrustMap
from uasfly.control.yaw import YawController
from uasfly.messages import Array, Setpoint, StateEstimate


class PidController:
    """Position PIDs, yaw PID and thrust map; needs no model of the wind and uses none of its estimate.

    Args:
        airframe: model, limits and gains.
        timer: clock in seconds that measures the step; without one nothing is measured.
        gains: of the position PIDs; by default the airframe file's backup.
    """

    def __init__(self, airframe: Airframe, timer: Timer | None = None, gains: Backup | None = None) -> None:
        self._timer = timer
        self._pid = PositionPid(airframe.backup if gains is None else gains, airframe.model, airframe.limits)
        self._yaw = YawController(airframe.yaw_pid, airframe.limits.yaw_rate_rad_s)
        self._thrust_map = ThrustMap(airframe)
        self._guard = SetpointGuard(airframe.limits, airframe.model.hover_thrust)
        self._taken_over: Setpoint | None = None
        self._time_s: float | None = None
        self._blind = False
        self._blind_steps = 0

    @property
    def fallback_steps(self) -> dict[str, int]:
        """Steps flown without a usable estimate."""
        return {"plan": 0, "backup": self._blind_steps}

    def k_thrust_m_s2(self, battery_voltage_v: float | None) -> float:
        """See `Controller.k_thrust_m_s2`."""
        return self._thrust_map.k_thrust_m_s2(battery_voltage_v)

    def trim_thrust(self, trim: float) -> float:  # noqa: ARG002 - the protocol's signature
        """None: the integral is the trim, and the gains stay what the file says."""
        return 0.0

    def reset(self, time_s: float, setpoint: Setpoint | None) -> None:  # noqa: ARG002 - the protocol's signature
        """Take over; the first step chooses the integral so that it goes on with `setpoint`."""
        self._pid.reset()
        self._yaw.reset(None if setpoint is None else setpoint.yaw_rad)
        self._taken_over, self._time_s = setpoint, None

    def step(
        self, time_s: float, estimate: StateEstimate, reference_at: ReferenceAt, battery_voltage_v: float | None
    ) -> ControlResult:
        """One cycle; errors that are not finite count as zero, and the step then counts as a fallback."""
        started = self._timer() if self._timer else 0.0
        k_thrust = self._thrust_map.update(time_s, battery_voltage_v)
        reference = reference_at(np.array((time_s,)))
        attitude = Attitude.of(estimate)
        position_error = reference.position_in_world[0] - estimate.position_in_world
        velocity_error = reference.velocity_in_world[0] - estimate.velocity_in_world
        yaw, yaw_rate = self._yaw.step(
            time_s,
            attitude.yaw_rad,
            attitude.yaw_rate_rad_s,
            float(reference.yaw_rad[0]),
            float(reference.yaw_rate_rad_s[0]),
        )
        blind = not (np.isfinite(attitude.yaw_rad) and all_finite(position_error, velocity_error))
        heading = yaw if np.isnan(attitude.yaw_rad) else attitude.yaw_rad
        acceleration = self._feed_forward(time_s, estimate, reference.acceleration_in_world[0])
        if self._taken_over is not None and not blind:
            velocity = estimate.velocity_in_world
            flown = self._pid.acceleration_of(inputs_of(self._taken_over), velocity, heading)
            self._pid.reset(flown - self._pid.proportional(position_error, velocity_error, acceleration))
            self._taken_over = None
        elapsed = 0.0 if self._time_s is None else time_s - self._time_s
        self._time_s = time_s
        inputs = self._pid.step(
            elapsed, position_error, velocity_error, estimate.velocity_in_world, acceleration, heading, k_thrust
        )
        text = "the estimate is not finite: the PIDs fly on without it" if blind and not self._blind else ""
        self._blind = blind
        self._blind_steps += blind
        return ControlResult(
            setpoint=self._guard.setpoint(time_s, inputs, yaw, yaw_rate),
            fallback="backup" if blind else "",
            solve_ms=1e3 * (self._timer() - started) if self._timer else 0.0,
            status=int(SolveStatus.BAD_INPUT if blind else SolveStatus.CONVERGED),
            predicted_positions=None,
            text=text,
        )

    def _feed_forward(
        self,
        time_s: float,  # noqa: ARG002 - for those that add to it
        estimate: StateEstimate,  # noqa: ARG002
        reference_acceleration: Array,
    ) -> Array:
        """Acceleration (3,) [m/s^2, world] that is asked for beside the PIDs'."""
        return reference_acceleration
