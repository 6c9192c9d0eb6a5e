"""A mount that moves against the body: it sways in the wind and vibrates with the rotors."""

from __future__ import annotations

import math

import numpy as np

from uasfly.messages import Array
from uasfly.sim.camera.settings import MountMotion


class Mount:
    """Angles of a mount against the body, on the body's three axes.

    The sway is a first-order Gauss-Markov process; the vibration a sine of fixed amplitude and random phase.

    Args:
        settings: how large they are.
        rng: draws the sway and the phases.
    """

    def __init__(self, settings: MountMotion, rng: np.random.Generator) -> None:
        self._sway_rad = math.radians(settings.sway_deg)
        self._sway_time_s = settings.sway_time_s
        self._amplitude_rad = math.radians(settings.vibration_deg) * math.sqrt(2.0)
        self._circular_rate = 2.0 * math.pi * settings.vibration_hz
        self._phases = rng.uniform(0.0, 2.0 * math.pi, 3)
        self._rng = rng
        self._sway = self._sway_rad * rng.standard_normal(3)
        self._time_s = -math.inf

    def at(self, time_s: float, exposure_s: float) -> tuple[Array, Array]:
        """Rotation vector (3,) [rad] and its rate (3,) [rad/s], both on the body's axes.

        The rate is that of the chord over the exposure; the sway is slow and adds none.

        Args:
            time_s: mid-exposure; not before that of the last call.
            exposure_s: time the shutter is open.
        """
        keep = math.exp(-(time_s - self._time_s) / self._sway_time_s)
        fresh = math.sqrt(1.0 - keep * keep) * self._sway_rad * self._rng.standard_normal(3)
        self._sway = keep * self._sway + fresh
        self._time_s = time_s
        span_s = max(exposure_s, 1e-6)
        before, after = (self._vibration(time_s + sign * 0.5 * span_s) for sign in (-1.0, 1.0))
        return self._sway + 0.5 * (before + after), (after - before) / span_s

    def _vibration(self, time_s: float) -> Array:
        return np.asarray(self._amplitude_rad * np.sin(self._circular_rate * time_s + self._phases), dtype=float)
