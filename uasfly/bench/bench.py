"""The whole bench: what is measured, in which order, and what comes out."""

from __future__ import annotations

import contextlib
import importlib.util
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from uasfly.airframe import Airframe
from uasfly.bench.acados_process import AcadosProcess, AcadosUnavailableError, find_acados
from uasfly.bench.cases import NODES, most_nodes
from uasfly.bench.contestants import LIBRARY, AcadosSolver, Contestant, UasflySolver
from uasfly.bench.solver import SolverRow, measure_solvers
from uasfly.control.native_library import NativeUnavailableError, load_library
from uasfly.errors import UasflyError

BACKENDS = ("c", "vm", LIBRARY)
CLAIMED_NODES = (30, 60)  # sizes that get more blocks: their 99th percentiles are told in claims
QUICK_NODES = CLAIMED_NODES

Told = Callable[[str, float], None]  # what is being measured, share that is done


@dataclass(frozen=True, slots=True)
class BenchSettings:
    """What is to be measured.

    Attributes:
        airframe: model, weights, limits and settings.
        nodes: sizes of the solver's problem; all of them where empty.
        backends: of uasfly's solver, of `BACKENDS`; all that are to be had where empty.
        acados: folder with the package acados in it; None for where this Python finds it.
        quick: less of everything.
    """

    airframe: Airframe
    nodes: tuple[int, ...] = ()
    backends: tuple[str, ...] = ()
    acados: Path | None = None
    quick: bool = False

    @property
    def sizes(self) -> tuple[int, ...]:
        """The sizes that are measured."""
        return self.nodes or (QUICK_NODES if self.quick else NODES)

    def blocks(self, nodes: int) -> int:
        """How many blocks a size gets."""
        return 4 if nodes in CLAIMED_NODES and not self.quick else 1


@dataclass(slots=True)
class SolverResult:
    """Rows of the solver's table and what there is to say about them."""

    rows: list[SolverRow] = field(default_factory=list)
    acados: str | None = None  # its package's version
    remarks: list[str] = field(default_factory=list)


def bench_solver(settings: BenchSettings, told: Told) -> SolverResult:
    """Measure the solver, beside acados where that is to be had.

    Raises:
        UasflyError: for a size or a backend that cannot be measured here.
    """
    for n in settings.sizes:
        if not 5 <= n <= most_nodes():
            raise UasflyError(f"--nodes {n}: expected numbers from 5 to {most_nodes()}")
    result = SolverResult()
    with contextlib.ExitStack() as stack:
        contestants: list[Contestant] = [UasflySolver(name) for name in _backends(settings.backends, result.remarks)]
        try:
            folder = find_acados(settings.acados)
            told("acados: generated and compiled", 0.0)
            process = stack.enter_context(AcadosProcess(folder))
            contestants.insert(1, AcadosSolver(process))
            result.acados = process.version
        except AcadosUnavailableError as reason:
            if settings.acados is not None:
                raise
            result.remarks.append(str(reason))
        costs = [n * settings.blocks(n) for n in settings.sizes for _ in range(2)]
        done = 0

        def tell(n: int, case: str) -> None:
            nonlocal done
            told(f"solver, N = {n}, {case}", sum(costs[:done]) / sum(costs))
            done += 1

        for row in measure_solvers(settings.airframe, settings.sizes, contestants, settings.blocks, tell):
            result.rows.append(row)
    return result


def _backends(wanted: Sequence[str], remarks: list[str]) -> list[str]:
    """Backends to be measured, the compiled one first."""
    for name in wanted:
        if name not in BACKENDS:
            raise UasflyError(f"--backend {name}: expected {', '.join(BACKENDS[:-1])} or {BACKENDS[-1]}")
    chosen = [name for name in BACKENDS if not wanted or name in wanted]
    if "c" in chosen:
        try:
            load_library()
        except NativeUnavailableError as reason:
            if wanted:
                raise
            remarks.append(f"no compiled solver: {reason}")
            chosen.remove("c")
    if LIBRARY in chosen and importlib.util.find_spec(LIBRARY) is None:
        if wanted:
            raise UasflyError(f"--backend {LIBRARY}: not installed; pip install {LIBRARY}")
        chosen.remove(LIBRARY)
    return chosen
