"""When frames are exposed, when they arrive, and which never do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uasfly.sim.camera.settings import CameraSettings


@dataclass(frozen=True, slots=True)
class Shot:
    """One opening of the shutter.

    Attributes:
        sequence: counts every one, also those whose frames are lost.
        exposed_s: its middle.
        arrives_s: when the frame is there; None where it is lost.
    """

    sequence: int
    exposed_s: float
    arrives_s: float | None


class FrameClock:
    """The shots of one camera, one after the other.

    Args:
        settings: rate, jitter, losses and silences.
        latency_s: arrival minus mid-exposure.
        rng: draws the phase, the jitter and the losses.

    Attributes:
        next_s: middle of the next shot.
    """

    def __init__(self, settings: CameraSettings, latency_s: float, rng: np.random.Generator) -> None:
        self._settings = settings
        self._latency_s = latency_s
        self._rng = rng
        self._period_s = 1.0 / settings.rate_hz
        self._phase_s = self._period_s * float(rng.random())
        self._count = 0
        self._last_arrival_s = 0.0
        self.next_s = self._phase_s

    def shoot(self, since_s: float) -> Shot:
        """The next shot; arrivals keep the order of the shots.

        Args:
            since_s: time on the schedule's clock; negative before it runs.
        """
        settings, exposed_s, sequence = self._settings, self.next_s, self._count
        self._count += 1
        self.next_s = self._phase_s + self._count * self._period_s
        lost, extra = self._rng.random(2).tolist()
        silent = any(silence.start_s <= since_s < silence.end_s for silence in settings.silences)
        if silent or lost < settings.drop_share:
            return Shot(sequence, exposed_s, None)
        arrives_s = max(self._last_arrival_s, exposed_s + self._latency_s + settings.jitter_s * extra)
        self._last_arrival_s = arrives_s
        return Shot(sequence, exposed_s, arrives_s)
