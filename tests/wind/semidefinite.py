"""Linear matrix inequalities put to a semidefinite solver."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import clarabel
import numpy as np
from scipy import sparse

from uasfly.messages import Array


def solve_inequalities(count: int, inequalities: Sequence[Callable[[Array], Array]]) -> Array | None:
    """Numbers (count,) for which every matrix is positive semidefinite, as Clarabel finds them; None where none are.

    Args:
        count: how many unknowns.
        inequalities: each gives a symmetric matrix, affine in the unknowns.
    """
    rows, constants, cones = [], [], []
    for matrix in inequalities:
        zero = matrix(np.zeros(count))
        upper = np.triu_indices(len(zero))
        order = np.lexsort(upper)  # column by column
        upper = upper[0][order], upper[1][order]
        scale = np.where(upper[0] == upper[1], 1.0, np.sqrt(2.0))
        constants.append(scale * zero[upper])
        rows.append(np.column_stack([scale * (matrix(unit) - zero)[upper] for unit in np.eye(count)]))
        cones.append(clarabel.PSDTriangleConeT(len(zero)))
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    solver = clarabel.DefaultSolver(
        sparse.csc_matrix((count, count)),
        np.zeros(count),
        sparse.csc_matrix(-np.vstack(rows)),
        np.concatenate(constants),
        cones,
        settings,
    )
    solution = solver.solve()
    return np.array(solution.x) if solution.status == clarabel.SolverStatus.Solved else None


def symmetric(unknowns: Array, size: int) -> Array:
    """The symmetric matrix whose upper triangle these are, row by row."""
    matrix = np.zeros((size, size))
    matrix[np.triu_indices(size)] = unknowns
    return matrix + np.triu(matrix, 1).T
