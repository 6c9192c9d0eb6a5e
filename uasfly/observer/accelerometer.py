"""What is learnt of the accelerometer in flight: its noise, and the bias that PX4 leaves in it.

The noise is mostly the rotors' shaking, which differs tenfold between vehicles; its variance is matched as those of the
other sensors are (eq. 8, 9 of Kalaitzakis & Vitzilaios 2023 in the form of `update`), one number for both axes of the
rotor plane.

The bias is what the readings and the measured motion differ by over seconds. Of motion it takes velocity and attitude,

    b' = (f - R' (v' + g) - b) / BIAS_TIME_S    along the body's x and y,

with no model in it, so that it cannot be talked into it by a force that has followed a wrong reading. v' is never
taken: the filter's step holds the change of v. As states the two would cost a third more of every step.
"""

from __future__ import annotations

import math

from uasfly.airframe import GRAVITY_M_S2
from uasfly.message_class import message
from uasfly.observer import states as s
from uasfly.observer.door import Odometry, SpecificForce

BIAS_TIME_S = 5.0  # longer than the slow errors of velocity and attitude
LARGEST_BIAS_M_S2 = 0.4  # PX4's own limit (EKF2_ABL_LIM): beyond it the sensor is broken, and not used
LONGEST_INTERVAL_S = 0.1


@message
class AccelerometerMemory:
    """What was learnt of the noise up to some time.

    Attributes:
        time_s: of the last sample.
        variance: [m^2/s^4] of a sample, each axis, as matched.
    """

    time_s: float
    variance: float

    def after(self, time_s: float, sample: float, window_s: float) -> AccelerometerMemory:
        """What is known after one more sample.

        Args:
            time_s: its time.
            sample: [m^2/s^4] what it says of the variance.
            window_s: of the covariance matching.
        """
        elapsed_s = min(max(time_s - self.time_s, 0.0), LONGEST_INTERVAL_S)
        weight = 1.0 - math.exp(-2.0 * elapsed_s / window_s)
        return AccelerometerMemory(time_s, self.variance + weight * (sample - self.variance))


def nothing_learnt(sigma_m_s2: float) -> AccelerometerMemory:
    """The configured sigma."""
    return AccelerometerMemory(-math.inf, sigma_m_s2**2)


class BiasWatch:
    """Learns the bias; call `move` and `corrected` with what comes, in flight.

    Attributes:
        x, y: bias [m/s^2] along the body's axes, measured minus true.
    """

    def __init__(self) -> None:
        self.x = self.y = 0.0
        self._moved: Odometry | None = None
        self._felt: SpecificForce | None = None

    def corrected(self, felt: SpecificForce) -> SpecificForce | None:
        """Take in a reading; it comes back without the bias, or not at all where it contradicts the motion."""
        self._felt = felt
        if not (abs(self.x) < LARGEST_BIAS_M_S2 and abs(self.y) < LARGEST_BIAS_M_S2):
            return None
        x, y, z = felt.force
        return SpecificForce(felt.time_s, [x - self.x, y - self.y, z])

    def move(self, now: Odometry) -> None:
        """Take in an odometry sample."""
        if not (now.use[s.ATTITUDE_SENSOR] and now.use[s.VELOCITY_SENSOR]):
            return
        before, felt, self._moved = self._moved, self._felt, now
        if before is None or felt is None:
            return
        elapsed_s = now.time_s - before.time_s
        if not (0.0 < elapsed_s < LONGEST_INTERVAL_S and abs(now.time_s - felt.time_s) < LONGEST_INTERVAL_S):
            return
        (vx, vy, vz), (ux, uy, uz) = now.velocity, before.velocity
        x, y = _in_plane(before.quaternion, now.quaternion, (vx - ux, vy - uy, vz - uz + GRAVITY_M_S2 * elapsed_s))
        share = elapsed_s / BIAS_TIME_S
        self.x += (elapsed_s * felt.force[0] - x) / BIAS_TIME_S - share * self.x
        self.y += (elapsed_s * felt.force[1] - y) / BIAS_TIME_S - share * self.y


def _in_plane(one: list[float], other: list[float], vector: tuple[float, float, float]) -> tuple[float, float]:
    """A vector of the world along the body's x and y, half way between two attitudes that are close."""
    a, b, c, d = one
    e, f, g, h = other
    sign = 1.0 if a * e + b * f + c * g + d * h >= 0.0 else -1.0
    w, x, y, z = a + sign * e, b + sign * f, c + sign * g, d + sign * h
    double = 2.0 / (w * w + x * x + y * y + z * z)
    east, north, up = vector
    along_x = (1.0 - double * (y * y + z * z)) * east + double * ((x * y + w * z) * north + (x * z - w * y) * up)
    along_y = (1.0 - double * (x * x + z * z)) * north + double * ((x * y - w * z) * east + (y * z + w * x) * up)
    return along_x, along_y
