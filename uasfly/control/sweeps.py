"""Riccati sweeps over the horizon in CasADi's virtual machine, on arrays that are made once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from uasfly.control.qp import StageQp
from uasfly.control.riccati import FACTOR, PACKED, PACKED_INPUTS, StageFunctions
from uasfly.control.stagewise import Stagewise
from uasfly.messages import Array
from uasfly.model import INPUTS, STATES

_DIAGONAL = np.cumsum(np.arange(1, STATES + 1)) - 1  # places of P's diagonal in its packed triangle


class RiccatiSweeps:
    """The sweeps of one quadratic program after the other; `load` it first.

    Attributes:
        free, fixed: (N, 3) for `active_set`: 1 where an input is free, 0 where it is held at `fixed`, which is else 0.
        barrier_gradient, barrier_weights: (N, 3) for `predict` and `correct`: r and R with the barrier's share.
        states: (N + 1, 8) dx, inputs: (N, 3) du: results of the last sweep; for `rollout` the inputs are its argument.
        gradient: (N, 3) of the cost by du after `active_set`.
    """

    def __init__(self, stages: StageFunctions, packed_size: int, nodes: int) -> None:
        jacobian, defect = np.zeros((nodes, packed_size)), np.zeros((nodes, STATES))
        q, r = np.zeros((nodes + 1, STATES)), np.zeros((nodes, INPUTS))
        weight_x, weight_u = np.zeros((nodes + 1, STATES)), np.zeros((nodes, INPUTS))
        cost, slope = np.zeros((nodes + 1, PACKED)), np.zeros((nodes + 1, STATES))
        gain, feedforward = np.zeros((nodes, INPUTS * STATES)), np.zeros((nodes, INPUTS))
        h_ux, h_uu, h_u = (
            np.zeros((nodes, INPUTS * STATES)),
            np.zeros((nodes, PACKED_INPUTS)),
            np.zeros((nodes, INPUTS)),
        )
        factor, cost_of_defect = np.zeros((nodes, FACTOR)), np.zeros((nodes, STATES))
        self._data = (jacobian, defect, q, r, weight_x, weight_u)
        self._cost, self._slope = cost, slope
        self.free, self.fixed = np.ones((nodes, INPUTS)), np.zeros((nodes, INPUTS))
        self.barrier_gradient, self.barrier_weights = np.zeros((nodes, INPUTS)), np.zeros((nodes, INPUTS))
        self.states, self.inputs = np.zeros((nodes + 1, STATES)), np.zeros((nodes, INPUTS))
        self.gradient = np.zeros((nodes, INPUTS))

        behind, here, before, after = [cost[1:], slope[1:]], [cost[:-1], slope[:-1]], self.states[:-1], self.states[1:]
        linear = [jacobian, defect]
        held = Stagewise(
            stages.backward,
            [*behind, *linear, q[:-1], r, weight_x[:-1], weight_u, self.free, self.fixed],
            [*here, gain, feedforward, h_ux, h_uu, h_u],
        )
        held_forward = Stagewise(
            stages.forward,
            [before, *linear, gain, feedforward, h_ux, h_uu, h_u, self.fixed],
            [after, self.inputs, self.gradient],
        )

        def barrier_backward(gradient: Array, weights: Array) -> Stagewise:
            return Stagewise(
                stages.barrier_backward,
                [*behind, *linear, q[:-1], gradient, weight_x[:-1], weights],
                [*here, gain, feedforward, factor, cost_of_defect],
            )

        free, self._barrier_backward = (
            barrier_backward(r, weight_u),
            barrier_backward(self.barrier_gradient, self.barrier_weights),
        )
        self._barrier_forward = Stagewise(
            stages.barrier_forward, [before, *linear, gain, feedforward], [after, self.inputs]
        )
        self._kept = (free, held, held_forward)  # their calls are nothing without them
        self._backward_calls = tuple(zip(free.calls, held.calls, strict=True))
        self._forward_calls = tuple(zip(self._barrier_forward.calls, held_forward.calls, strict=True))
        self._barrier_vector = Stagewise(
            stages.barrier_vector,
            [slope[1:], jacobian, cost_of_defect, q[:-1], self.barrier_gradient, gain, factor],
            [slope[:-1], feedforward],
        )
        self._rollout = Stagewise(stages.rollout, [before, *linear, self.inputs], [after])

    def load(self, qp: StageQp) -> None:
        """Take a program's data in."""
        data = (qp.jacobian, qp.defect, qp.state_gradient, qp.input_gradient, qp.state_weights, qp.input_weights)
        for place, array in zip(self._data, data, strict=True):
            place[:] = array
        self._cost[-1, _DIAGONAL], self._slope[-1] = qp.state_weights[-1], qp.state_gradient[-1]
        self.states[0] = qp.initial

    def active_set(self, held: Sequence[bool], last: int = -1) -> None:
        """Minimum with some inputs held; the cost to go behind stage `last` is taken as it stands.

        Args:
            held: for each stage, whether any input is held there; the others are cheaper.
            last: where the backward part starts.
        """
        last %= len(held)
        for calls, any_held in zip(self._backward_calls[last::-1], held[last::-1], strict=True):
            calls[any_held]()
        self.gradient[:] = 0.0  # of what is free, at the minimum
        for calls, any_held in zip(self._forward_calls, held, strict=True):
            calls[any_held]()

    def predict(self) -> None:
        """Minimum with every input free, under the barrier's gradient and weights."""
        self._barrier_backward.backward()
        self._barrier_forward.forward()

    def correct(self) -> None:
        """The same with another barrier gradient and the factors of `predict`."""
        self._barrier_vector.backward()
        self._barrier_forward.forward()

    def rollout(self) -> None:
        """States that follow from the inputs."""
        self._rollout.forward()
