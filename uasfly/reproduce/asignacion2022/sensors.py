"""The vehicle of the paper's experiment, and the errors of what it measures.

The paper gives 2.5 kg, wind of 8 m/s and samples at 50 Hz, but neither sensors nor noise. Wander, rates and attitude
are those that uasfly's scenarios have as a rule. White noise of the velocity decides how noisy the estimates are:
uasfly's scenarios have 0.02 m/s; a recording of PX4's own simulator has 0.0006 to 0.0024 m/s. Accelerometers, with the
rotors' vibration, are assumed to be white with 0.3 m/s^2.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.signal import lfilter

from uasfly.messages import Array
from uasfly.sim.scenario import Sensors
from uasfly.wind.six_axes import SixAxisBody

FLOWN_BODY = SixAxisBody(mass_kg=2.5, inertia_kg_m2=(0.1152, 0.1152, 0.218))  # moments: of the paper's simulation
SAMPLE_S = 0.02
ACCELEROMETER_M_S2 = 0.3
_SENSORS = Sensors(position="mocap", position_noise_m=0.0)
USUAL_VELOCITY_M_S = _SENSORS.velocity_noise_m_s  # white, in uasfly's scenarios


class SensorNoise:
    """Errors of a whole flight, drawn beforehand, so that every observer meets the same.

    Args:
        rng: where they come from.
        count: n, how many samples `SAMPLE_S` apart.

    Attributes:
        velocity: (n, 3), white with variance 1: to be scaled.
        state: (n, 6), everything else of velocity [m/s] and rates [rad/s].
        rotation_rad: (n, 3) small rotations of the attitude in the body.
        acceleration_m_s2: (n, 3).
    """

    def __init__(self, rng: np.random.Generator, count: int) -> None:
        decay = math.exp(-SAMPLE_S / _SENSORS.wander_time_s)

        def white(sigma: float) -> Array:
            return sigma * rng.standard_normal((count, 3))

        def wander(sigma: float) -> Array:
            """First-order Gauss-Markov, stationary from the first sample."""
            drive = white(sigma) * math.sqrt(1.0 - decay * decay)
            drive[0] /= math.sqrt(1.0 - decay * decay)
            walked: Array = lfilter((1.0,), (1.0, -decay), drive, axis=0)
            return walked

        self.velocity = white(1.0)
        self.state = np.hstack((wander(_SENSORS.velocity_wander_m_s), white(_SENSORS.angular_rate_noise_rad_s)))
        self.rotation_rad = white(_SENSORS.attitude_noise_rad) + wander(_SENSORS.attitude_wander_rad)
        self.acceleration_m_s2 = white(ACCELEROMETER_M_S2)
