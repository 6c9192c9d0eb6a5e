"""The solvers that are compared: what runs steps of a sequence and tells how long each took."""

from __future__ import annotations

import time
from typing import Protocol

import numpy as np

from uasfly.bench.acados_messages import Times
from uasfly.bench.acados_process import AcadosProcess
from uasfly.bench.sequence import Sequence
from uasfly.bench.timing import as_in_flight
from uasfly.control.iteration import RealTimeIteration
from uasfly.control.problem import Problem
from uasfly.control.qp import SolveStatus
from uasfly.control.qp_library import LibraryQp
from uasfly.control.transcription import linearisation_function
from uasfly.control.virtual_machine import VirtualMachineBackend
from uasfly.model import INPUTS

LIBRARY = "piqp"


class Contestant(Protocol):
    """A solver.

    Attributes:
        name: for people. backend: "c", "vm", a library's name or "acados". slow: runs one episode only.
    """

    name: str
    backend: str
    slow: bool

    def state(self, problem: Problem) -> None:
        """Take up another problem."""
        ...

    def run(self, sequence: Sequence, steps: slice) -> Times:
        """Solve some steps of a sequence, of which the first is fresh."""
        ...


class UasflySolver:
    """uasfly's own solver in one of its backends, or with the quadratic program solved by a library.

    What is timed is the whole step as Python calls it: the data of the step copied into the solver's arrays, the
    references computed from them, the plan moved on, the stages linearised and the program solved.

    Attributes:
        wall_s, processor_s: what all runs took by the clock and of the processor; where others run they differ.
    """

    def __init__(self, backend: str) -> None:
        self.backend = backend
        self.slow = backend == LIBRARY
        self.name = f"uasfly + {backend}" if self.slow else "uasfly"
        self.wall_s = self.processor_s = 0.0
        self._rti: RealTimeIteration | None = None

    def state(self, problem: Problem) -> None:
        """See `Contestant.state`."""
        self._rti = RealTimeIteration(problem, "vm" if self.slow else self.backend)
        if self.slow:
            program = LibraryQp(linearisation_function()[1])
            self._rti.backend = VirtualMachineBackend(problem, self._rti.workspace, qp=program)

    def run(self, sequence: Sequence, steps: slice) -> Times:
        """See `Contestant.run`."""
        assert self._rti is not None
        rti, clock, places = self._rti, time.perf_counter, range(*steps.indices(len(sequence)))
        times, inputs, status = np.zeros(len(places)), np.zeros((len(places), INPUTS)), np.zeros(len(places), np.int64)
        with as_in_flight():
            begun_s, begun_processor_s = clock(), time.process_time()
            for row, step in enumerate(places):
                if sequence.fresh[step]:
                    rti.drop_plan()
                start_s, before = float(sequence.start_s[step]), sequence.before[step]
                started = clock()
                sequence.load(rti.workspace, step)
                result = rti.solve(start_s, before=before)
                times[row] = clock() - started
                status[row] = 0 if result in (SolveStatus.CONVERGED, SolveStatus.INEXACT) else int(result)
                inputs[row] = rti.workspace.inputs[0]
            self.wall_s += clock() - begun_s
            self.processor_s += time.process_time() - begun_processor_s
        return Times(1e3 * times, inputs, status)


class AcadosSolver:
    """acados as it ships, in its own process; what is timed is `solve()` alone, with all data set before."""

    name = backend = "acados"
    slow = False

    def __init__(self, process: AcadosProcess) -> None:
        self._process = process

    def state(self, problem: Problem) -> None:
        """See `Contestant.state`."""
        self._process.state(problem)

    def run(self, sequence: Sequence, steps: slice) -> Times:
        """See `Contestant.run`."""
        return self._process.run(sequence, steps)
