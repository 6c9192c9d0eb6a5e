"""CasADi functions called through fixed buffers: half the cost of a call, and no array is made."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import casadi as ca
import numpy as np

from uasfly.messages import Array


def fill(places: Sequence[Array], arrays: Sequence[Array]) -> None:
    """Copy arrays into the arguments of a buffered function, in order; an array may differ in shape, not in size."""
    for place, array in zip(places, arrays, strict=False):
        place.ravel()[:] = array.ravel()


class BufferedFunction:
    """A function of dense arguments whose arguments and results live in arrays that stay.

    CasADi stores matrices by columns, numpy by rows: an argument of n rows and m columns is an array (m, n) here, so a
    horizon of N column vectors of length n is the natural (N, n). A column vector is (n,), a scalar is (1,).

    Attributes:
        arguments: arrays to fill before the call. results: arrays that hold the results after it.
        call: evaluates.
    """

    __slots__ = ("_buffer", "arguments", "call", "results")

    def __init__(self, function: ca.Function) -> None:
        self._buffer, evaluate = function.buffer()
        self.call: Callable[[], None] = evaluate
        self.arguments = [_array(function.sparsity_in(i)) for i in range(function.n_in())]
        self.results = [_array(function.sparsity_out(i)) for i in range(function.n_out())]
        for i, array in enumerate(self.arguments):
            self._buffer.set_arg(i, memoryview(array))  # type: ignore[call-arg, arg-type]
        for i, array in enumerate(self.results):
            self._buffer.set_res(i, memoryview(array))  # type: ignore[call-arg, arg-type]


def _array(sparsity: ca.Sparsity) -> Array:
    if not sparsity.is_dense():
        raise ValueError(f"a buffered function needs dense arguments and results, found {sparsity}")
    rows, columns = sparsity.shape
    return np.zeros(rows) if columns == 1 else np.zeros((columns, rows))
