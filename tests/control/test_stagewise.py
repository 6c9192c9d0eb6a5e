"""Stage functions bound to rows of arrays."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from uasfly.control.stagewise import Stagewise

_carried, _own, _common = ca.SX.sym("a"), ca.SX.sym("b", 2), ca.SX.sym("c")
SUM = ca.Function("sum", [_carried, _own, _common], [_carried + _common * (_own[0] + _own[1])])


def test_forward_and_backward_hand_on_what_is_bound_so() -> None:
    """A row that one stage leaves is the row that the next one takes; a common argument is read at each call."""
    carried, own, common = np.zeros((5, 1)), np.arange(8.0).reshape(4, 2), np.ones(1)
    Stagewise(SUM, [carried[:-1], own, common], [carried[1:]]).forward()
    np.testing.assert_array_equal(carried[:, 0], [0, 1, 6, 15, 28])
    backward = Stagewise(SUM, [carried[1:], own, common], [carried[:-1]])
    carried[-1], common[0] = 100.0, 2.0
    backward.backward()
    np.testing.assert_array_equal(carried[:, 0], [156, 154, 144, 126, 100])


def test_backward_may_start_in_the_middle() -> None:
    """Stages behind the start are left as they are."""
    carried, own = np.full((5, 1), 7.0), np.ones((4, 2))
    Stagewise(SUM, [carried[1:], own, np.ones(1)], [carried[:-1]]).backward(1)
    np.testing.assert_array_equal(carried[:, 0], [11, 9, 7, 7, 7])


def test_a_result_may_be_one_for_all_stages() -> None:
    """What one function leaves there, another may take before the next stage writes over it; the last stage's stays."""
    own, carried, passing, doubled = np.arange(8.0).reshape(4, 2), np.zeros((4, 1)), np.zeros(1), np.zeros((4, 1))
    first = Stagewise(SUM, [carried, own, np.ones(1)], [passing])
    then = Stagewise(SUM, [passing, np.zeros((4, 2)), np.ones(1)], [doubled])
    for one, other in zip(first.calls, then.calls, strict=True):
        one()
        other()
    np.testing.assert_array_equal(doubled[:, 0], [1, 5, 9, 13])
    assert passing[0] == 13


@pytest.mark.parametrize(
    "own",
    [
        np.zeros((4, 3)),
        np.zeros((3, 2)),
        np.zeros((4, 2), np.float32),
        np.asfortranarray(np.zeros((4, 2))),
        np.zeros((4, 4))[:, ::2],
    ],
)
def test_an_array_that_does_not_fit_is_refused(own: np.ndarray) -> None:
    """Wrong length, number of stages or type, or rows that are not contiguous: memory is never read past an array."""
    with pytest.raises(ValueError, match="sum"):
        Stagewise(SUM, [np.zeros((4, 1)), own, np.ones(1)], [np.zeros((4, 1))])


def test_the_number_of_arrays_is_checked() -> None:
    """The function's own."""
    with pytest.raises(ValueError, match="3 arguments and 1 results"):
        Stagewise(SUM, [np.zeros((4, 1))], [np.zeros((4, 1))])
