"""Symbolic algebra at two levels: matrix by matrix (MX), and number by number (SX) for what is small."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import casadi as ca

Matrix = TypeVar("Matrix", ca.SX, ca.MX)


def by_numbers(name: str, expression: Callable[..., list[ca.SX]], *arguments: Any) -> ca.Function:
    """A function that is written out number by number, to be called within an algebra of matrices.

    Args:
        name: of the function.
        expression: of scalars, called with symbols; zeros of its results stay structural.
        arguments: lengths of vectors, or (rows, columns), of what it is called with.
    """
    shapes = [shape if isinstance(shape, tuple) else (shape, 1) for shape in arguments]
    symbols = [ca.SX.sym(f"argument_{index}", *shape) for index, shape in enumerate(shapes)]
    return ca.Function(name, symbols, [ca.sparsify(result) for result in expression(*symbols)], {"cse": True})
