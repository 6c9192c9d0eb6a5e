"""Something carries the vehicle although PX4 still calls it in the air: for about a second after touch-down.

The model then has it fall, the velocity says that it stands, and neither is noise. Falling shows: with half of its
weight carried by nobody a vehicle is faster than SLOW_M_S after 0.03 s, and passes through rest in 0.06 s.
"""

from __future__ import annotations

import math

from uasfly.airframe import GRAVITY_M_S2

LIGHT_M_S2 = 0.5 * GRAVITY_M_S2  # less holds no vehicle up, however wrong its file may be about the thrust
SLOW_M_S = 0.15
CONFIRMED_S = 0.15
LATELY_S = 0.2  # longer than the monitors look away


class GroundContact:
    """Whether the vehicle stands on something, from thrust and measured velocity.

    Attributes:
        stands: whether it does.
    """

    def __init__(self) -> None:
        self._since_s: float | None = None
        self._looked_s = self._stood_s = -math.inf
        self.stands = False

    @property
    def stood_lately(self) -> bool:
        """Whether it stands or has stood within LATELY_S: a vehicle that is held to the ground hops."""
        return 0.0 <= self._looked_s - self._stood_s < LATELY_S

    def look(self, time_s: float, climb_m_s: float, thrust_m_s2: float) -> None:
        """A sample of the vertical velocity, and the thrust that acted before it."""
        self._looked_s = time_s
        if thrust_m_s2 > LIGHT_M_S2 or abs(climb_m_s) > SLOW_M_S:
            self._since_s = None
            self.stands = False
            return
        if self._since_s is None or time_s < self._since_s:
            self._since_s = time_s
        self.stands = time_s - self._since_s >= CONFIRMED_S
        if self.stands:
            self._stood_s = time_s
