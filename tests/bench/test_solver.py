"""The solver's comparison: problems, turns and figures; no test depends on how fast this computer is."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path

import numpy as np
import pytest

from uasfly.airframe import Airframe
from uasfly.bench.acados_messages import Times
from uasfly.bench.acados_process import AcadosProcess, AcadosUnavailableError, find_acados
from uasfly.bench.bench import BenchResult, BenchSettings, bench_solver
from uasfly.bench.cases import NODES, NOMINAL, SATURATED, SATURATED_SHARE, bench_grid
from uasfly.bench.contestants import AcadosSolver, Contestant, UasflySolver
from uasfly.bench.report import as_json
from uasfly.bench.sequence import EPISODE_STEPS, Sequence
from uasfly.bench.solver import BLOCK_STEPS, measure_solvers, prepare
from uasfly.control.problem import Problem
from uasfly.errors import UasflyError
from uasfly.files import find_file, load_file

AIRFRAME = load_file(find_file("airframe", "f550"), Airframe)
ACADOS = os.environ.get("UASFLY_TEST_ACADOS")  # a folder that holds acados, where it is not installed


class Made:
    """A contestant whose times and inputs are made up."""

    slow = False

    def __init__(self, backend: str, time_ms: float, turns: list[str]) -> None:
        self.name = self.backend = backend
        self._time_ms, self._turns = time_ms, turns

    def state(self, problem: Problem) -> None:
        """Nothing is solved."""

    def run(self, sequence: Sequence, steps: slice) -> Times:
        """Times that grow with the step in the block; a first step of an episode takes a thousand times as long."""
        self._turns.append(self.backend)
        fresh = sequence.fresh[steps]
        times = np.where(fresh, 1e3, 1.0 + 0.01 * np.arange(fresh.size)) * self._time_ms
        return Times(times, np.full((fresh.size, 3), self._time_ms), np.zeros(fresh.size, np.int64))


def test_contestants_take_turns_on_the_same_problems_and_ratios_are_to_acados() -> None:
    """Who begins alternates; cold starts count for nothing; acados' own ratio is one."""
    turns: list[str] = []
    made: list[Contestant] = [Made("c", 0.1, turns), Made("acados", 1.0, turns)]
    rows = list(measure_solvers(AIRFRAME, [10], made, lambda _: 2, lambda n, case: None))
    assert turns[:4] == ["c", "acados", "acados", "c"]
    assert [(row.case, row.backend) for row in rows[:2]] == [("nominal", "c"), ("nominal", "acados")]
    ours, theirs = rows[0], rows[1]
    assert ours.steps == 2 * (BLOCK_STEPS - BLOCK_STEPS // EPISODE_STEPS)
    assert ours.figures.max < 1.0
    assert ours.ratios is not None
    assert (ours.ratios.median, ours.ratios.p99) == pytest.approx((0.1, 0.1))
    assert theirs.ratios is not None
    assert theirs.ratios.median == 1.0
    assert ours.difference is None
    assert theirs.difference == pytest.approx((0.9, 0.9))


@pytest.mark.parametrize("nodes", [10, 30, 60])
def test_cases_saturate_as_much_as_they_say(nodes: int) -> None:
    """Nominal next to never, saturated in 15 to 20 % of the plans' inputs."""
    assert prepare(AIRFRAME, nodes, NOMINAL, 100)[1].saturated_share < 0.05
    least, most = SATURATED_SHARE
    assert least <= prepare(AIRFRAME, nodes, SATURATED, 100)[1].saturated_share <= most


def test_sequences_repeat() -> None:
    """The same problems come again in every run."""
    first, second = (prepare(AIRFRAME, 20, NOMINAL, 60)[1] for _ in range(2))
    assert np.array_equal(first.initial, second.initial)
    assert np.array_equal(first.input_reference, second.input_reference)


@pytest.mark.parametrize("nodes", NODES)
def test_all_sizes_reach_three_seconds(nodes: int) -> None:
    """The first interval is the airframe's where that leaves room."""
    grid = bench_grid(AIRFRAME, nodes)
    assert grid.nodes == nodes
    assert grid.time_s[-1] == pytest.approx(3.0)


def test_solver_part_as_json(monkeypatch: pytest.MonkeyPatch) -> None:
    """The keys that scripts read; without acados its ratios are null, and one line says how to install it."""
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    result = bench_solver(BenchSettings(AIRFRAME, (10,), ("vm",)), lambda text, done: None)
    plain = as_json(result)
    assert [(row["n"], row["case"], row["backend"]) for row in plain["solver"]] == [
        (10, "nominal", "vm"),
        (10, "saturated", "vm"),
    ]
    for row in plain["solver"]:
        assert {"name", "n", "case", "backend", "median_ms", "p99_ms", "saturated_share"} <= set(row)
        assert row["median_ratio_to_acados"] is None
        assert row["p99_ratio_to_acados"] is None
        assert row["failed"] == 0
        assert 0.0 < row["median_ms"] <= row["p99_ms"] <= row["max_ms"]
    assert sum("pip install" in remark for remark in plain["remarks"]) == 1
    assert {"observer_ms", "cycle_ms", "link_ms", "recommended"} <= set(plain)


def test_nothing_measured_is_null() -> None:
    """Every key is there."""
    plain = as_json(BenchResult())
    assert plain["solver"] == []
    assert plain["cycle_ms"] is None
    assert plain["recommended"] is None


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        (BenchSettings(AIRFRAME, (3,)), "--nodes 3"),
        (BenchSettings(AIRFRAME, (10,), ("fortran",)), "--backend fortran"),
        (BenchSettings(AIRFRAME, (10,), ("vm",), Path("/nowhere")), "--acados"),
    ],
)
def test_what_cannot_be_measured_is_refused(settings: BenchSettings, text: str) -> None:
    """Before anything is measured."""
    with pytest.raises(UasflyError, match=text):
        bench_solver(settings, lambda told, done: None)


def test_a_process_that_cannot_run_acados_says_why(tmp_path: Path) -> None:
    """A folder that only looks like acados: the reason comes back."""
    (tmp_path / "acados" / "install" / "lib").mkdir(parents=True)
    with pytest.raises(AcadosUnavailableError, match="acados"):
        AcadosProcess(find_acados(tmp_path))


@pytest.mark.parametrize("case", [NOMINAL, SATURATED])
def test_acados_finds_the_same_inputs(case: object) -> None:
    """Same model, weights, grid, bounds and guess: the first inputs agree far below what a vehicle could feel."""
    if ACADOS is None:
        pytest.importorskip("acados", reason="comma-deps-acados is not installed")
    with AcadosProcess(find_acados(None if ACADOS is None else Path(ACADOS))) as process:
        contestants: list[Contestant] = [UasflySolver("vm"), AcadosSolver(process)]
        problem, problems = prepare(AIRFRAME, 20, NOMINAL if case is NOMINAL else SATURATED, 100)
        ours: list[Times] = []
        theirs: list[Times] = []
        for contestant, times in zip(contestants, (ours, theirs), strict=True):
            contestant.state(problem)
            times.append(contestant.run(problems, slice(0, 100)))
    assert not theirs[0].status.any()
    difference = np.abs(ours[0].inputs - theirs[0].inputs).max(axis=1)
    assert np.median(difference) < 1e-8
    assert difference.max() < 1e-4
