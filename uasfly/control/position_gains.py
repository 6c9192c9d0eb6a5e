"""Gains of the position PIDs of Waslander & Wang 2009, by a rule from the attitude loop; the paper gives none.

Tilt answers a command with a dead time d and a lag tau, so position answers like 1 / (s^2 (T s + 1)) with T = d + tau,
and a PID closes the loop to T s^4 + s^3 + kd s^2 + kp s + ki. Naslin's double ratios, a_i^2 = 2 a_(i-1) a_(i+1) for all
coefficients, give kd = 1/(2 T), kp = 1/(8 T^2), ki = 1/(64 T^3): as fast as that lag allows, always damped alike.

The double derivative, -k a with the measured acceleration a, makes the vehicle (1 + k) times as heavy against
wind, and the lag of the loop from wanted to flown acceleration (1 + k) times as short. Dead time d and the filter F of
the acceleration stay: T = d + F + tau / (1 + k), and the three gains grow (1 + k) fold beside. k itself is limited by
the dead time: tau / (3 d), at most 1, leaves the whole loop 10 dB of gain and 50 deg of phase on each shipped airframe.
"""

from __future__ import annotations

from dataclasses import dataclass

from uasfly.airframe import Backup, ModelParameters, Pid

ACCELERATION_FILTER_S = 0.05
LARGEST_DOUBLE_DERIVATIVE = 1.0


@dataclass(frozen=True, slots=True)
class PositionGains:
    """Gains of the PIDs [m/s^2 and its parts], and of the horizontal acceleration (k above, no unit)."""

    pid: Backup
    double_derivative: float


def position_gains(model: ModelParameters, backup: Backup, *, double_derivative: bool) -> PositionGains:
    """Gains for an airframe.

    The rule is for the horizontal axes. The thrust answers without an attitude loop between, so height keeps the gains
    of the airframe file, and no double derivative; so do the limits of the integrals.
    """
    lag_s = max(model.roll.tau_s, model.pitch.tau_s)
    dead_s = model.command_delay_s
    gain = 0.0
    total_s = dead_s + lag_s
    if double_derivative:
        gain = min(LARGEST_DOUBLE_DERIVATIVE, lag_s / (3.0 * max(dead_s, 1e-3)))
        total_s = dead_s + ACCELERATION_FILTER_S + lag_s / (1.0 + gain)
    horizontal = Pid(
        kp=(1.0 + gain) / (8.0 * total_s**2),
        ki=(1.0 + gain) / (64.0 * total_s**3),
        kd=(1.0 + gain) / (2.0 * total_s),
        integral_limit=backup.horizontal.integral_limit,
    )
    return PositionGains(Backup(horizontal=horizontal, vertical=backup.vertical), gain)
