"""The high-gain extended state observer that Asignacion et al. 2022 compare theirs with.

Each axis has its velocity and the acceleration f = d / inertia that the disturbance gives it as states:

    x^' = A(p, q, r) x + B u + f^ + 2/epsilon (x - x^),     f^' = 1/epsilon^2 (x - x^)

with both poles in -1/epsilon: a second-order low pass for the disturbance, and a differentiator for the noise below it.
"""

from __future__ import annotations

import numpy as np

from uasfly.messages import Array
from uasfly.wind.exact_step import Steps, checked_rate
from uasfly.wind.six_axes import TORQUES, SixAxisBody


class ExtendedStateObserver:
    """Force and torque on a vehicle, all six axes, sample by sample.

    Args:
        body: mass properties.
        epsilon_s: time constant of both poles [s]; the smaller, the higher the gains.

    Attributes:
        disturbance: shape (6,): force in the world [N], torque in the body [N m].
    """

    def __init__(self, body: SixAxisBody, epsilon_s: float) -> None:
        self._body = body
        self._inertias = body.inertias
        self._gains = np.array(((2.0 / checked_rate("epsilon_s", epsilon_s),), (1.0 / epsilon_s**2,)))
        self._steps = Steps(np.array(((-2.0 / epsilon_s, 1.0), (-1.0 / epsilon_s**2, 0.0))))
        self._estimate: Array = np.zeros((2, 6))  # velocities and rates; accelerations by the disturbance
        self._state: Array = np.zeros(6)
        self.disturbance: Array = np.zeros(6)

    def update(self, time_s: float, state: Array, mean_inputs: Array) -> Array:
        """Take in a sample; the same as `FuzzyDisturbanceObserver.update`."""
        if not (self._steps.is_new(time_s) and np.isfinite(state).all() and np.isfinite(mean_inputs).all()):
            return self.disturbance
        step = self._steps.to(time_s)
        if step is None:
            self._estimate = np.stack((state, self.disturbance / self._inertias))
        else:
            states = (self._state, 0.5 * (self._state + state), state)
            accelerations = mean_inputs / self._inertias
            self._estimate = step.advance(self._estimate, *(self._drive(value, accelerations) for value in states))
            self.disturbance = self._inertias * self._estimate[1]
        self._state = state.copy()
        return self.disturbance

    def _drive(self, state: Array, accelerations: Array) -> Array:
        drive: Array = self._gains * state
        drive[0] += self._body.system_matrix(state[TORQUES]) @ state + accelerations
        return drive
