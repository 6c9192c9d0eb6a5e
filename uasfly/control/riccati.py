"""One stage of the Riccati recursion, as expressions: what both backends evaluate, N times a sweep.

The stage problem is in differences to the present plan,

    minimise  sum 1/2 dx'Q dx + q'dx + 1/2 du'R du + r'du,   dx+ = A dx + B du + c,   lower <= du <= upper,

with diagonal Q and R and a quadratic cost to go 1/2 dx'P dx + p'dx. The structural zeros of A and B (see
`transcription.JacobianPattern`) are used throughout. Source: Rao, Wright, Rawlings, Application of interior-point
methods to model predictive control, J. Optim. Theory Appl. 99 (1998), with the eliminations written out.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from uasfly.control.transcription import JacobianPattern
from uasfly.model import INPUTS, ROLL, STATES

PACKED = STATES * (STATES + 1) // 2  # upper triangle of P, by columns
PACKED_INPUTS = INPUTS * (INPUTS + 1) // 2
FACTOR = 2 * INPUTS  # reciprocal pivots and the strict lower triangle of an LDL' factor


@dataclass(frozen=True, slots=True)
class StageFunctions:
    """The stage of each sweep; what is carried from stage to stage comes first in arguments and results.

    Attributes:
        backward: (P, p, J, c, q, r, Q, R, free, fixed) -> (P, p, K, k, Hux, Huu, hu); where free = 0,
            du = fixed; elsewhere fixed = 0.
        forward: (dx, J, c, K, k, Hux, Huu, hu, fixed) -> (dx+, du, gradient of the cost by du).
        barrier_backward: (P, p, J, c, q, r, Q, R) -> (P, p, K, k, factor, P c), every input free.
        barrier_vector: (p, J, P c, q, r, K, factor) -> (p, k), again with other q, r and the same factor.
        barrier_forward: (dx, J, c, K, k) -> (dx+, du).
        rollout: (dx, J, c, du) -> dx+.
    """

    backward: ca.Function
    forward: ca.Function
    barrier_backward: ca.Function
    barrier_vector: ca.Function
    barrier_forward: ca.Function
    rollout: ca.Function

    def all(self) -> tuple[ca.Function, ...]:
        """Every function, for the code generator."""
        barrier = (self.barrier_backward, self.barrier_vector, self.barrier_forward)
        return (self.backward, self.forward, *barrier, self.rollout)


def upper_triangle(matrix: ca.SX) -> ca.SX:
    """Upper triangle by columns as a vector."""
    return ca.vertcat(*[matrix[i, k] for k in range(matrix.shape[1]) for i in range(k + 1)])


def _symmetric(packed: ca.SX, size: int) -> ca.SX:
    return ca.triu2symm(ca.SX(ca.Sparsity.upper(size), packed))


class _Factor:
    """LDL' factor of a symmetric positive matrix (INPUTS, INPUTS), as expressions."""

    def __init__(self, reciprocals: list[ca.SX], lower: dict[tuple[int, int], ca.SX]) -> None:
        self.reciprocals = reciprocals
        self.lower = lower

    @classmethod
    def of(cls, matrix: ca.SX) -> _Factor:
        pivots: list[ca.SX] = []
        reciprocals: list[ca.SX] = []
        lower: dict[tuple[int, int], ca.SX] = {}
        for k in range(INPUTS):
            pivot = matrix[k, k] - sum(lower[k, j] ** 2 * pivots[j] for j in range(k))
            pivots.append(pivot)
            # Pivots are positive. A bare reciprocal CasADi would turn back into a division at each of its ten uses.
            reciprocals.append(ca.fabs(1.0 / pivot))
            for i in range(k + 1, INPUTS):
                rest = matrix[i, k] - sum(lower[i, j] * lower[k, j] * pivots[j] for j in range(k))
                lower[i, k] = rest * reciprocals[k]
        return cls(reciprocals, lower)

    @classmethod
    def unpacked(cls, packed: ca.SX) -> _Factor:
        places = [(i, k) for k in range(INPUTS) for i in range(k + 1, INPUTS)]
        return cls([packed[k] for k in range(INPUTS)], {place: packed[INPUTS + n] for n, place in enumerate(places)})

    def packed(self) -> ca.SX:
        return ca.vertcat(*self.reciprocals, *self.lower.values())

    def forward(self, right: ca.SX) -> ca.SX:
        """L^-1 right."""
        rows: list[ca.SX] = []
        for i in range(INPUTS):
            rows.append(right[i, :] - sum(self.lower[i, j] * rows[j] for j in range(i)))
        return ca.vertcat(*rows)

    def scaled(self, half: ca.SX) -> ca.SX:
        """D^-1 half."""
        return ca.vertcat(*[self.reciprocals[i] * half[i, :] for i in range(INPUTS)])

    def backward(self, half: ca.SX) -> ca.SX:
        """L'^-1 half."""
        rows: list[ca.SX] = [ca.SX()] * INPUTS
        for i in reversed(range(INPUTS)):
            rows[i] = half[i, :] - sum(self.lower[j, i] * rows[j] for j in range(i + 1, INPUTS))
        return ca.vertcat(*rows)


@dataclass(frozen=True, slots=True)
class _Ahead:
    """The cost to go behind a stage, by what the stage has in hand: dx and du, with W for [A B] from roll on.

    Attributes:
        xx, ux, uu: blocks of [A B]' P [A B]. x, u: parts of [A B]' slope. slope: P c + p.
    """

    xx: ca.SX
    ux: ca.SX
    uu: ca.SX
    x: ca.SX
    u: ca.SX
    slope: ca.SX

    @classmethod
    def of_defect(cls, hessian: ca.SX, slope: ca.SX, jacobian: ca.SX, defect: ca.SX) -> _Ahead:
        last = jacobian[:, ROLL:]
        joint = ca.horzcat(hessian @ last, hessian @ defect + slope)
        return cls.of(hessian, jacobian, joint, joint.T @ last)

    @classmethod
    def of(cls, hessian: ca.SX, jacobian: ca.SX, joint: ca.SX, products: ca.SX) -> _Ahead:
        """From Y = [P W, P c + p] and Y' W."""
        first, tilt, slope = jacobian[:, :ROLL], STATES - ROLL, joint[:, -1]
        mixed, square, of_last = first.T @ joint[:, :-1], products[:-1, :], products[-1, :].T
        corner = mixed[:, :tilt]
        xx = ca.blockcat([[first.T @ (hessian @ first), corner], [corner.T, square[:tilt, :tilt]]])
        ux, uu = ca.horzcat(mixed[:, tilt:].T, square[:tilt, tilt:].T), square[tilt:, tilt:]
        return cls(xx, ux, uu, ca.vertcat(first.T @ slope, of_last[:tilt]), of_last[tilt:], slope)


def stage_functions(pattern: JacobianPattern, *, products_given: bool = False) -> StageFunctions:
    """The stage functions for a Jacobian pattern.

    Args:
        pattern: of [A B].
        products_given: whether `backward` and `barrier_backward` take two products before all other arguments, for
            callers that have them cheaper: Y = [P W, P (c + B fixed) + p] (8, 6) with the columns W of [A B] from roll
            on, and Y' W (6, 5), both as vectors by columns.
    """
    symbol = ca.SX.sym
    cost, slope, packed, defect = (
        symbol("P", PACKED),
        symbol("pv", STATES),
        symbol("J", pattern.size),
        symbol("c", STATES),
    )
    q, r, weight_x, weight_u = symbol("q", STATES), symbol("r", INPUTS), symbol("Q", STATES), symbol("R", INPUTS)
    free, fixed, dx, du = symbol("free", INPUTS), symbol("fixed", INPUTS), symbol("dx", STATES), symbol("du", INPUTS)
    gain_vector, feedforward = symbol("K", INPUTS * STATES), symbol("k", INPUTS)
    gain = ca.reshape(gain_vector, INPUTS, STATES)
    jacobian = pattern.symbolic(packed)
    a, b = jacobian[:, :STATES], jacobian[:, STATES:]

    hessian, last = _symmetric(cost, STATES), jacobian[:, ROLL:]
    given: list[ca.SX] = []
    if products_given:
        width = last.shape[1]
        given = [symbol("Y", STATES * (width + 1)), symbol("YW", (width + 1) * width)]
        joint, products = ca.reshape(given[0], STATES, width + 1), ca.reshape(given[1], width + 1, width)
        plain = with_held = _Ahead.of(hessian, jacobian, joint, products)
    else:
        plain, with_held = (_Ahead.of_defect(hessian, slope, jacobian, c) for c in (defect, defect + b @ fixed))
    h_xx, h_ux, h_uu = ca.diag(weight_x) + plain.xx, plain.ux, ca.diag(weight_u) + plain.uu

    def eliminate(uu: ca.SX, ux: ca.SX, u: ca.SX, x: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX, _Factor]:
        factor = _Factor.of(uu)
        half = factor.forward(ca.horzcat(ux, u))
        scaled = factor.scaled(half)
        gains = factor.backward(scaled)
        next_cost = h_xx - half[:, :STATES].T @ scaled[:, :STATES]
        next_slope = x - half[:, :STATES].T @ scaled[:, STATES]
        return upper_triangle(next_cost), next_slope, ca.vec(gains[:, :STATES]), gains[:, STATES], factor

    # A held input is part of the defect; it gets a row of the identity and no right hand side, so that gain and
    # feed-forward come out zero.
    masked = ca.SX(INPUTS, INPUTS)
    for i in range(INPUTS):
        for k in range(INPUTS):
            masked[i, k] = free[i] * free[k] * h_uu[i, k] if i != k else free[i] * h_uu[i, i] + (1.0 - free[i])
    h_u = r + weight_u * fixed + with_held.u
    p_next, s_next, big_k, small_k, _ = eliminate(masked, ca.diag(free) @ h_ux, free * h_u, q + with_held.x)
    arguments = [*given, cost, slope, packed, defect, q, r, weight_x, weight_u]
    results = [p_next, s_next, big_k, small_k, ca.vec(h_ux), upper_triangle(h_uu), h_u]
    backward = _function("uasfly_backward", [*arguments, free, fixed], results)

    p_next, s_next, big_k, small_k, factor = eliminate(h_uu, h_ux, r + plain.u, q + plain.x)
    results = [p_next, s_next, big_k, small_k, factor.packed(), plain.slope - slope]
    barrier_backward = _function("uasfly_barrier_backward", arguments, results)

    stored, stored_cost = symbol("factor", FACTOR), symbol("Pc", STATES)
    again = stored_cost + slope
    kept = _Factor.unpacked(stored)
    u_again = r + b.T @ again
    barrier_vector = _function(
        "uasfly_barrier_vector",
        [slope, packed, stored_cost, q, r, gain_vector, stored],
        [q + a.T @ again - gain.T @ u_again, kept.backward(kept.scaled(kept.forward(u_again)))],
    )

    ux_vector, uu_vector, u_vector = symbol("Hux", INPUTS * STATES), symbol("Huu", PACKED_INPUTS), symbol("hu", INPUTS)
    step = -(gain @ dx) - feedforward
    inputs = step + fixed
    gradient = u_vector + ca.reshape(ux_vector, INPUTS, STATES) @ dx + _symmetric(uu_vector, INPUTS) @ step
    forward = _function(
        "uasfly_forward",
        [dx, packed, defect, gain_vector, feedforward, ux_vector, uu_vector, u_vector, fixed],
        [a @ dx + b @ inputs + defect, inputs, gradient],
    )
    barrier_forward = _function(
        "uasfly_barrier_forward", [dx, packed, defect, gain_vector, feedforward], [a @ dx + b @ step + defect, step]
    )
    rollout = _function("uasfly_rollout", [dx, packed, defect, du], [a @ dx + b @ du + defect])
    return StageFunctions(backward, forward, barrier_backward, barrier_vector, barrier_forward, rollout)


def _function(name: str, arguments: list[ca.SX], results: list[ca.SX]) -> ca.Function:
    return ca.Function(name, arguments, results, {"cse": True})
