"""The quadratic program of one iteration, behind one small interface."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from uasfly.messages import Array
from uasfly.model import INPUTS, STATES

Active = NDArray[np.int8]  # (N, 3): -1 at the lower bound, 0 free, 1 at the upper bound


class SolveStatus(enum.IntEnum):
    """How a solve ended; the numbers are those of the compiled driver."""

    CONVERGED = 0
    INEXACT = 1  # not to tolerance, but close, finite and inside the bounds
    FAILED = 2  # no usable result
    BAD_INPUT = 3  # something handed in is not finite


@dataclass(frozen=True, slots=True)
class StageQp:
    """Box-constrained, stage-wise quadratic program in differences dx, du to the present plan.

    minimise  sum_k 1/2 dx_k'Q_k dx_k + q_k'dx_k + 1/2 du_k'R_k du_k + r_k'du_k
    subject to  dx_{k+1} = A_k dx_k + B_k du_k + c_k,  lower_k <= du_k <= upper_k,  dx_0 given

    Attributes:
        jacobian: (N, size) packed [A_k B_k], see `transcription.JacobianPattern`.
        defect: (N, 8) c_k. initial: (8,) dx_0.
        state_gradient: (N + 1, 8) q_k. input_gradient: (N, 3) r_k.
        state_weights: (N + 1, 8) diagonals of Q_k. input_weights: (N, 3) diagonals of R_k, positive.
        lower, upper: (N, 3), lower < upper.
    """

    jacobian: Array
    defect: Array
    initial: Array
    state_gradient: Array
    input_gradient: Array
    state_weights: Array
    input_weights: Array
    lower: Array
    upper: Array

    @property
    def nodes(self) -> int:
        """Number of stages N."""
        return int(self.defect.shape[0])

    @classmethod
    def zeros(cls, nodes: int, packed_size: int) -> StageQp:
        """Arrays for a program, to be filled."""
        of_states, of_inputs = (nodes + 1, STATES), (nodes, INPUTS)
        return cls(
            *(np.zeros((nodes, packed_size)), np.zeros((nodes, STATES)), np.zeros(STATES)),
            *(np.zeros(shape) for shape in (of_states, of_inputs, of_states, of_inputs, of_inputs, of_inputs)),
        )


@dataclass(frozen=True, slots=True)
class QpSolution:
    """Minimiser of a StageQp.

    Attributes:
        status: CONVERGED, INEXACT or FAILED. states: (N + 1, 8) dx. inputs: (N, 3) du. active: (N, 3).
        sweeps: active-set sweeps. interior_iterations: iterations of the interior point, 0 where it was not needed.
    """

    status: SolveStatus
    states: Array
    inputs: Array
    active: Active
    sweeps: int
    interior_iterations: int


class QpSolver(Protocol):
    """What solves a StageQp; `active` is a guess of the active bounds, which a solver may ignore."""

    def solve(self, qp: StageQp, active: Active) -> QpSolution:
        """Solve; never raises on hard or infeasible numbers, says so in the status."""
        ...


@dataclass(frozen=True, slots=True)
class QpOptions:
    """Limits and tolerances that the Riccati solver has in either backend.

    Attributes:
        active_set_sweeps: before the interior point takes over.
        interior_iterations: at most. polish_sweeps: active-set sweeps from the interior point's guess.
        bound_tolerance: how far an input may lie outside its bound, or a multiplier have the wrong sign.
        start_barrier: first complementarity; this and the gaps are relative to input weight times range squared.
        early_gap: mean complementarity at which the interior point first hands its guess to the active set.
        final_gap: at which it ends. loose_gap: up to which an unfinished result still counts as INEXACT.
    """

    active_set_sweeps: int = 8
    interior_iterations: int = 50
    polish_sweeps: int = 5
    bound_tolerance: float = 1e-9
    start_barrier: float = 10.0
    early_gap: float = 1e-3
    final_gap: float = 1e-11
    loose_gap: float = 1e-5
