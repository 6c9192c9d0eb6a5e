"""The filter's door: what comes in is finite and plausible, or it stays outside."""

from __future__ import annotations

import math
from operator import mul

import numpy as np

from uasfly.message_class import message
from uasfly.messages import AccelerometerSample, Array, MarkerSample, OdometrySample

_LARGEST_SQUARED = 1e14  # of m: beyond it a number is as good as infinite
_FASTEST_SQUARED = 1e6  # of m/s: no vehicle is as fast
_TURNS_SQUARED = 40.0**2  # of rad/s: a flight controller's gyro ends at 35, and no gate holds back what is beyond it
_SHOCKS_SQUARED = 160.0**2  # of m/s^2: PX4's accelerometers end there (16 g)
_NORM_TOLERANCE = 0.05  # a quaternion further from unit length is no rotation


_ALL = (1.0, 1.0, 1.0)


@message
class Odometry:
    """What can be used of an OdometrySample.

    Attributes:
        time_s: when it was true.
        position: (3,) m, velocity: (3,) m/s, world; zeros where not used.
        quaternion: (4,) body to world, unit length; identity where not used.
        rate: (3,) rad/s, body; None where it cannot be used.
        use: attitude, position, velocity (the order of states.SENSORS): 1.0 where used, else 0.0.
        velocity_factor: on the variance of the velocity.
    """

    time_s: float
    position: list[float]
    velocity: list[float]
    quaternion: list[float]
    rate: list[float] | None
    use: tuple[float, float, float]
    velocity_factor: float = 1.0

    @property
    def complete(self) -> bool:
        """Whether every part can be used."""
        return self.rate is not None and self.use == _ALL


def plausible(values: list[float], largest_squared: float = _LARGEST_SQUARED) -> bool:
    """Whether every number is finite and none is absurdly large."""
    total: float = sum(map(mul, values, values))
    return total < largest_squared  # False for NaN


def checked_odometry(sample: OdometrySample) -> Odometry | None:
    """The usable parts of a sample; None where its time cannot be used or nothing is left."""
    position, velocity = sample.position_in_world.tolist(), sample.velocity_in_world.tolist()
    rate: list[float] | None = sample.angular_rate_in_body.tolist()
    quaternion = unit_quaternion(sample.quaternion_body_to_world.tolist())
    use_position, use_velocity = plausible(position), plausible(velocity, _FASTEST_SQUARED)
    if rate is not None and not plausible(rate, _TURNS_SQUARED):
        rate = None
    if not math.isfinite(sample.time_s) or not (quaternion or use_position or use_velocity):
        return None
    return Odometry(
        time_s=sample.time_s,
        position=position if use_position else [0.0, 0.0, 0.0],
        velocity=velocity if use_velocity else [0.0, 0.0, 0.0],
        quaternion=quaternion or [1.0, 0.0, 0.0, 0.0],
        rate=rate,
        use=(float(quaternion is not None), float(use_position), float(use_velocity)),
    )


def unit_quaternion(values: list[float]) -> list[float] | None:
    """The quaternion brought to unit length; None where it is no rotation."""
    w, x, y, z = values
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    if not abs(norm - 1.0) < _NORM_TOLERANCE:  # NaN ends here too
        return None
    return [w / norm, x / norm, y / norm, z / norm]


@message
class Sighting:
    """A usable MarkerSample.

    Attributes:
        time_s: when the frame was exposed.
        marker_id: which marker.
        pose: (7,) position [m, body] and quaternion (marker to body, unit length).
        covariance: (6, 6) of position [m, body axes] and rotation [rad, marker axes], symmetric positive definite.
    """

    time_s: float
    marker_id: int
    pose: Array
    covariance: Array


def checked_sighting(sample: MarkerSample) -> Sighting | None:
    """The sample with its quaternion normalised and its covariance symmetric; None where it cannot be used."""
    position = sample.position_in_body.tolist()
    quaternion = unit_quaternion(sample.quaternion_marker_to_body.tolist())
    covariance = 0.5 * (sample.covariance + sample.covariance.T)
    if not math.isfinite(sample.time_s) or not plausible(position) or quaternion is None:
        return None
    if not plausible(covariance.ravel().tolist()):
        return None
    try:
        np.linalg.cholesky(covariance)
    except np.linalg.LinAlgError:
        return None
    return Sighting(sample.time_s, sample.marker_id, np.array(position + quaternion), covariance)


@message
class SpecificForce:
    """A usable AccelerometerSample: `force` (3,) [m/s^2], body; for the filter without the bias."""

    time_s: float
    force: list[float]


def checked_accelerometer(sample: AccelerometerSample) -> SpecificForce | None:
    """The sample; None where it cannot be used."""
    force = sample.specific_force_in_body.tolist()
    if not math.isfinite(sample.time_s) or not plausible(force, _SHOCKS_SQUARED):
        return None
    return SpecificForce(sample.time_s, force)


Measurement = Odometry | Sighting | SpecificForce
