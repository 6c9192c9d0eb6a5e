"""The solver's times: every contestant on the same problems, in blocks that take turns, so that all meet the same
computer; what slows one of them down for a second slows down the others too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from uasfly.airframe import Airframe
from uasfly.bench.acados_messages import Times
from uasfly.bench.cases import CASES, SATURATED, SATURATED_SHARE, Case, bench_problem
from uasfly.bench.contestants import Contestant
from uasfly.bench.sequence import EPISODE_STEPS, fly_sequence
from uasfly.bench.sequence import Sequence as Problems
from uasfly.bench.timing import Figures, Ratios
from uasfly.control.problem import Problem
from uasfly.messages import Array

BLOCK_STEPS = 4 * EPISODE_STEPS
CALIBRATIONS = 8
SEED = 1


@dataclass(frozen=True, slots=True)
class SolverRow:
    """One solver on one size and case.

    Attributes:
        name, n, case, backend: what was measured. figures: its times [ms], without the first steps of episodes.
        ratios: to acados, None without it.
        saturated_share: of the plans' inputs at a bound. steps: how many were timed. failed: how many gave no plan.
        difference: median and largest difference of the first inputs to the first contestant's; None for itself.
    """

    name: str
    n: int
    case: str
    backend: str
    figures: Figures
    ratios: Ratios | None
    saturated_share: float
    steps: int
    failed: int
    difference: tuple[float, float] | None

    def as_dict(self) -> dict[str, object]:
        """Plain data."""
        figures = self.figures.as_dict()
        return {
            "name": self.name,
            "n": self.n,
            "case": self.case,
            "backend": self.backend,
            **{f"{name}_ms": value for name, value in figures.items()},
            "median_ratio_to_acados": None if self.ratios is None else round(self.ratios.median, 4),
            "p99_ratio_to_acados": None if self.ratios is None else round(self.ratios.p99, 4),
            "saturated_share": round(self.saturated_share, 4),
            "steps": self.steps,
            "failed": self.failed,
            "input_difference": None
            if self.difference is None
            else {"median": self.difference[0], "max": self.difference[1]},
        }


def measure_solvers(
    airframe: Airframe,
    nodes: Sequence[int],
    contestants: Sequence[Contestant],
    blocks: Callable[[int], int],
    told: Callable[[int, str], None],
) -> Iterator[SolverRow]:
    """Measure contestants on sizes, nominal and saturated; a row for each as soon as it is known.

    Args:
        airframe: whose model, weights and limits are used.
        nodes: sizes N.
        contestants: solvers; the first is what the others' results are compared with.
        blocks: how many blocks of 200 steps a size gets.
        told: called before each size and case.
    """
    for n in nodes:
        for case in CASES:
            told(n, case.name)
            count = BLOCK_STEPS * blocks(n)
            problem, problems = prepare(airframe, n, case, count)
            yield from _rows(n, case, problems, _take_turns(problem, problems, contestants), contestants)


def prepare(airframe: Airframe, n: int, case: Case, steps: int) -> tuple[Problem, Problems]:
    """The problem of a case and steps flown with it.

    The saturated case shrinks the box of the inputs until the share of inputs at a bound is in the middle of what it
    is to be, or takes the closest of eight tries.
    """
    if case is not SATURATED:
        problem = bench_problem(airframe, n)
        return problem, fly_sequence(airframe, problem, case, steps, SEED)
    least, most = SATURATED_SHARE
    middle, tight, wide = 0.5 * (least + most), np.log(0.1), np.log(1.5)
    best: tuple[float, Problem, Problems] | None = None
    for _ in range(CALIBRATIONS):
        box = 0.5 * (tight + wide)
        problem = bench_problem(airframe, n, float(np.exp(box)))
        problems = fly_sequence(airframe, problem, case, steps, SEED)
        share = problems.saturated_share
        if best is None or abs(share - middle) < best[0]:
            best = (abs(share - middle), problem, problems)
        if best[0] < 0.25 * (most - least):
            break
        tight, wide = (box, wide) if share > middle else (tight, box)
    assert best is not None
    return best[1], best[2]


def _take_turns(problem: Problem, problems: Problems, contestants: Sequence[Contestant]) -> list[list[Times]]:
    """Blocks of each contestant; who begins alternates."""
    for contestant in contestants:
        contestant.state(problem)
    blocks: list[list[Times]] = [[] for _ in contestants]
    for number, first in enumerate(range(0, len(problems), BLOCK_STEPS)):
        order = list(enumerate(contestants))
        for index, contestant in order if number % 2 == 0 else reversed(order):
            if contestant.slow and number > 0:
                continue
            length = EPISODE_STEPS if contestant.slow else BLOCK_STEPS
            blocks[index].append(contestant.run(problems, slice(first, first + length)))
    return blocks


def _rows(
    n: int, case: Case, problems: Problems, blocks: list[list[Times]], contestants: Sequence[Contestant]
) -> Iterator[SolverRow]:
    anchor = next((blocks[i] for i, c in enumerate(contestants) if c.backend == "acados"), None)
    for contestant, own in zip(contestants, blocks, strict=True):
        times = [_warm(problems, number, block) for number, block in enumerate(own)]
        ratios = None
        if anchor is not None:
            theirs = [_warm(problems, number, block) for number, block in enumerate(anchor)]
            same = [there[: here.size] for here, there in zip(times, theirs, strict=False)]  # of the same problems
            ratios = Ratios.of(times, same)
        figures = Figures.of(np.concatenate(times))
        assert figures is not None
        yield SolverRow(
            name=contestant.name,
            n=n,
            case=case.name,
            backend=contestant.backend,
            figures=figures,
            ratios=ratios,
            saturated_share=problems.saturated_share,
            steps=sum(block.size for block in times),
            failed=sum(int(np.count_nonzero(block.status)) for block in own),
            difference=None if own is blocks[0] else _difference(blocks[0], own),
        )


def _warm(problems: Problems, number: int, block: Times) -> Array:
    """Times of a block [ms] without the first steps of episodes, which start cold with three iterations."""
    first = number * BLOCK_STEPS
    warm: Array = block.time_ms[~problems.fresh[first : first + block.time_ms.size]]
    return warm


def _difference(reference: list[Times], own: list[Times]) -> tuple[float, float]:
    parts = [np.abs(b.inputs - a.inputs[: len(b.inputs)]).max(axis=1) for a, b in zip(reference, own, strict=False)]
    together = np.concatenate(parts)
    return float(np.median(together)), float(together.max())
