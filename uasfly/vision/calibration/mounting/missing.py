"""Which motion a log lacks: what the mounting would be known to, had the vehicle moved some more.

The information matrix of the log grows by that of sightings of the same quality on a motion that is made up. So it is
not guessed what helps, but worked out for this camera, this bundle and these disturbances.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from uasfly.messages import Array
from uasfly.vision.calibration.mounting import drift
from uasfly.vision.calibration.mounting.drift import Knots
from uasfly.vision.calibration.mounting.fit import MountingFit, worst_sigmas
from uasfly.vision.calibration.mounting.model import linearise
from uasfly.vision.calibration.mounting.observations import Place, Sightings
from uasfly.vision.calibration.mounting.pretence import known_covariance
from uasfly.vision.rotations import rotations

LIMIT_RAD = math.radians(1.0)  # a mounting that is known no better is not known
LIMIT_M = 0.05
EACH_S = 15.0
_RATE_HZ = 10.0
_TILT_RAD = math.radians(15.0)
_MOVE_M = 0.5
MOTIONS = {
    "turn": "turn it once right round about the vertical",
    "tilt": "roll and pitch it by 15 deg to either side, every three to four seconds",
    "move": "move it by 0.5 m to and fro along both horizontal axes",
}


@dataclass(frozen=True, slots=True)
class Missing:
    """Motions that are missing, and the sigmas in the worst directions with them: rotation [rad], lever arm [m]."""

    motions: tuple[str, ...]
    turn_sigma_rad: float
    lever_sigma_m: float

    @property
    def enough(self) -> bool:
        """Whether the mounting would be known."""
        return known(self.turn_sigma_rad, self.lever_sigma_m)

    @property
    def text(self) -> str:
        """For people."""
        what = ", and ".join(MOTIONS[motion] for motion in self.motions)
        end = "" if self.enough else ", which is still not enough: record for longer"
        return (
            f"{what}, {EACH_S:g} s each, the bundle in sight: expected then "
            f"{math.degrees(self.turn_sigma_rad):.2g} deg and {100.0 * self.lever_sigma_m:.2g} cm{end}"
        )


def known(turn_sigma_rad: float, lever_sigma_m: float) -> bool:
    """Whether a mounting is known well enough to be written."""
    return turn_sigma_rad <= LIMIT_RAD and lever_sigma_m <= LIMIT_M


def missing(fit: MountingFit) -> Missing | None:
    """The fewest motions that would make the mounting known, or else all; None where it is known."""
    if known(*fit.worst_sigmas):
        return None
    best: Missing | None = None
    for count in range(1, len(MOTIONS) + 1):
        tried = [Missing(motions, *_expected(fit, motions)) for motions in itertools.combinations(MOTIONS, count)]
        best = min(tried, key=lambda one: max(one.turn_sigma_rad / LIMIT_RAD, one.lever_sigma_m / LIMIT_M))
        if best.enough:
            break
    return best


def _expected(fit: MountingFit, motions: tuple[str, ...]) -> tuple[float, float]:
    unknowns, seen = fit.unknowns, fit.sightings
    here = fit.track.at(unknowns.offset_s)
    parts = [_moved(here, motion) for motion in motions]
    place = Place(
        np.concatenate([here.position, *(part.position for part in parts)]),
        np.concatenate([here.rotation, *(part.rotation for part in parts)]),
        np.concatenate([here.velocity, *(part.velocity for part in parts)]),
        np.concatenate([here.rate, *(part.rate for part in parts)]),
    )
    count = len(place.position) - len(here.position)
    time_s = np.concatenate((seen.time_s, seen.time_s[-1] + np.arange(1, count + 1) / _RATE_HZ))
    C, last = unknowns.camera_to_body, int(seen.bundle[-1])
    world_to_body = place.rotation[-count:].transpose(0, 2, 1) @ rotations(np.array((0.0, 0.0, unknowns.heading_rad)))
    away = (unknowns.bundle_position[last] - place.position[-count:])[..., None]
    usual = int(np.argsort(np.trace(seen.covariance, axis1=1, axis2=2))[len(seen.time_s) // 2])
    more = Sightings(
        time_s,
        np.concatenate((seen.bundle, np.full(count, last, dtype=np.intp))),
        np.concatenate((seen.position, ((world_to_body @ away)[..., 0] - unknowns.lever) @ C)),
        np.concatenate((seen.rotation, C.T @ world_to_body @ unknowns.bundle_to_world[last])),
        np.concatenate((seen.covariance, np.repeat(seen.covariance[usual][None], count, axis=0))),
        seen.ids,
    )
    stretch = np.concatenate((fit.knots.stretch, np.full(count, fit.knots.stretch[-1])))
    knots = Knots(time_s, stretch)
    values = np.zeros((len(knots.time_s), 6))
    errors = np.concatenate((fit.errors, np.zeros((count, 6))))
    errors[-count:, :3] = errors[-count - 1, :3]
    linear = linearise(unknowns, place, more, errors)
    weights = np.concatenate((fit.weights, np.ones(count)))
    zeros = np.zeros(unknowns.size)
    result = drift.solve(linear, weights, fit.noise, knots, values, (fit.information, zeros))
    return worst_sigmas(known_covariance(result.information, fit.pretence, fit.information))


def _moved(here: Place, motion: str) -> Place:
    """A motion that begins where the vehicle is at the end."""
    time_s = np.arange(0.0, EACH_S, 1.0 / _RATE_HZ)
    yaw = float(Rotation.from_matrix(here.rotation[-1]).as_euler("ZYX")[0])
    level = Rotation.from_euler("Z", yaw)
    angles, position = np.zeros((len(time_s), 3)), np.zeros((len(time_s), 3))
    if motion == "turn":
        angles[:, 0] = 2.0 * math.pi * time_s / EACH_S
    elif motion == "tilt":
        angles[:, 2] = _TILT_RAD * np.sin(2.0 * math.pi * time_s / 3.0)
        angles[:, 1] = _TILT_RAD * np.sin(2.0 * math.pi * time_s / 4.0)
    else:
        position[:, 0] = _MOVE_M * np.sin(2.0 * math.pi * time_s / 4.0)
        position[:, 1] = _MOVE_M * np.sin(2.0 * math.pi * time_s / 5.0)
    attitudes = level * Rotation.from_euler("ZYX", angles)
    turned = (attitudes[:-1].inv() * attitudes[1:]).as_rotvec() * _RATE_HZ
    return Place(
        here.position[-1] + position,
        np.asarray(attitudes.as_matrix(), dtype=float),
        _slopes(position),
        np.asarray(np.concatenate((turned, turned[-1:])), dtype=float),
    )


def _slopes(values: Array) -> Array:
    return np.asarray(np.gradient(values, 1.0 / _RATE_HZ, axis=0), dtype=float)
