"""A stage function evaluated along the horizon, in place: stage k works on row k of arrays that stay."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import casadi as ca

from uasfly.messages import Array


class Stagewise:
    """A CasADi function bound to arrays once for each stage; a call copies nothing and costs 0.1 us.

    What one stage hands to the next is a matter of which rows are bound: with `cost[1:]` among the arguments and
    `cost[:-1]` among the results, stage k takes row k + 1 and leaves row k, a backward recursion.

    Args:
        function: of dense arguments and results.
        arguments: (N, n) each, one row a stage; or (n,), the same for all stages.
        results: (N, n) each; or (n,), where a stage leaves what it needs no longer than until the next one.

    Attributes:
        calls: evaluate one stage each, in the order of the stages; only while this object lives: they hold no
            reference to it.

    Raises:
        ValueError: when an array does not fit, or its rows are not contiguous doubles.
    """

    __slots__ = ("_kept", "calls")

    def __init__(self, function: ca.Function, arguments: Sequence[Array], results: Sequence[Array]) -> None:
        arguments, results = list(arguments), list(results)
        if (len(arguments), len(results)) != (function.n_in(), function.n_out()):
            raise ValueError(f"{function.name()} has {function.n_in()} arguments and {function.n_out()} results")
        sparsities = [function.sparsity_in(i) for i in range(function.n_in())]
        sparsities += [function.sparsity_out(i) for i in range(function.n_out())]
        for array, sparsity in zip((*arguments, *results), sparsities, strict=True):
            _check(function.name(), array, sparsity)
        stages = next(array.shape[0] for array in (*arguments, *results) if array.ndim == 2)
        if any(array.shape[0] != stages for array in (*arguments, *results) if array.ndim == 2):
            raise ValueError(f"{function.name()} needs arrays of the same number of rows")
        self._kept: list[object] = [arguments, results]
        self.calls: list[Callable[[], None]] = []
        for k in range(stages):
            buffer, call = function.buffer()
            for i, array in enumerate(arguments):
                buffer.set_arg(i, _row(array, k))  # type: ignore[call-arg]
            for i, array in enumerate(results):
                buffer.set_res(i, _row(array, k))  # type: ignore[call-arg]
            self._kept.append(buffer)
            self.calls.append(call)

    def forward(self) -> None:
        """Evaluate from the first stage to the last."""
        for call in self.calls:
            call()

    def backward(self, last: int = -1) -> None:
        """Evaluate from stage `last` down to the first."""
        for call in self.calls[last::-1]:
            call()


def _row(array: Array, k: int) -> memoryview:
    row: Array = array if array.ndim == 1 else array[k]
    return memoryview(row)  # type: ignore[arg-type]


def _check(name: str, array: Array, sparsity: ca.Sparsity) -> None:
    fits = sparsity.is_dense() and array.shape[-1] == sparsity.numel() and array.ndim in (1, 2)
    if not (fits and array.dtype == "float64" and array.flags.c_contiguous):
        raise ValueError(f"{name}: an array of shape {array.shape} and type {array.dtype} does not fit {sparsity}")
