"""What a bad link does to each message, without sockets: both ends of a simulated link ask here."""

from __future__ import annotations

import numpy as np

from uasfly.sim.faults import (
    Duplicates,
    Garbage,
    LinkFault,
    Loss,
    OddAcknowledgement,
    Reorder,
    SetpointsHalved,
    Silence,
)

GARBAGE_BYTES = 64
GARBAGE_AT_ONCE = 20
ON_TIME = (0.0,)


class LinkFaults:
    """Faults of one link that are active now.

    Args:
        rng: decides about each message; it is asked only while a fault is active.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._active: list[LinkFault] = []
        self._odd: list[int] = []
        self._setpoints = 0
        self._garbage_s: float | None = None

    def begin(self, fault: LinkFault) -> None:
        """Let a fault act from now on."""
        if isinstance(fault, OddAcknowledgement):
            self._odd += [fault.result] * fault.count
        else:
            self._active = [*self._active, fault]

    def end(self, fault: LinkFault) -> None:
        """Let it act no more."""
        self._active = [other for other in self._active if other is not fault]
        self._garbage_s = None

    def telemetry(self) -> tuple[float, ...]:
        """Delays [s] of the copies of one message from the vehicle that get through; none where it is lost."""
        return self._copies("telemetry") if self._active else ON_TIME

    def command(self, is_setpoint: bool) -> tuple[float, ...]:
        """The same for one message to the vehicle."""
        if not self._active:
            return ON_TIME
        if is_setpoint and any(isinstance(fault, SetpointsHalved) for fault in self._active):
            self._setpoints += 1
            if self._setpoints % 2:
                return ()
        return self._copies("commands")

    def acknowledgement(self) -> int | None:
        """The result that the next command is to be answered with, None for the true one."""
        return self._odd.pop(0) if self._odd else None

    def garbage(self, now_s: float) -> list[bytes]:
        """Random bytes to be sent now."""
        rate_hz = sum(fault.rate_hz for fault in self._active if isinstance(fault, Garbage))
        if not rate_hz:
            return []
        if self._garbage_s is None:
            self._garbage_s = now_s
        bursts = min(int((now_s - self._garbage_s) * rate_hz), GARBAGE_AT_ONCE)
        self._garbage_s = now_s if bursts == GARBAGE_AT_ONCE else self._garbage_s + bursts / rate_hz
        return [self._rng.bytes(int(self._rng.integers(1, GARBAGE_BYTES + 1))) for _ in range(bursts)]

    def _copies(self, direction: str) -> tuple[float, ...]:
        copies, delay_s = 1, 0.0
        for fault in self._active:
            match fault:
                case Silence():
                    if fault.direction in ("both", direction):
                        return ()
                case Loss():
                    if fault.direction in ("both", direction) and self._rng.random() < fault.share:
                        return ()
                case Duplicates():
                    copies += self._rng.random() < fault.share
                case Reorder():
                    if self._rng.random() < fault.share:
                        delay_s = fault.delay_s
        return (delay_s,) * copies
