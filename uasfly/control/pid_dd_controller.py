"""PID, PID with double derivative, and that with wind compensation (Waslander & Wang 2009).

`--controller pid_dd` and `--controller pid_dd_wind`. The double derivative is the acceleration's error, the reference's
minus the vehicle's: wind shows in the acceleration long before it shows in the position.

Where the acceleration comes from. The paper takes the accelerometer's. In flight none of the messages carries one, and
PX4's stream of it has bias and vibration still in it; here it is the derivative of the velocity estimate, low-passed
over 50 ms. The observer's model (thrust, drag, force) would be quieter, but its force is an estimate of the wind:
`pid_dd` would then compensate the wind half-way, and the two controllers would not differ in what the paper compares.
A caller that has an accelerometer hands it in as `measured_acceleration`.

Compensation (eq. 31, 32) tilts the thrust against the drag of the wind estimate. In flight the wind would be force over
drag, w = F / D, and its drag D w is the force again: the drag cancels, so the force estimate is taken as it is. It goes
through the exact inverse of eq. 1 with the wanted acceleration, so that limits and the integral know of it. Beyond the
paper, whose compensation only tilts, the thrust makes up for the upright part: air from below lifts the rotors.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from uasfly.airframe import GRAVITY_M_S2, Airframe
from uasfly.control.parts import all_finite
from uasfly.control.pid_controller import PidController
from uasfly.control.position_gains import ACCELERATION_FILTER_S, position_gains
from uasfly.control.protocol import Timer
from uasfly.messages import Array, Setpoint, StateEstimate

MeasuredAcceleration = Callable[[], Array]  # (3,) m/s^2, world, of the present cycle


class PidDdController(PidController):
    """The paper's three controllers.

    Args:
        airframe: model, limits, yaw gains.
        timer: see `PidController`.
        double_derivative: with the acceleration; without it, the paper's plain PID.
        wind: with compensation of the estimated wind force.
        measured_acceleration: of the vehicle without gravity; by default the velocity estimate's derivative.
    """

    def __init__(
        self,
        airframe: Airframe,
        timer: Timer | None = None,
        *,
        double_derivative: bool = True,
        wind: bool = False,
        measured_acceleration: MeasuredAcceleration | None = None,
    ) -> None:
        self.gains = position_gains(airframe.model, airframe.backup, double_derivative=double_derivative)
        super().__init__(airframe, timer, self.gains.pid)
        self._wind = wind
        self._measured = measured_acceleration
        self._force = np.zeros(3)
        self._forget()

    def reset(self, time_s: float, setpoint: Setpoint | None) -> None:
        """Take over; see `PidController.reset`. What was known of the acceleration is forgotten."""
        super().reset(time_s, setpoint)
        self._forget()

    def _forget(self) -> None:
        self._acceleration: Array | None = None
        self._velocity: Array | None = None
        self._known_s = 0.0

    def _feed_forward(self, time_s: float, estimate: StateEstimate, reference_acceleration: Array) -> Array:
        forward = np.array(reference_acceleration)
        if self.gains.double_derivative:
            error = forward[:2] - self._filtered(time_s, estimate.velocity_in_world, forward)[:2]
            forward[:2] += self.gains.double_derivative * np.where(np.isfinite(error), error, 0.0)
        if self._wind:
            if all_finite(estimate.force_in_world):
                self._force = estimate.force_in_world
            forward -= self._force
        return forward

    def _filtered(self, time_s: float, velocity: Array, reference_acceleration: Array) -> Array:
        """Acceleration (3,) of the vehicle [m/s^2, world], low-passed; it starts from the reference's: no bump."""
        if self._acceleration is None or not all_finite(self._acceleration):
            self._acceleration = reference_acceleration.copy()
            self._velocity, self._known_s = None, time_s
        elapsed = time_s - self._known_s
        raw = None
        if self._measured is not None:
            raw = self._measured()
        elif self._velocity is not None and elapsed > 0.0:
            raw = (velocity - self._velocity) / elapsed
        if raw is not None and elapsed > 0.0 and all_finite(raw):
            share = 1.0 - math.exp(-elapsed / ACCELERATION_FILTER_S)
            bounded = np.clip(raw, -GRAVITY_M_S2, GRAVITY_M_S2)  # an estimate that jumps is no acceleration
            self._acceleration = self._acceleration + share * (bounded - self._acceleration)
        if all_finite(velocity):
            self._velocity, self._known_s = velocity.copy(), time_s
        return self._acceleration
