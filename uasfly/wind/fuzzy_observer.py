"""The frequency-based T-S fuzzy disturbance observer of Asignacion et al. 2022 (eq. 8 and 12).

With the rules' weights h_i at the measured rates,

    x^' = sum h_i (A_i x^ + L_i (x - x^)) + B u,     d^ = 2 pi c B^-1 (x - x^).

The error x - x^ follows the disturbance through poles in -2 pi c, so each axis of d^ is d behind a first-order low pass
with the cut-off frequency c Hz, whatever the vehicle's rates: the one parameter says how fast, how late and how noisy.
"""

from __future__ import annotations

import numpy as np

from uasfly.messages import Array
from uasfly.wind.exact_step import Steps
from uasfly.wind.fuzzy import blend, rule_matrices
from uasfly.wind.pole_circle import PoleCircle
from uasfly.wind.six_axes import TORQUES, SixAxisBody


class FuzzyDisturbanceObserver:
    """Force and torque on a vehicle, all six axes, sample by sample.

    Args:
        body: mass properties.
        poles: cut-off frequency, and the circle that the gains satisfy.

    Attributes:
        disturbance: shape (6,): force in the world [N], torque in the body [N m]; zero before the second sample.
    """

    def __init__(self, body: SixAxisBody, poles: PoleCircle) -> None:
        self._gains = poles.central_gains(rule_matrices(body))
        self._cutoff_rad_s = poles.cutoff_rad_s
        self._inertias = body.inertias
        self._steps = Steps(np.array(((-poles.cutoff_rad_s,),)))
        self._estimate: Array = np.zeros(6)
        self._state: Array = np.zeros(6)
        self._drive: Array = np.zeros(6)
        self.disturbance: Array = np.zeros(6)

    def update(self, time_s: float, state: Array, mean_inputs: Array) -> Array:
        """Take in a sample.

        A sample that is not newer than the last, or not finite, changes nothing. After a gap of more than 0.5 s the
        observer starts from the sample and the last disturbance.

        Args:
            time_s: when the state was true [s].
            state: shape (6,): velocity in the world [m/s], body rates [rad/s]; taken as linear between samples.
            mean_inputs: shape (6,): virtual inputs (see `SixAxisBody`), mean since the last sample.

        Returns:
            The disturbance now, shape (6,).
        """
        if not (self._steps.is_new(time_s) and np.isfinite(state).all() and np.isfinite(mean_inputs).all()):
            return self.disturbance
        drive = blend(state[TORQUES], self._gains) @ state
        step = self._steps.to(time_s)
        if step is None:
            self._estimate = state - self.disturbance / (self._cutoff_rad_s * self._inertias)
        else:
            middle = 0.5 * (self._state + state)
            accelerations = mean_inputs / self._inertias
            drives = (self._drive, blend(middle[TORQUES], self._gains) @ middle, drive)
            accelerated = ((value + accelerations)[None, :] for value in drives)
            self._estimate = step.advance(self._estimate[None, :], *accelerated)[0]
            self.disturbance = self._cutoff_rad_s * self._inertias * (state - self._estimate)
        self._state, self._drive = state.copy(), drive
        return self.disturbance
