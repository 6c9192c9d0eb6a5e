"""What a fuzzing target is, and how a range of its inputs is run: time, memory, exceptions, warnings.

An input is named by (target, seed, index) and is made from nothing else. Inputs of a stateful target come in blocks
that share a session: to repeat one, the block is run from its beginning (`repeat`).
"""

from __future__ import annotations

import contextlib
import resource
import signal
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, Protocol
from zlib import crc32

import numpy as np

from uasfly.errors import UasflyError

Rng = np.random.Generator
LONGEST_INPUT_S = 2.0
LARGEST_GROWTH_KB = 400 * 1024
LONGEST_PROBLEM = 1200
MOST_PROBLEMS = 100


class FindingError(Exception):
    """An input was answered in a way that a check of the target does not accept."""


class HangError(BaseException):
    """An input takes too long; no `except Exception` may swallow it."""


class Session(Protocol):
    """Takes the inputs of a block, one after the other."""

    def feed(self, rng: Rng) -> bool:
        """Make one input and put it in.

        Returns:
            Whether it was accepted; False, or a UasflyError, where it was refused.
        """
        ...

    def close(self) -> None:
        """Look whether everything still works, and tidy up."""
        ...


@dataclass(frozen=True, slots=True)
class Target:
    """Something that reads inputs.

    Attributes:
        name: what it is called on the command line.
        share: of the campaign's inputs, relative to the other targets.
        block: how many inputs share a session.
        start: begins a session.
    """

    name: str
    share: float
    block: int
    start: Callable[[Rng], Session]


@dataclass(slots=True)
class Finding:
    """An input that was not answered as it has to be."""

    target: str
    seed: int
    index: int
    text: str


@dataclass(slots=True)
class Tally:
    """What has come of a target's inputs."""

    inputs: int = 0
    accepted: int = 0
    refused: int = 0
    slowest_s: float = 0.0
    slowest_index: int = -1
    findings: list[Finding] = field(default_factory=list)

    def add(self, other: Tally) -> None:
        """Count another tally of the same target in."""
        self.inputs += other.inputs
        self.accepted += other.accepted
        self.refused += other.refused
        if other.slowest_s > self.slowest_s:
            self.slowest_s, self.slowest_index = other.slowest_s, other.slowest_index
        self.findings += other.findings


def generator(target: Target, seed: int, *path: int) -> Rng:
    """The random numbers of an input or of a block."""
    return np.random.default_rng([crc32(target.name.encode()), seed, *path])


def run_block(target: Target, seed: int, block: int, stop: int) -> Tally:
    """Run the inputs of a block up to the index `stop` (not included)."""
    tally = Tally()
    first = block * target.block
    with _strict_warnings():
        session: Session | None = None
        for index in range(first, min(first + target.block, stop)):
            tally.inputs += 1
            memory_kb = _memory_kb()
            began_s = time.process_time()
            try:
                if session is None:
                    session = target.start(generator(target, seed, block, 0))
                    began_s = time.process_time()  # what a session is made of counts for no input
                with _time_limit(10.0 * LONGEST_INPUT_S):
                    accepted = session.feed(generator(target, seed, block, 1, index))
                tally.accepted += accepted
                tally.refused += not accepted
            except UasflyError as error:
                tally.refused += 1
                if problem := unclear(error):
                    tally.findings.append(Finding(target.name, seed, index, problem))
            except (Exception, HangError):
                tally.findings.append(Finding(target.name, seed, index, traceback.format_exc()))
                if session is not None:
                    with contextlib.suppress(Exception):
                        session.close()
                session = None  # what comes after a failure in it tells nothing
            took_s = time.process_time() - began_s
            if took_s > tally.slowest_s:
                tally.slowest_s, tally.slowest_index = took_s, index
            if took_s > LONGEST_INPUT_S:
                tally.findings.append(Finding(target.name, seed, index, f"it took {took_s:.1f} s"))
            if _memory_kb() - memory_kb > LARGEST_GROWTH_KB:
                tally.findings.append(Finding(target.name, seed, index, "it took more than 400 MB of memory"))
        if session is not None:
            try:
                session.close()
            except Exception:
                tally.findings.append(Finding(target.name, seed, index, traceback.format_exc()))
    return tally


def unclear(error: UasflyError) -> str:
    """What is wrong with the text of an error, "" when nothing is."""
    problems = getattr(error, "problems", None) or str(error).split("\n")
    if not all(problem.strip() for problem in problems):
        return f"an error without a text: {problems!r}"
    if len(problems) > MOST_PROBLEMS:
        return f"an error with {len(problems)} problems"
    for problem in problems:
        if len(problem) > LONGEST_PROBLEM:
            return f"an error of {len(problem)} characters: {problem[:300]!r}"
        if not problem.replace("\n", " ").isprintable():
            return f"an error that cannot be printed: {problem!r}"
    return ""


@contextlib.contextmanager
def _strict_warnings() -> Iterator[None]:
    """A warning of numpy's (overflow, division by zero) is a finding: it would stand in somebody's terminal."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        yield


@contextlib.contextmanager
def _time_limit(seconds: float) -> Iterator[None]:
    def stop(*_: Any) -> None:
        raise HangError(f"not done after {seconds:g} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _memory_kb() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
