"""How fast the wind force walks: the filter's process noise follows the gusts that it measures, axis by axis.

The filter takes the force for a random walk of some density. When that density is right, the estimate itself walks so:
its corrections are white (innovation property, Kailath 1968), in steady state K S K' = Q dt, so that its increments
over a lag have the variance density^2 * lag. Where gusts are stronger the increments are larger, although the estimate
lags behind; in calm air they are smaller, although noise shakes it. So their mean square over the lag leads the density
to where filter and gusts agree. A sudden wind is not waited for: one increment out of the common raises it at once.

The configured density is the least. A calmer filter would be right in light wind and slow when a jet hits.
"""

from __future__ import annotations

import math

from uasfly.message_class import message

LAG_S = 0.5  # about the filter's own memory: a shorter one shows noise, a longer one only the slow part of gusts
MEMORY_S = 5.0  # of the mean square: some gusts, so that no single event (contact, a fault of GNSS) stays for long
SURPRISE_SIGMAS = 3.0  # an increment beyond this is out of the common
MOST = 3.0  # densities stay below this multiple of the configured one: setpoints get noisy, and tracking gains no more
# Gusts from below are as short as height over wind speed (Dryden, MIL-F-8785C), some tenths of a second near the
# ground. They are gone before thrust has answered them; a force that followed them all would make thrust chase its own
# lag. So the variance of the unmodelled vertical acceleration goes with this power of the force's: its gain falls.
VERTICAL_POWER = 1.5
SPACING_S = 0.035  # of the estimates that are looked at: more say nothing more of increments over the lag
LONGEST_ELAPSED_S = 0.2  # without an estimate: what was before is not compared

Vector = tuple[float, float, float]


@message
class Gusts:
    """The gusts as measured up to some time.

    Attributes:
        shares: (3,) variance of the force's walk over the configured one, 1 to MOST^2, world axes.
        past: times and forces (3,) [m/s^2, world] of the last LAG_S, oldest first.
    """

    shares: Vector = (1.0, 1.0, 1.0)
    past: tuple[tuple[float, Vector], ...] = ()

    def after(self, time_s: float, force: Vector, density: float) -> Gusts:
        """The gusts after one more estimate.

        Args:
            time_s: its time, not before the last.
            force: (3,) [m/s^2, world].
            density: [m/s^2/sqrt(s)] configured for the force.
        """
        past = self.past
        elapsed_s = time_s - past[-1][0] if past else SPACING_S
        if elapsed_s < SPACING_S:
            return self
        if elapsed_s > LONGEST_ELAPSED_S:
            past = ()
        first = 0
        while first + 1 < len(past) and past[first + 1][0] <= time_s - LAG_S:
            first += 1
        past = (*past[first:], (time_s, force))
        start_s, start = past[0]
        lag_s = time_s - start_s
        if lag_s < LAG_S:
            return Gusts(self.shares, past)
        weight, unit = 1.0 - math.exp(-elapsed_s / MEMORY_S), density * density * lag_s
        (x, y, z), (now_x, now_y, now_z), (then_x, then_y, then_z) = self.shares, force, start
        shares = (
            _next_share(x, (now_x - then_x) ** 2 / unit, weight),
            _next_share(y, (now_y - then_y) ** 2 / unit, weight),
            _next_share(z, (now_z - then_z) ** 2 / unit, weight),
        )
        return Gusts(shares, past)

    def motion_noise(self, force_density: float, acceleration_density: float) -> tuple[float, ...]:
        """Variances a second (6,) of force [m^2/s^4/s] and acceleration [m^2/s^4/Hz], world axes.

        Args:
            force_density: [m/s^2/sqrt(s)] configured.
            acceleration_density: [m/s^2/sqrt(Hz)] configured.
        """
        force, acceleration = force_density * force_density, acceleration_density * acceleration_density
        x, y, z = self.shares
        return force * x, force * y, force * z, acceleration, acceleration, acceleration * z**VERTICAL_POWER


AS_CONFIGURED = Gusts()


def _next_share(share: float, increment: float, weight: float) -> float:
    """Variance of the walk over the configured one, after an increment squared over its configured variance."""
    mean = share + weight * (increment - share)
    return min(max(mean, increment / SURPRISE_SIGMAS**2, 1.0), MOST**2)
