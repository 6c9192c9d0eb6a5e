"""Compiled CasADi functions tied to fixed memory, so that a call converts nothing."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca


class BoundFunction:
    """A compiled function with the memory it reads and writes; call `evaluate`.

    Args:
        function: no memory may be both input and output: outputs are written while inputs are still read.
        inputs: one array of doubles an input, as long as the input has entries.
        outputs: likewise for the outputs.
    """

    __slots__ = ("_buffer", "_memory", "evaluate")

    def __init__(self, function: ca.Function, inputs: Sequence[array[float]], outputs: Sequence[array[float]]) -> None:
        buffer: Any
        evaluate: Callable[[], None]
        buffer, evaluate = function.buffer()
        for index, memory in enumerate(inputs):
            _check_length(function.numel_in(index), memory, f"input {index} of {function.name()}")
            buffer.set_arg(index, memoryview(memory))
        for index, memory in enumerate(outputs):
            _check_length(function.numel_out(index), memory, f"output {index} of {function.name()}")
            buffer.set_res(index, memoryview(memory))
        self._buffer = buffer  # owns what `evaluate` works on
        self._memory = (*inputs, *outputs)
        self.evaluate = evaluate


def _check_length(expected: int, memory: array[float], name: str) -> None:
    if memory.typecode != "d" or len(memory) != expected:
        raise ValueError(f"{name}: expected {expected} doubles, found {len(memory)} of type {memory.typecode!r}")
