"""The stage functions for CasADi's virtual machine, whose matrix product is five times faster than one written out.

The machine interprets `riccati.stage_functions` one scalar operation at a time, 1 ns each. The products of the cost to
go with the dense part of the Jacobian are half of the operations of a backward stage: they get functions of their own,
called just before. (One function that calls the other would pay more for the call inside than for both from Python.)
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from uasfly.control.riccati import PACKED, StageFunctions, stage_functions
from uasfly.control.transcription import JacobianPattern
from uasfly.model import INPUTS, ROLL, STATES

TILT_AND_INPUTS = STATES + INPUTS - ROLL
JOINT, PRODUCTS = STATES * (TILT_AND_INPUTS + 1), (TILT_AND_INPUTS + 1) * TILT_AND_INPUTS


@dataclass(frozen=True, slots=True)
class MachineFunctions:
    """Stage functions for evaluation without a compiler.

    Attributes:
        stages: of which `backward` and `barrier_backward` take two products, as vectors, before all other arguments.
        free_backward: `barrier_backward` without the results for `barrier_vector`, -> (P, p, K, k).
        products: (P, p, J, c) -> the products (JOINT,) and (PRODUCTS,) for `barrier_backward`.
        products_with_held: (P, p, J, c, fixed) -> those for `backward`.
    """

    stages: StageFunctions
    free_backward: ca.Function
    products: ca.Function
    products_with_held: ca.Function


def machine_functions(pattern: JacobianPattern) -> MachineFunctions:
    """The functions for a Jacobian pattern."""
    symbol = ca.MX.sym
    cost, slope, packed, defect = (
        symbol("P", PACKED),
        symbol("pv", STATES),
        symbol("J", pattern.size),
        symbol("c", STATES),
    )
    fixed, arguments = symbol("fixed", INPUTS), [cost, slope, packed, defect]
    columns = pattern.last_columns(packed, ROLL)
    hessian = ca.MX(ca.Sparsity.dense(STATES, STATES), cost[_places_of_square()])

    def products(defect: ca.MX) -> list[ca.MX]:
        joint = ca.horzcat(ca.densify(hessian @ columns), ca.mac(hessian, defect, slope))
        return [ca.vec(joint), ca.vec(ca.densify(joint.T @ columns))]  # quickest with the sparse factor on the right

    stages = stage_functions(pattern, products_given=True)
    given = stages.barrier_backward.sx_in()
    return MachineFunctions(
        stages,
        ca.Function("uasfly_free_backward", given, stages.barrier_backward.call(given)[:4], {"cse": True}),
        ca.Function("uasfly_products", arguments, products(defect)),
        ca.Function("uasfly_products_with_held", [*arguments, fixed], products(defect + columns[:, -INPUTS:] @ fixed)),
    )


def _places_of_square() -> list[int]:
    """For each entry of a symmetric matrix, by columns, its place in the packed upper triangle."""
    pairs = [(min(i, k), max(i, k)) for k in range(STATES) for i in range(STATES)]
    return [k * (k + 1) // 2 + i for i, k in pairs]
