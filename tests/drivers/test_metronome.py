"""The beat of the control cycles, on a clock that the test moves."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from uasfly.drivers import metronome
from uasfly.drivers.metronome import WINDOW_S, Metronome

PERIOD_S = 0.02


class World:
    """A clock, and a vehicle whose motion arrives at a rate of its own; stands for `time`, `asyncio` and the link."""

    def __init__(self, motion_s: float, offset_s: float = 0.0, jitter_s: float = 0.0) -> None:
        self.now_s = 100.0
        rng = np.random.default_rng(3)
        self._arrivals = (
            100.0 + offset_s + k * motion_s + float(rng.uniform(0.0, jitter_s)) for k in itertools.count()
        )
        self._next_s = next(self._arrivals) if math.isfinite(motion_s) else math.inf
        self.ages: list[float] = []
        self._last_s = -math.inf

    def monotonic(self) -> float:
        """Now."""
        return self.now_s

    async def sleep(self, duration_s: float) -> None:
        """Let time pass."""
        self.advance(self.now_s + duration_s)

    async def wait_for_motion(self, timeout_s: float) -> bool:
        """Let time pass until motion arrives, or the time-out."""
        until_s = self.now_s + timeout_s
        if self._next_s <= until_s:
            self.advance(self._next_s)
            return True
        self.advance(until_s)
        return False

    def advance(self, until_s: float) -> None:
        """Move the clock."""
        self.now_s = max(self.now_s, until_s)
        while self._next_s <= self.now_s:
            self._last_s, self._next_s = self._next_s, next(self._arrivals)

    @property
    def motion_age_s(self) -> float:
        """Age of the last motion."""
        return self.now_s - self._last_s


async def _beats(world: World, count: int, monkeypatch: pytest.MonkeyPatch) -> tuple[list[float], list[float]]:
    """Times of the cycles, and how old the motion was then."""
    monkeypatch.setattr(metronome, "time", world)
    monkeypatch.setattr(metronome, "asyncio", world)
    beat = Metronome(world, PERIOD_S)  # type: ignore[arg-type]
    times, ages = [], []
    for _ in range(count):
        await beat.next()
        times.append(world.now_s)
        ages.append(world.motion_age_s)
    return times, ages


@pytest.mark.parametrize("offset_s", [0.0, 0.003, 0.006, 0.009])
async def test_cycles_begin_when_motion_arrives(offset_s: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """At 100 Hz wherever it falls: after a few cycles each begins with motion that has just come, 50 times a second."""
    times, ages = await _beats(World(0.01, offset_s, jitter_s=0.001), 300, monkeypatch)
    assert max(ages[10:]) < 1e-6
    assert (times[-1] - times[9]) / (len(times) - 10) == pytest.approx(PERIOD_S, abs=2e-5)


async def test_the_beat_follows_the_vehicles_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """A clock 2 % slow: the beat stays with it instead of sliding through."""
    _, ages = await _beats(World(0.0102), 500, monkeypatch)
    assert max(ages[10:]) < 1e-6


async def test_silence_slows_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without motion the cycles keep their period exactly."""
    times, _ = await _beats(World(math.inf), 100, monkeypatch)
    np.testing.assert_allclose(np.diff(times), PERIOD_S, atol=1e-9)


async def test_rare_motion_moves_no_cycle_by_more_than_the_window(monkeypatch: pytest.MonkeyPatch) -> None:
    """At 30 Hz most cycles find none: the period stays 20 ms in the mean, and each within the window."""
    times, _ = await _beats(World(1.0 / 30.0), 600, monkeypatch)
    gaps = np.diff(times)
    assert gaps.max() <= PERIOD_S + 2.0 * WINDOW_S + 1e-9
    assert gaps.mean() == pytest.approx(PERIOD_S, rel=0.05)


async def test_a_missed_beat_is_not_made_up_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """After a second that was lost the next cycles come a period apart, not all at once."""
    world = World(math.inf)
    monkeypatch.setattr(metronome, "time", world)
    monkeypatch.setattr(metronome, "asyncio", world)
    beat = Metronome(world, PERIOD_S)  # type: ignore[arg-type]
    await beat.next()
    world.now_s += 1.0
    await beat.next()
    first = world.now_s
    await beat.next()
    assert world.now_s - first == pytest.approx(PERIOD_S, abs=WINDOW_S + 1e-9)
