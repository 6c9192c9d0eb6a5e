"""What the filter keeps of its accelerometer: how noisy it is, and the bias that PX4 leaves in it.

Both are learnt in flight from the innovations. The noise is mostly the rotors' shaking, which differs tenfold between
vehicles; its variance is matched as those of the other sensors are (eq. 8, 9 of Kalaitzakis & Vitzilaios 2023 in the
form of `update`), one number for both axes of the rotor plane. The bias is the innovations' slow mean: over seconds
velocity and attitude know the force better, so that an innovation that stays is the accelerometer's error. As a state
it would cost a third more of every step; kept aside it changes a hundred times more slowly than the force.
"""

from __future__ import annotations

import math

from uasfly.message_class import message

BIAS_TIME_S = 4.0  # in which an innovation that stays becomes bias: as long as the slow errors of velocity and attitude
LARGEST_BIAS_M_S2 = 0.4  # PX4's own limit (EKF2_ABL_LIM)
LONGEST_INTERVAL_S = 0.1

Pair = tuple[float, float]


@message
class AccelerometerMemory:
    """What was learnt up to some time.

    Attributes:
        time_s: of the last sample.
        bias: (2,) [m/s^2] along the body's x and y, measured minus true.
        variance: [m^2/s^4] of a sample, each axis, as matched.
    """

    time_s: float
    bias: Pair
    variance: float

    def after(
        self, time_s: float, residual: Pair, sample: float, accepted: bool, window_s: float
    ) -> AccelerometerMemory:
        """What is known after one more sample.

        Args:
            time_s: its time.
            residual: (2,) [m/s^2] innovation, without the bias so far.
            sample: [m^2/s^4] what it says of the variance.
            accepted: whether the gate let it in; otherwise the bias stays.
            window_s: of the covariance matching.
        """
        elapsed_s = min(max(time_s - self.time_s, 0.0), LONGEST_INTERVAL_S)
        variance = self.variance + (1.0 - math.exp(-2.0 * elapsed_s / window_s)) * (sample - self.variance)
        if not accepted:
            return AccelerometerMemory(time_s, self.bias, variance)
        share = elapsed_s / BIAS_TIME_S
        (x, y), (dx, dy) = self.bias, residual
        return AccelerometerMemory(time_s, (_limited(x + share * dx), _limited(y + share * dy)), variance)


def nothing_learnt(sigma_m_s2: float) -> AccelerometerMemory:
    """No bias, and the configured sigma."""
    return AccelerometerMemory(-math.inf, (0.0, 0.0), sigma_m_s2**2)


def _limited(bias: float) -> float:
    return min(max(bias, -LARGEST_BIAS_M_S2), LARGEST_BIAS_M_S2)
