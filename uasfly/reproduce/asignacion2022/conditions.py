"""The paper's vehicle, gust, and the three conditions DC1 to DC3 (Asignacion et al. 2022, simulation)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from uasfly.messages import Array
from uasfly.reproduce.asignacion2022.controller import Course
from uasfly.reproduce.asignacion2022.vehicle import SixFloats
from uasfly.wind.six_axes import SixAxisBody

BODY = SixAxisBody(mass_kg=1.477, inertia_kg_m2=(0.1152, 0.1152, 0.218), damping=5.5e-4)
"""The paper's k = 5.5e-4 is taken as a linear damping of all six axes; it is too small to change any figure."""

SPIRAL = Course(radius_m=2.0, turn_rad_s=0.5, climb_m_s=0.2)
"""The paper's spiral goes upward; its size is not known here."""

GUST_HZ = 0.1
GUST_AMPLITUDES: SixFloats = (2.0, 1.6, 0.8, 1.0, 0.8, 0.4)  # W: [N] x, y, z; [N m] roll, pitch, yaw


def gust(time_s: float, _: tuple[float, float, float]) -> SixFloats:
    """W sin(2 pi 0.1 t), its negative half cut to zero."""
    return _gust(max(0.0, math.sin(2.0 * math.pi * GUST_HZ * time_s)))


def sine(time_s: float, _: tuple[float, float, float]) -> SixFloats:
    """W sin(2 pi 0.1 t), all of it: what a phase can be measured on."""
    return _gust(math.sin(2.0 * math.pi * GUST_HZ * time_s))


def _gust(height: float) -> SixFloats:
    x, y, z, roll, pitch, yaw = GUST_AMPLITUDES
    return height * x, height * y, height * z, height * roll, height * pitch, height * yaw


@dataclass(frozen=True, slots=True)
class Condition:
    """How far the vehicle is from its model.

    Attributes:
        name: the paper's.
        axes: numbers of the uncertain ones.
        share: each one's dynamics are multiplied by 1 + U(-share, share).
        redrawn_rad_s: drawn anew, for each axis apart, every 2 pi / redrawn_rad_s seconds, and held between.
    """

    name: str
    axes: tuple[int, ...] = ()
    share: float = 0.0
    redrawn_rad_s: float = 1.0

    @property
    def held_s(self) -> float:
        """How long a draw stays [s]."""
        return 2.0 * math.pi / self.redrawn_rad_s

    @property
    def sigma(self) -> float:
        """Standard deviation of a draw."""
        return self.share / math.sqrt(3.0)

    def factors(self, rng: np.random.Generator, times_s: Array) -> list[SixFloats]:
        """The six 1 + delta at each of these times."""
        draws = np.floor(times_s / self.held_s).astype(int)
        delta = np.zeros((draws.max() + 1, 6))
        delta[:, self.axes] = rng.uniform(-self.share, self.share, (len(delta), len(self.axes)))
        return [(row[0], row[1], row[2], row[3], row[4], row[5]) for row in (1.0 + delta[draws]).tolist()]


DC1 = Condition("DC1")
DC2 = Condition("DC2", axes=(0, 3), share=0.2, redrawn_rad_s=100.0)
DC3 = Condition("DC3", axes=(0, 1, 2, 3, 4, 5), share=0.5, redrawn_rad_s=50.0)
