"""The stage functions for CasADi's virtual machine, whose matrix product is five times faster than one written out.

The machine interprets `riccati.stage_functions` one scalar operation at a time, 2 ns each. The products of the cost to
go with the dense part of the Jacobian are a third of the operations of a backward stage.
"""

from __future__ import annotations

import dataclasses

import casadi as ca

from uasfly.control.riccati import StageFunctions, stage_functions
from uasfly.control.transcription import JacobianPattern
from uasfly.model import INPUTS, ROLL, STATES


def machine_functions(pattern: JacobianPattern) -> StageFunctions:
    """Functions like those of `stage_functions`, for evaluation without a compiler."""
    stages = stage_functions(pattern, products_given=True)
    return dataclasses.replace(
        stages,
        backward=_with_products(stages.backward, pattern),
        barrier_backward=_with_products(stages.barrier_backward, pattern),
    )


def _with_products(function: ca.Function, pattern: JacobianPattern) -> ca.Function:
    """The function without its two leading arguments, which are computed from P, J, c and (if there is one) fixed."""
    arguments = [ca.MX.sym(f"a{i}", function.size1_in(i)) for i in range(2, function.n_in())]
    cost, packed, defect, inputs_held = arguments[0], arguments[2], arguments[3], arguments[8:]
    columns = pattern.last_columns(packed, ROLL)
    if inputs_held:
        _, fixed = inputs_held
        defect = defect + columns[:, -INPUTS:] @ fixed
    hessian = ca.reshape(cost[_places_of_square()], STATES, STATES)
    return ca.Function(
        f"{function.name()}_machine",
        arguments,
        function.call([ca.densify(hessian @ columns), hessian @ defect, *arguments]),
    )


def _places_of_square() -> list[int]:
    """For each entry of a symmetric matrix, by columns, its place in the packed upper triangle."""
    pairs = [(min(i, k), max(i, k)) for k in range(STATES) for i in range(STATES)]
    return [k * (k + 1) // 2 + i for i, k in pairs]
