"""What the filter thinks of its own work: how sure it is, what it refuses, what it has taken for errors of GNSS."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

import numpy as np

from uasfly.messages import Array
from uasfly.observer import states as s
from uasfly.observer.moment import Moment, Verdict


@dataclass(slots=True)
class Diagnosis:
    """The filter at one time.

    Attributes:
        position_sigma_m: (3,) of the position, or of position and GNSS bias together where that is known better: an
            error that GNSS has had from the beginning moves the whole mission and is no loss of knowledge.
        velocity_sigma_m_s: (3,).
        rejected_share: share of each sensor's measurements outside its gate, over the window.
        nis_mean: mean normalised innovation squared over its degrees of freedom; about 1 or less when consistent.
        jump_m, jump_s: size and time of the last step of the measured position that was taken as an error of GNSS.
        drift_m_s: speed at which the measured position runs away from the velocity, mean over a second.
        agrees: whether measured position and velocity tell the same motion.
        blind_s: time since a position or a marker was accepted.
        restarts: times that the filter started again.
    """

    position_sigma_m: Array
    velocity_sigma_m_s: Array
    rejected_share: dict[str, float]
    nis_mean: dict[str, float]
    jump_m: float
    jump_s: float
    drift_m_s: float
    agrees: bool
    blind_s: float
    restarts: int


@dataclass(slots=True)
class _Tally:
    """One sensor's last measurements, with running sums."""

    entries: deque[tuple[float, bool, float]] = field(default_factory=deque)
    rejected: int = 0
    nis: float = 0.0

    def add(self, time_s: float, rejected: bool, nis: float) -> None:
        self.entries.append((time_s, rejected, nis))
        self.rejected += rejected
        self.nis += nis

    def forget_before(self, time_s: float) -> None:
        entries = self.entries
        while entries and entries[0][0] < time_s:
            _, rejected, nis = entries.popleft()
            self.rejected -= rejected
            self.nis -= nis
        if not entries:
            self.nis = 0.0  # sums of floats do not come back to zero by themselves


class Journal:
    """Keeps what a diagnosis is made of; `note` is called with each measurement, so it is short."""

    def __init__(self) -> None:
        self._tallies: dict[str, _Tally] = {}
        self._biases: deque[tuple[float, float, float, float]] = deque()  # time and bias, without markers
        self._jump: tuple[float, float] = (0.0, -math.inf)
        self._seen_s = -math.inf

    def note(self, time_s: float, verdict: Verdict) -> None:
        """A measurement was looked at."""
        tally = self._tallies.get(verdict.sensor)
        if tally is None:
            tally = self._tallies[verdict.sensor] = _Tally()
        tally.add(time_s, not verdict.accepted, min(verdict.nis / verdict.dof, LARGEST_NIS))
        if verdict.accepted and verdict.sensor in _PLACES:
            self._seen_s = time_s

    def follow(self, time_s: float, moment: Moment) -> None:
        """Look at the GNSS bias: without a marker it moves only when the measured position jumps or runs away."""
        biases = self._biases
        if moment.markers:
            biases.clear()  # a marker shows the bias that was there all along
            return
        x, y, z = moment.packed[s.BIAS].tolist()
        if biases and (x, y, z) == biases[-1][1:]:
            return
        biases.append((time_s, x, y, z))
        if len(biases) > 1:
            step = math.dist(self._biases_at(time_s - JUMP_WINDOW_S), (x, y, z))
            grows = step > self._jump[0] or time_s - self._jump[1] > JUMP_WINDOW_S
            if step > SMALLEST_JUMP_M and grows:
                self._jump = step, time_s

    def _biases_at(self, time_s: float) -> tuple[float, float, float]:
        """The bias at a time, the oldest known where that is later."""
        for k in range(len(self._biases) - 1, 0, -1):
            if self._biases[k - 1][0] <= time_s:
                return self._biases[k - 1][1:]
        return self._biases[0][1:]

    def diagnose(
        self, time_s: float, moment: Moment, window_s: float, drift_m_s: float, agrees: bool, restarts: int
    ) -> Diagnosis:
        """The diagnosis at a time; the window must be the same in every call."""
        for tally in self._tallies.values():
            tally.forget_before(time_s - window_s)
        biases = self._biases
        while len(biases) > 1 and biases[1][0] < time_s - JUMP_WINDOW_S:
            biases.popleft()
        variances, position_with_bias = moment.variances
        position_sigmas = []
        for position, bias, both in zip(variances[s.D_POSITION], variances[s.D_BIAS], position_with_bias, strict=True):
            position_sigmas.append(math.sqrt(min(position, max(position + bias + 2.0 * both, 0.0))))
        return Diagnosis(
            position_sigma_m=np.array(position_sigmas),
            velocity_sigma_m_s=np.array([math.sqrt(variance) for variance in variances[s.D_VELOCITY]]),
            rejected_share={k: t.rejected / len(t.entries) if t.entries else 0.0 for k, t in self._tallies.items()},
            nis_mean={k: t.nis / len(t.entries) if t.entries else math.nan for k, t in self._tallies.items()},
            jump_m=self._jump[0],
            jump_s=self._jump[1],
            drift_m_s=drift_m_s,
            agrees=agrees,
            blind_s=time_s - self._seen_s,
            restarts=restarts,
        )


JUMP_WINDOW_S = 1.0
SMALLEST_JUMP_M = 0.3
LARGEST_NIS = 1e3  # one wild measurement must not hide what the others say
_PLACES = frozenset({s.SENSORS[s.POSITION_SENSOR], s.MARKER_SENSOR})
