"""Stage functions for the virtual machine: the same numbers from fewer operations."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from tests.control.programs import PATTERN, random_program, small_problem
from uasfly.control.riccati import PACKED, StageFunctions, stage_functions
from uasfly.control.riccati_machine import machine_functions
from uasfly.messages import Array
from uasfly.model import INPUTS, STATES

WRITTEN_OUT, MACHINE = stage_functions(PATTERN), machine_functions(PATTERN)


def _arguments(rng: np.random.Generator) -> list[Array]:
    """P, p, J, c, q, r, Q, R of a stage."""
    problem = small_problem()
    qp = random_program(rng, problem)
    root = rng.normal(size=(STATES, STATES))
    upper = (root @ root.T).T[np.tril_indices(STATES)]  # row by row below is column by column above
    assert upper.size == PACKED
    slope = rng.normal(size=STATES)
    stage = (qp.jacobian[3], qp.defect[3], qp.state_gradient[3], qp.input_gradient[3])
    return [upper, slope, *stage, qp.state_weights[3], qp.input_weights[3]]


def _agree(results: list[ca.DM], others: list[ca.DM]) -> None:
    for result, other in zip(results, others, strict=True):
        expected = np.asarray(other)
        np.testing.assert_allclose(np.asarray(result), expected, atol=1e-11 * max(1.0, np.abs(expected).max()))


def test_products_handed_in_change_nothing() -> None:
    """Every result of a backward stage is that of the function written out, with inputs held and without."""
    rng = np.random.default_rng(5)
    for free in ((1.0, 1.0, 1.0), (0.0, 1.0, 1.0), (1.0, 0.0, 0.0)):
        given = _arguments(rng)
        held = [np.array(free), (1.0 - np.array(free)) * rng.normal(size=INPUTS)]
        products = MACHINE.products.call(given[:4])
        with_held = MACHINE.products_with_held.call([*given[:4], held[1]])
        barrier = WRITTEN_OUT.barrier_backward.call(given)
        _agree(MACHINE.stages.barrier_backward.call([*products, *given]), barrier)
        _agree(MACHINE.free_backward.call([*products, *given]), barrier[:4])
        _agree(MACHINE.stages.backward.call([*with_held, *given, *held]), WRITTEN_OUT.backward.call([*given, *held]))


@pytest.mark.parametrize("stages", [WRITTEN_OUT, MACHINE.stages])
def test_a_backward_stage_divides_once_for_each_input(stages: StageFunctions) -> None:
    """CasADi turns a product with a reciprocal into a division, which takes several times as long; here it must not."""
    for function in (stages.backward, stages.barrier_backward):
        kinds = [function.instruction_id(i) for i in range(function.n_instructions())]
        assert kinds.count(ca.OP_DIV) == 0
        assert kinds.count(ca.OP_INV) == INPUTS


def test_what_is_handed_in_halves_a_stage() -> None:
    """That is what the products are for: operations that the machine interprets one by one."""
    assert MACHINE.free_backward.n_instructions() < 0.5 * WRITTEN_OUT.barrier_backward.n_instructions()
