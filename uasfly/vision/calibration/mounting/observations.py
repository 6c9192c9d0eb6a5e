"""What a mounting is calibrated from: the motion as the autopilot tells it, and bundles as the camera saw them.

Between samples the motion is followed with its velocities and rates, which wander less than single positions and
attitudes scatter: so a shift of the camera's clock has a smooth effect. Attitudes are the mean of the samples around,
turned there by the rates: scatter in them would be an error in the regressors, and bias the lever arm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from uasfly.messages import Array
from uasfly.vision.rotations import right_jacobians, rotations

Indices = NDArray[np.intp]
LONGEST_GAP_S = 0.25  # between samples of the motion; what was seen meanwhile is not used
_AROUND_S = 0.25  # half the time over which attitudes are averaged
_AROUND = 25  # instants in it


@dataclass(frozen=True, slots=True)
class Motion:
    """Samples of the vehicle's motion, in the order of time.

    Attributes:
        time_s: (n,). position_in_world: (n, 3) m. velocity_in_world: (n, 3) m/s.
        quaternion_body_to_world: (n, 4). rate_in_body: (n, 3) rad/s.
        resets: (n,) grows where the autopilot's estimate has jumped.
    """

    time_s: Array
    position_in_world: Array
    velocity_in_world: Array
    quaternion_body_to_world: Array
    rate_in_body: Array
    resets: Indices


@dataclass(frozen=True, slots=True)
class Sightings:
    """Poses of bundles in camera axes, in the order of time.

    Attributes:
        time_s: (n,) mid-exposure, as the camera's latency says. bundle: (n,) index into `ids`.
        position: (n, 3) m. rotation: (n, 3, 3) bundle to camera.
        covariance: (n, 6, 6) position [m^2, camera axes], rotation [rad^2, bundle axes: true = measured * exp(error)].
        ids: numbers of the bundles.
    """

    time_s: Array
    bundle: Indices
    position: Array
    rotation: Array
    covariance: Array
    ids: tuple[int, ...]

    def part(self, chosen: Indices | NDArray[np.bool_]) -> Sightings:
        """Some of them."""
        return Sightings(
            self.time_s[chosen],
            self.bundle[chosen],
            self.position[chosen],
            self.rotation[chosen],
            self.covariance[chosen],
            self.ids,
        )


@dataclass(frozen=True, slots=True)
class Place:
    """The vehicle when bundles were seen, and how fast it was.

    Attributes:
        position: (n, 3) m, world. rotation: (n, 3, 3) body to world.
        velocity: (n, 3) m/s, world: derivative of `position` by the time offset.
        rate: (n, 3) rad/s, body: `rotation` turns on its right by so much a second of the time offset.
    """

    position: Array
    rotation: Array
    velocity: Array
    rate: Array


class Track:
    """The vehicle's place at the sightings' times, as a function of one time offset of them all.

    Args:
        motion: samples.
        time_s: (n,) of the sightings; each between two samples of one stretch without a jump, see `followed`.
    """

    def __init__(self, motion: Motion, time_s: Array) -> None:
        self._time_s = time_s
        self._velocity = _Integral(motion.time_s, motion.velocity_in_world)
        self._rate = _Integral(motion.time_s, motion.rate_in_body)
        columns = [np.interp(time_s, motion.time_s, column) for column in motion.position_in_world.T]
        self._position = np.stack(columns, axis=-1)
        self._rotation = self._attitudes(motion)

    def at(self, offset_s: float) -> Place:
        """Where it was `offset_s` after the sightings' stated times."""
        moved, velocity = self._velocity.between(self._time_s, offset_s)
        turned, rate = self._rate.between(self._time_s, offset_s)
        rate = (right_jacobians(turned) @ rate[..., None])[..., 0]
        return Place(self._position + moved, self._rotation @ rotations(turned), velocity, rate)

    def _attitudes(self, motion: Motion) -> Array:
        """(n, 3, 3) body to world at the stated times."""
        slerp = Slerp(motion.time_s, Rotation.from_quat(np.roll(motion.quaternion_body_to_world, -1, axis=1)))
        stretch = followed(motion, self._time_s)[1]
        here, total, count = slerp(self._time_s), np.zeros((len(self._time_s), 3)), np.zeros(len(self._time_s))
        for away_s in np.linspace(-_AROUND_S, _AROUND_S, _AROUND):
            there_s = np.clip(self._time_s + away_s, motion.time_s[0], motion.time_s[-1])
            good, its = followed(motion, there_s)
            good &= its == stretch
            turned = self._rate.between(there_s, self._time_s - there_s)[0]
            total[good] += (here.inv() * slerp(there_s) * Rotation.from_rotvec(turned)).as_rotvec()[good]
            count += good
        mean = Rotation.from_rotvec(total / np.maximum(count, 1.0)[:, None])
        return np.asarray((here * mean).as_matrix(), dtype=float)


def followed(motion: Motion, time_s: Array) -> tuple[NDArray[np.bool_], Indices]:
    """Which times are between two samples that belong together, and the count of jumps there.

    Args:
        motion: samples.
        time_s: (n,).
    """
    after = np.clip(np.searchsorted(motion.time_s, time_s), 1, len(motion.time_s) - 1)
    before = after - 1
    good = (time_s >= motion.time_s[before]) & (time_s <= motion.time_s[after])
    good &= motion.time_s[after] - motion.time_s[before] <= LONGEST_GAP_S
    good &= motion.resets[after] == motion.resets[before]
    return good, motion.resets[before]


class _Integral:
    """Integral over time of what changes evenly between samples (n, 3)."""

    def __init__(self, time_s: Array, values: Array) -> None:
        self._time_s, self._values = time_s, values
        steps = np.diff(time_s)[:, None]
        self._slopes = np.diff(values, axis=0) / steps
        self._sums = np.concatenate((np.zeros((1, 3)), np.cumsum(0.5 * steps * (values[1:] + values[:-1]), axis=0)))

    def between(self, time_s: Array, offset_s: float | Array) -> tuple[Array, Array]:
        """From each time (n,) to `offset_s` (one or (n,)) later: the integral (n, 3), and the value (n, 3) there."""
        end, value = self._at(time_s + offset_s)
        return end - self._at(time_s)[0], value

    def _at(self, time_s: Array) -> tuple[Array, Array]:
        before = np.clip(np.searchsorted(self._time_s, time_s) - 1, 0, len(self._slopes) - 1)
        since = (time_s - self._time_s[before])[:, None]
        first, slope = self._values[before], self._slopes[before]
        return self._sums[before] + since * (first + 0.5 * since * slope), first + since * slope
