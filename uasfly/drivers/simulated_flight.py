"""Simulated vehicle, in-process link and pilot, one control cycle after the other; deterministic, on no clock."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from uasfly.drivers.eyes import Eyes, NoEyes
from uasfly.flight.pilot import Pilot, StepResult
from uasfly.link.in_process import InProcessLink
from uasfly.messages import Sample, TruthSample
from uasfly.sim.scenario import Link
from uasfly.sim.vehicle import SimulatedVehicle


@dataclass(frozen=True, slots=True)
class FlownCycle:
    """One control cycle.

    Attributes:
        now_s: its time. samples: what the pilot took in. truth: how things were then. result: what the pilot gave.
        cycle_ms: time of the pilot's step and of sending what it gave, by the machine's clock.
    """

    now_s: float
    samples: tuple[Sample, ...]
    truth: TruthSample
    result: StepResult
    cycle_ms: float


class SimulatedFlight:
    """Flies a pilot.

    Args:
        vehicle: what is flown.
        settings: latencies of the link.
        pilot: who flies.
        rate_hz: of the control cycle.
        seed: of the link.
        eyes: what the flight sees with.
        begins_s: the vehicle stands for so long before the first cycle; what it says then is not heard.
    """

    def __init__(
        self,
        vehicle: SimulatedVehicle,
        settings: Link,
        pilot: Pilot,
        rate_hz: float,
        seed: int,
        *,
        eyes: Eyes | None = None,
        begins_s: float = 0.0,
    ) -> None:
        self._link = InProcessLink(
            vehicle,
            telemetry_latency_s=settings.telemetry_latency_s,
            command_latency_s=settings.command_latency_s,
            jitter_s=settings.jitter_s,
            rng=np.random.default_rng([seed, 7]),
        )
        self._pilot, self._eyes = pilot, eyes or NoEyes()
        self._period_s, self._begins_s = 1.0 / rate_hz, begins_s
        self._cycles = 0
        if begins_s > 0.0:
            self._link.advance_to(begins_s)
            self._link.poll()

    def lasted(self, longest_s: float) -> bool:
        """Whether it has been flown for so long."""
        return self._cycles * self._period_s >= longest_s

    def cycle(self) -> FlownCycle:
        """Fly the next control cycle."""
        self._cycles += 1
        link, now_s = self._link, self._begins_s + self._cycles * self._period_s
        link.advance_to(now_s)
        truth = link.truth()
        samples = link.poll() + self._eyes.look(now_s)
        begun = time.perf_counter()
        result = self._pilot.step(now_s, samples)
        if result.setpoint is not None:
            link.send(result.setpoint)
        for request in result.requests:
            link.request(request)
        return FlownCycle(now_s, samples, truth, result, (time.perf_counter() - begun) * 1e3)
