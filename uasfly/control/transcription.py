"""From continuous dynamics to stages: an interval integrated, its defect and exact Jacobian, from one expression."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from uasfly.messages import Array
from uasfly.model import (
    INPUTS,
    PARAMETER_DRAG,
    PARAMETER_FORCE,
    PARAMETERS,
    POSITION,
    ROLL,
    STATES,
    VELOCITY,
    attitude_response,
    controller_dynamics,
)


def interval_end(state: ca.SX, inputs: ca.SX, parameters: ca.SX, yaw: ca.SX, yaw_rate: ca.SX, interval: ca.SX) -> ca.SX:
    """State (8,) after an interval [s] of constant inputs and constant yaw rate.

    Roll and pitch follow eq. 2 exactly; position and velocity take one Runge-Kutta step of order four along that
    attitude. The grid's late intervals are longer than the attitude's time constant: there a Runge-Kutta step of the
    attitude itself would be wrong by half the step, and beyond 2.8 time constants unstable.

    Along a given attitude the motion is linear, p' = v and v' = a - drag v, so that step is a sum of the velocity and
    of the accelerations a at start, middle and end. Its coefficients, polynomials in z = -drag h, are written out: code
    generated from the stages k1..k4 and their derivatives does a third more.
    """
    half, at_rest = 0.5 * interval, ca.SX.zeros(ROLL)
    attitude_start = state[ROLL:]
    attitude_middle = attitude_response(state, inputs, parameters, half)
    attitude_end = attitude_response(ca.vertcat(at_rest, attitude_middle), inputs, parameters, half)

    def acceleration(attitude: ca.SX, yaw_then: ca.SX) -> ca.SX:
        return controller_dynamics(ca.vertcat(at_rest, attitude), inputs, parameters, yaw_then)[VELOCITY]

    start = acceleration(attitude_start, yaw)
    middle = acceleration(attitude_middle, yaw + half * yaw_rate)
    end = acceleration(attitude_end, yaw + interval * yaw_rate)
    velocity, z = state[VELOCITY], -interval * parameters[PARAMETER_DRAG]
    decay = 1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0))
    of_start, of_middle = 1.0 + z / 2.0 * (1.0 + z / 2.0), 2.0 + z / 2.0
    sixth, square = interval / 6.0, interval**2 / 6.0
    moved = (interval * decay) * velocity + (square * of_start) * start + (square * of_middle) * middle
    kept = (1.0 + z * decay) * velocity
    gained = (sixth * (1.0 + z * of_start)) * start + (sixth * (4.0 + z * of_middle)) * middle + sixth * end
    return ca.vertcat(state[POSITION] + moved, kept + gained, attitude_end)


def with_force(parameters: ca.SX, force: ca.SX) -> ca.SX:
    """Parameter vector (11,) with the force (3,) of this stage in the place of the common one."""
    return ca.vertcat(parameters[: PARAMETER_FORCE.start], force, parameters[PARAMETER_FORCE.stop :])


def interval_function() -> ca.Function:
    """`interval_end` as a function of state, inputs, parameters, yaw, yaw rate and interval."""
    state, inputs, parameters = ca.SX.sym("x", STATES), ca.SX.sym("u", INPUTS), ca.SX.sym("p", PARAMETERS)
    yaw, yaw_rate, interval = ca.SX.sym("yaw"), ca.SX.sym("yaw_rate"), ca.SX.sym("h")
    end = interval_end(state, inputs, parameters, yaw, yaw_rate, interval)
    return ca.Function("uasfly_interval", [state, inputs, parameters, yaw, yaw_rate, interval], [end], {"cse": True})


@dataclass(frozen=True, slots=True)
class JacobianPattern:
    """The Jacobian of an interval by state and input: which entries exist and which of them vary.

    Only varying entries travel (packed in a vector); ones and zeros stay in the code that is generated from them.

    Attributes:
        sparsity: of the (8, 11) matrix [A B].
        varying: positions, among its nonzeros, of the entries that vary.
        constants: value of every nonzero that does not vary, 0 where it varies.
    """

    sparsity: ca.Sparsity
    varying: tuple[int, ...]
    constants: tuple[float, ...]

    @property
    def size(self) -> int:
        """Length of the packed vector."""
        return len(self.varying)

    def symbolic(self, packed: ca.SX) -> ca.SX:
        """Matrix (8, 11) [A B] of a packed vector."""
        entries = [ca.SX(value) for value in self.constants]
        for place, index in enumerate(self.varying):
            entries[index] = packed[place]
        return ca.SX(self.sparsity, ca.vertcat(*entries))

    def last_columns(self, packed: ca.MX, first: int) -> ca.MX:
        """Columns of [A B] from `first` on, of a packed vector; a product with them skips the zeros.

        Raises:
            ValueError: where one of their entries does not vary.
        """
        before = self.sparsity.colind()[first]
        count = self.sparsity.nnz() - before
        if self.varying[-count:] != tuple(range(before, before + count)):
            raise ValueError(f"columns from {first} on have entries that do not vary")
        places = [index - before for index in self.sparsity.colind()[first:]]
        columns = ca.Sparsity(STATES, STATES + INPUTS - first, places, self.sparsity.row()[before:])
        return ca.MX(columns, packed[packed.numel() - count :])

    def dense(self, packed: Array) -> tuple[Array, Array]:
        """Matrices A (N, 8, 8) and B (N, 8, 3) of packed vectors (N, size)."""
        count = packed.shape[0]
        entries = np.tile(np.array(self.constants), (count, 1))
        entries[:, list(self.varying)] = packed
        matrix = np.zeros((count, STATES, STATES + INPUTS))
        matrix[:, self.sparsity.row(), self.sparsity.get_col()] = entries
        return matrix[:, :, :STATES], matrix[:, :, STATES:]


def linearisation_function() -> tuple[ca.Function, JacobianPattern]:
    """Defect and packed Jacobian of one interval, and how the Jacobian is packed.

    The function maps state (8,), inputs (3,), parameters (11,), force (3,), yaw, yaw rate, interval and next state (8,)
    to the defect (8,) = end of the interval minus next state, and the packed Jacobian.
    """
    state, inputs, parameters = ca.SX.sym("x", STATES), ca.SX.sym("u", INPUTS), ca.SX.sym("p", PARAMETERS)
    yaw, yaw_rate, interval = ca.SX.sym("yaw"), ca.SX.sym("yaw_rate"), ca.SX.sym("h")
    force, following = ca.SX.sym("force", 3), ca.SX.sym("next", STATES)
    end = interval_end(state, inputs, with_force(parameters, force), yaw, yaw_rate, interval)
    jacobian = ca.jacobian(end, ca.vertcat(state, inputs))
    entries = jacobian.nz[:]
    varying = tuple(i for i in range(jacobian.nnz()) if not entries[i].is_constant())
    constants = tuple(0.0 if i in varying else float(entries[i]) for i in range(jacobian.nnz()))
    function = ca.Function(
        "uasfly_linearise",
        [state, inputs, parameters, force, yaw, yaw_rate, interval, following],
        [end - following, entries[list(varying)]],
        {"cse": True},
    )
    return function, JacobianPattern(jacobian.sparsity(), varying, constants)
