"""What the bench and the process that runs acados say to each other: pickled objects, one after the other."""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from uasfly.messages import Array

MOST_NODES = 160


@dataclass(frozen=True, slots=True)
class Statement:
    """A problem: intervals (N,) [s], weights (N + 1, 8) and (N, 3) as in `Problem`, bounds (3,)."""

    interval_s: Array
    state_weights: Array
    input_weights: Array
    input_lower: Array
    input_upper: Array


@dataclass(frozen=True, slots=True)
class Steps:
    """Steps to be solved one after the other; arrays as in `Sequence`, the input reference with the move in it."""

    start_s: Array
    fresh: NDArray[np.bool_]
    initial: Array
    yaw: Array
    force: Array
    parameters: Array
    state_reference: Array
    input_reference: Array


@dataclass(frozen=True, slots=True)
class Times:
    """What came out: (n,) time of `solve()` [ms], (n, 3) first inputs of the plans, (n,) acados' status, 0 is well."""

    time_ms: Array
    inputs: Array
    status: NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Ready:
    """The solver is compiled."""

    version: str


@dataclass(frozen=True, slots=True)
class Failure:
    """It does not work, and why."""

    reason: str


def send(stream: IO[bytes], message: object) -> None:
    """Write a message and let it go."""
    pickle.dump(message, stream, protocol=pickle.HIGHEST_PROTOCOL)
    stream.flush()


def receive(stream: IO[bytes]) -> Any:
    """The next message; waits for it.

    Raises:
        EOFError: the other side is gone.
    """
    return pickle.load(stream)  # safe: the other end started this process, or was started by it
