from __future__ import annotations

from array import array

import casadi as ca
import pytest

from uasfly.sim.compiled import BoundFunction


def test_a_bound_function_reads_and_writes_its_memory() -> None:
    """What is in the inputs when it is evaluated comes out in the outputs."""
    symbol = ca.SX.sym("x", 2)
    function = ca.Function("f", [symbol], [2.0 * symbol, symbol[0] + symbol[1]])
    source, double, total = array("d", [1.0, 2.0]), array("d", [0.0, 0.0]), array("d", [0.0])
    bound = BoundFunction(function, (source,), (double, total))
    bound.evaluate()
    assert (list(double), list(total)) == ([2.0, 4.0], [3.0])
    source[0] = -1.0
    bound.evaluate()
    assert (list(double), list(total)) == ([-2.0, 4.0], [1.0])


def test_memory_of_the_wrong_size_is_refused() -> None:
    """CasADi itself would read beyond the end of an array."""
    symbol = ca.SX.sym("x", 2)
    function = ca.Function("f", [symbol], [symbol])
    good = array("d", [0.0, 0.0])
    with pytest.raises(ValueError, match="expected 2 doubles, found 1"):
        BoundFunction(function, (array("d", [0.0]),), (good,))
    with pytest.raises(ValueError, match="output 0 of f"):
        BoundFunction(function, (good,), (array("f", [0.0, 0.0]),))
