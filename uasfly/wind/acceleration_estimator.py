"""The estimator of Tomic and Haddadin that Asignacion et al. 2022 compare their observer with.

Forces come from the accelerometers, torques from the angular momentum, both behind a first-order low pass of gain K_I:

    f^' = K_I (m a - u_f - f^),     t^ = K_I (J w - integral of (u_t - w x J w + t^) dt)

with the damping of the six-axis model beside u_f and u_t. No force noise comes from differentiated velocities; all that
shakes the accelerometers does.
"""

from __future__ import annotations

import numpy as np

from uasfly.messages import Array
from uasfly.wind.exact_step import Steps, checked_rate
from uasfly.wind.six_axes import FORCES, TORQUES, SixAxisBody


class AccelerationEstimator:
    """Force and torque on a vehicle, all six axes, sample by sample.

    Args:
        body: mass properties.
        gain_1_s: K_I [1/s].

    Attributes:
        disturbance: shape (6,): force in the world [N], torque in the body [N m].
    """

    def __init__(self, body: SixAxisBody, gain_1_s: float) -> None:
        self._body = body
        self._inertias = body.inertias
        self._gain = checked_rate("gain_1_s", gain_1_s)
        self._steps = Steps(np.array(((-gain_1_s,),)))
        self._filtered: Array = np.zeros(6)  # force [N]; the integral in t^ [N m s]
        self._state: Array = np.zeros(6)
        self.disturbance: Array = np.zeros(6)

    def update(self, time_s: float, state: Array, mean_inputs: Array, mean_acceleration_m_s2: Array) -> Array:
        """Take in a sample; see `FuzzyDisturbanceObserver.update`.

        Args:
            time_s: when the state was true [s].
            state: shape (6,): velocity in the world [m/s], body rates [rad/s].
            mean_inputs: shape (6,): virtual inputs, mean since the last sample.
            mean_acceleration_m_s2: shape (3,): of the vehicle in the world, mean since the last sample (accelerometers
                that integrate give it, rotated, with gravity taken out).

        Returns:
            The disturbance now, shape (6,).
        """
        values = (state, mean_inputs, mean_acceleration_m_s2)
        if not (self._steps.is_new(time_s) and all(np.isfinite(value).all() for value in values)):
            return self.disturbance
        step = self._steps.to(time_s)
        momentum = self._inertias[TORQUES] * state[TORQUES]
        if step is None:
            self._filtered = self.disturbance.copy()
            self._filtered[TORQUES] = momentum - self.disturbance[TORQUES] / self._gain
        else:
            states = (self._state, 0.5 * (self._state + state), state)
            drives = (self._drive(value, mean_inputs, mean_acceleration_m_s2)[None, :] for value in states)
            self._filtered = step.advance(self._filtered[None, :], *drives)[0]
            self.disturbance = self._filtered.copy()
            self.disturbance[TORQUES] = self._gain * (momentum - self._filtered[TORQUES])
        self._state = state.copy()
        return self.disturbance

    def _drive(self, state: Array, inputs: Array, acceleration: Array) -> Array:
        modelled = self._inertias * (self._body.system_matrix(state[TORQUES]) @ state) + inputs
        drive = np.empty(6)
        drive[FORCES] = self._gain * (self._body.mass_kg * acceleration - modelled[FORCES])
        drive[TORQUES] = self._gain * self._inertias[TORQUES] * state[TORQUES] + modelled[TORQUES]
        return drive
