"""How much has to be uncertain for the lower cut-off to be the better one.

An uncertainty delta that is held for T, with variance s^2 / 3 (uniform within +-s), reaches the observer as the
disturbance delta u, where u is the axis' dynamics of the model: what the inputs do, mostly to balance the gust. Through
a low pass with the cut-off a, so held, a share

    h(a T) = 1 - (1 - exp(-a T)) / (a T)

of its variance is left. It adds to the error that the observer has without uncertainty, e (its lag). So DP1 (a_1, e_1)
errs less than DP2 (a_2, e_2) where

    RMS(u)^2 s^2 / 3  >=  (e_1^2 - e_2^2) / (h(a_2 T) - h(a_1 T)).

On DC2's roll axis that takes 0.55 N m; balancing the gust takes 0.50 (1 N m times a half-wave's 0.5), and the spiral
next to nothing, for it turns slowly: DP2 stays ahead by 5 % (mean of seeds 1 to 10). On x the spiral's centripetal
force makes the difference: 1.25 N where 1.09 are needed. No other holding time would do: at best, 0.08 s, roll takes
0.54 N m.

Other readings of "times 1 + U(-0.2, 0.2) at 100 rad/s" and of what the paper does not state were flown. RMSE of DP2
over that of DP1 in DC2, mean of seeds 1 to 10, both to be above 1:

                                                                     x  roll
    held for 2 pi / 100 s, the gust not multiplied (as here)      1.11  0.95
    the gust multiplied too                                       0.58  0.11   (and below 1 on four axes in DC3)
    held for pi / 100 s                                           1.02  0.88
    held for 1 / 100 s                                            0.76  0.62
    linear from draw to draw                                      0.98  0.84
    a sine of 100 rad/s, its amplitude drawn every period         0.66  0.54
    drawn every step, low-passed at 100 rad/s                     0.43  0.35
    the same, with the variance of U(-0.2, 0.2) after it          0.91  0.74
    W as accelerations (m/s^2, rad/s^2)                           1.05  1.01   (roll: 0.95 to 1.11 from seed to seed)
    observers sampled at 50 Hz, exactly                           1.11  0.95
    observers sampled at 50 Hz, Euler's method                    1.33  1.14   (but 0.2 deg of lag at 0.1 Hz for 10 Hz)
    spiral of 1 m at 0.5 rad/s (0.25 m/s^2)                       1.05  0.95
    spiral of 1 m at 1 rad/s (1 m/s^2)                            1.25  0.95
    spiral of 2 m at 1 rad/s (2 m/s^2)                            1.59  0.95
    spiral of 1 m at 2 rad/s (4 m/s^2)                            1.96  0.98
    spiral of 0.5 m at 3 rad/s (4.5 m/s^2)                        1.99  1.14

None is adopted. The gust as accelerations leaves roll level, the sign a matter of the seed; Euler's method loses the
paper's phase lag, the only number of its simulation that is known here; and a spiral that turns so fast would be chosen
for what it gives.
"""

from __future__ import annotations

import math

from uasfly.reproduce.asignacion2022.conditions import Condition


def share_left(cutoff_rad_s: float, held_s: float) -> float:
    """Share of the variance of independent draws, each held for so long, that is left behind a first-order low pass."""
    turns = cutoff_rad_s * held_s
    return 1.0 + math.expm1(-turns) / turns


def least_input(condition: Condition, low: tuple[float, float], high: tuple[float, float]) -> float:
    """RMS of an uncertain axis' dynamics, in the unit of the errors, from which on the low cut-off errs less.

    Args:
        condition: how uncertain.
        low: cut-off [rad/s] of the observer with the low one, and its RMSE without uncertainty.
        high: the same of the observer with the high one.
    """
    (low_rad_s, low_error), (high_rad_s, high_error) = low, high
    lag = low_error**2 - high_error**2
    noise = share_left(high_rad_s, condition.held_s) - share_left(low_rad_s, condition.held_s)
    return math.sqrt(max(0.0, lag) / noise) / condition.sigma
