"""Riccati sweeps over the horizon in CasADi's virtual machine, on arrays that are made once."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from uasfly.control.qp import StageQp
from uasfly.control.riccati import FACTOR, PACKED, PACKED_INPUTS
from uasfly.control.riccati_machine import JOINT, PRODUCTS, MachineFunctions
from uasfly.control.stagewise import Stagewise
from uasfly.model import INPUTS, STATES

_DIAGONAL = np.cumsum(np.arange(1, STATES + 1)) - 1  # places of P's diagonal in its packed triangle


class RiccatiSweeps:
    """The sweeps of one quadratic program after the other; `load` it first.

    Attributes:
        program: what the sweeps read; whoever fills it in place spares `load` the copies.
        free, fixed: (N, 3) for `active_set`: 1 where an input is free, 0 where it is held at `fixed`, which is else 0.
        barrier_gradient, barrier_weights: (N, 3) for `predict` and `correct`: r and R with the barrier's share.
        states: (N + 1, 8) dx, inputs: (N, 3) du: results of the last sweep; for `rollout` the inputs are its argument.
        gradient: (N, 3) of the cost by du after `active_set` and `unconstrained`.
    """

    def __init__(self, functions: MachineFunctions, packed_size: int, nodes: int) -> None:
        stages = functions.stages
        self.program = StageQp.zeros(nodes, packed_size)
        jacobian, defect = self.program.jacobian, self.program.defect
        q, r = self.program.state_gradient, self.program.input_gradient
        weight_x, weight_u = self.program.state_weights, self.program.input_weights
        cost, slope = np.zeros((nodes + 1, PACKED)), np.zeros((nodes + 1, STATES))
        gain, feedforward = np.zeros((nodes, INPUTS * STATES)), np.zeros((nodes, INPUTS))
        h_ux, h_uu, h_u = (
            np.zeros((nodes, INPUTS * STATES)),
            np.zeros((nodes, PACKED_INPUTS)),
            np.zeros((nodes, INPUTS)),
        )
        factor, cost_of_defect = np.zeros((nodes, FACTOR)), np.zeros((nodes, STATES))
        self._cost, self._slope = cost, slope
        self.free, self.fixed = np.ones((nodes, INPUTS)), np.zeros((nodes, INPUTS))
        self.barrier_gradient, self.barrier_weights = np.zeros((nodes, INPUTS)), np.zeros((nodes, INPUTS))
        self.states, self.inputs = np.zeros((nodes + 1, STATES)), np.zeros((nodes, INPUTS))
        self.gradient = np.zeros((nodes, INPUTS))

        behind, here, before, after = [cost[1:], slope[1:]], [cost[:-1], slope[:-1]], self.states[:-1], self.states[1:]
        linear, given = [jacobian, defect], [np.zeros(JOINT), np.zeros(PRODUCTS)]
        free_products = Stagewise(functions.products, [*behind, *linear], given)
        held_products = Stagewise(functions.products_with_held, [*behind, *linear, self.fixed], given)
        held = Stagewise(
            stages.backward,
            [*given, *behind, *linear, q[:-1], r, weight_x[:-1], weight_u, self.free, self.fixed],
            [*here, gain, feedforward, h_ux, h_uu, h_u],
        )
        held_forward = Stagewise(
            stages.forward,
            [before, *linear, gain, feedforward, h_ux, h_uu, h_u, self.fixed],
            [after, self.inputs, self.gradient],
        )

        free = Stagewise(
            functions.free_backward,
            [*given, *behind, *linear, q[:-1], r, weight_x[:-1], weight_u],
            [*here, gain, feedforward],
        )
        barrier = Stagewise(
            stages.barrier_backward,
            [*given, *behind, *linear, q[:-1], self.barrier_gradient, weight_x[:-1], self.barrier_weights],
            [*here, gain, feedforward, factor, cost_of_defect],
        )
        free_forward = Stagewise(stages.barrier_forward, [before, *linear, gain, feedforward], [after, self.inputs])
        self._free_backward = _in_turn(free_products, free)
        self._held_backward = _in_turn(held_products, held)
        self._barrier_backward = _in_turn(free_products, barrier)
        self._free_forward, self._held_forward = free_forward.calls, held_forward.calls
        self._kept = (free_products, held_products, free, held, barrier, free_forward, held_forward)  # of the calls
        self._barrier_vector = Stagewise(
            stages.barrier_vector,
            [slope[1:], jacobian, cost_of_defect, q[:-1], self.barrier_gradient, gain, factor],
            [slope[:-1], feedforward],
        )
        self._rollout = Stagewise(stages.rollout, [before, *linear, self.inputs], [after])

    def load(self, qp: StageQp) -> None:
        """Take a program's data in."""
        own = self.program
        if qp is not own:
            own.jacobian[:], own.defect[:] = qp.jacobian, qp.defect
            own.state_gradient[:], own.input_gradient[:] = qp.state_gradient, qp.input_gradient
            own.state_weights[:], own.input_weights[:] = qp.state_weights, qp.input_weights
        self._cost[-1, _DIAGONAL], self._slope[-1] = qp.state_weights[-1], qp.state_gradient[-1]
        self.states[0] = qp.initial

    def unconstrained(self, last: int = -1) -> None:
        """Minimum with every input free; the cost to go behind stage `last` is taken as it stands."""
        self.gradient.fill(0.0)  # at the minimum
        _backward(self._free_backward, last)
        _forward(self._free_forward)

    def active_set(self, held: Sequence[bool], last: int = -1) -> None:
        """Minimum with some inputs held; the cost to go behind stage `last` is taken as it stands.

        Args:
            held: for each stage, whether any input is held there; the others are cheaper.
            last: where the backward part starts.
        """
        self.gradient.fill(0.0)  # of what is free, at the minimum
        for k in range(last % len(held), -1, -1):
            first, then = (self._held_backward if held[k] else self._free_backward)[k]
            first()
            then()
        for k, any_held in enumerate(held):
            (self._held_forward if any_held else self._free_forward)[k]()

    def predict(self) -> None:
        """Minimum with every input free, under the barrier's gradient and weights."""
        _backward(self._barrier_backward)
        _forward(self._free_forward)

    def correct(self) -> None:
        """The same with another barrier gradient and the factors of `predict`."""
        self._barrier_vector.backward()
        _forward(self._free_forward)

    def rollout(self) -> None:
        """States that follow from the inputs."""
        self._rollout.forward()


_Pair = tuple[Callable[[], None], Callable[[], None]]


def _in_turn(products: Stagewise, backward: Stagewise) -> list[_Pair]:
    """For each stage the two calls of its backward part."""
    return list(zip(products.calls, backward.calls, strict=True))


def _backward(pairs: Sequence[_Pair], last: int = -1) -> None:
    for products, stage in pairs[last::-1]:
        products()
        stage()


def _forward(calls: Sequence[Callable[[], None]]) -> None:
    for call in calls:
        call()
