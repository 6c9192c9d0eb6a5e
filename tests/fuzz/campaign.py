"""All targets, and how their inputs are spread over processes."""

from __future__ import annotations

import multiprocessing
from functools import partial

from tests.fuzz import file_targets
from tests.fuzz.file_targets import FaultLineSession, FileSession, FlagSession
from tests.fuzz.harness import Tally, Target, run_block
from tests.fuzz.link_target import LinkSession
from tests.fuzz.pilot_target import PilotSession
from tests.fuzz.vehicle_target import VehicleSession

_ALL = (
    *(Target(kind, 3.0, 50, partial(FileSession, kind)) for kind in file_targets.KINDS),
    Target("flag", 2.0, 50, FlagSession),
    Target("fault_line", 2.0, 100, FaultLineSession),
    Target("vehicle", 4.0, 250, VehicleSession),
    Target("link", 4.0, 250, LinkSession),
    Target("pilot", 1.0, 250, PilotSession),
)
TARGETS = {target.name: target for target in _ALL}

Job = tuple[str, int, int, int]


def run(names: list[str], inputs: int, seed: int, processes: int, repeat: int | None = None) -> dict[str, Tally]:
    """Run a number of inputs, shared out between the targets.

    Args:
        names: of the targets.
        inputs: in all.
        seed: of everything.
        processes: how many run at a time; 1 stays in this one.
        repeat: index of a single input, which is run with those of its block that come before it.
    """
    if repeat is not None:
        (name,) = names
        return {name: run_block(TARGETS[name], seed, repeat // TARGETS[name].block, repeat + 1)}
    jobs = _jobs(names, inputs, seed)
    tallies = {name: Tally() for name in names}
    if processes == 1:
        for job in jobs:
            tallies[job[0]].add(_work(job))
        return tallies
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        for name, tally in pool.imap_unordered(_named_work, jobs):
            tallies[name].add(tally)
    return tallies


def _jobs(names: list[str], inputs: int, seed: int) -> list[Job]:
    """One job a block: target, seed, block, index at which it ends."""
    total = sum(TARGETS[name].share for name in names)
    jobs: list[Job] = []
    for name in names:
        target = TARGETS[name]
        count = round(inputs * target.share / total)
        jobs += [(name, seed, block, count) for block in range(-(-count // target.block))]
    return jobs


def _work(job: Job) -> Tally:
    name, seed, block, stop = job
    return run_block(TARGETS[name], seed, block, stop)


def _named_work(job: Job) -> tuple[str, Tally]:
    return job[0], _work(job)
