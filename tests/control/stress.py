"""Tens of thousands of stress steps: every one finite, inside the box and converged.

    python -m tests.control.stress [--steps 30000] [--backend c|vm|auto] [--nodes 25] [--seed 1]

Flies the episodes of `tests.control.episodes`, 200 a box, in the wide box and in the paper's tight one. Prints figures
and exits with 1 where a single step is not as it should be. A small version of it is part of the tests.
"""

from __future__ import annotations

import argparse
import collections
import sys
import time
from dataclasses import dataclass, field

import numpy as np

from tests.control.episodes import episodes
from tests.control.programs import small_problem
from uasfly.control.iteration import RealTimeIteration
from uasfly.control.qp import SolveStatus

EPISODES = 200


@dataclass
class Tally:
    """What a run of stress steps showed."""

    steps: int = 0
    not_converged: int = 0
    not_finite: int = 0
    outside: int = 0
    saturated: float = 0.0
    sweeps: collections.Counter[int] = field(default_factory=collections.Counter)
    interior: collections.Counter[int] = field(default_factory=collections.Counter)

    @property
    def good(self) -> bool:
        """Whether every step was finite, inside the box and converged."""
        return self.steps > 0 and not (self.not_converged or self.not_finite or self.outside)

    def add(self, rti: RealTimeIteration, status: SolveStatus) -> None:
        """Count the step that was just solved."""
        work, problem, figures = rti.workspace, rti.problem, rti.figures
        self.steps += 1
        self.not_converged += status is not SolveStatus.CONVERGED
        self.not_finite += not (np.all(np.isfinite(work.states)) and np.all(np.isfinite(work.inputs)))
        self.outside += not np.all((work.inputs >= problem.input_lower) & (work.inputs <= problem.input_upper))
        self.saturated += float(np.mean(work.active != 0))
        self.sweeps[figures.sweeps] += 1
        self.interior[figures.interior_iterations] += 1

    def __str__(self) -> str:
        needed = self.steps - self.interior[0]
        return (
            f"{self.steps} steps, {100.0 * self.saturated / max(self.steps, 1):.1f} % of the inputs at a bound: "
            f"{self.not_converged} not converged, {self.not_finite} not finite, {self.outside} outside; "
            f"one sweep in {100.0 * self.sweeps[1] / max(self.steps, 1):.1f} %, at most {max(self.sweeps, default=0)}; "
            f"interior point in {100.0 * needed / max(self.steps, 1):.2f} %, "
            f"at most {max(self.interior, default=0)} iterations"
        )


def stress(backend: str, *, tight: bool, nodes: int, count: int, steps: int, seed: int) -> Tally:
    """Fly `count` episodes of `steps` steps."""
    rti, tally = RealTimeIteration(small_problem(nodes, tight=tight), backend), Tally()
    for status in episodes(rti, count, steps, np.random.default_rng(seed)):
        tally.add(rti, status)
    return tally


def main() -> int:
    """Run both boxes; 0 where all is well."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=30_000, help="steps a box (default: 30000)")
    parser.add_argument("--backend", default="auto", choices=("auto", "c", "vm"))
    parser.add_argument("--nodes", type=int, default=25)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    if arguments.steps < 1:
        parser.error("--steps must be positive")
    count = min(EPISODES, arguments.steps)
    good = True
    for tight in (False, True):
        started = time.perf_counter()
        tally = stress(
            arguments.backend,
            tight=tight,
            nodes=arguments.nodes,
            count=count,
            steps=-(-arguments.steps // count),
            seed=arguments.seed,
        )
        good = good and tally.good
        spent = time.perf_counter() - started
        print(f"{'tight' if tight else 'wide'} box, N = {arguments.nodes}: {tally} ({spent:.0f} s)", flush=True)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
