"""How a mounting shows in what the camera sees: residuals of the sightings and their derivatives.

With A the vehicle's attitude and x its position as the autopilot tells them, e and a their errors then, h the error of
its heading, C and t the camera's rotation and place in the body, P and Q the bundle's place and rotation in the world,
p and R the bundle as seen in camera axes, the vehicle's true attitude and position are

    D' = Rz(-h) A exp(-a),  x - e,

and what is seen should agree with where the bundle is (hand-eye calibration, AX = ZB; Zhuang, Roth & Sudhakar 1994):

    r_p = D (P - x + e) - t - C p         [m, body axes]
    r_q = log(R' C' D Q)                  [rad, bundle axes].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from uasfly.messages import Array
from uasfly.vision.calibration.mounting.observations import Place, Sightings
from uasfly.vision.rotations import right_jacobians, rotations, skews

# Errors of the unknowns: mounting's rotation [rad, body axes] and lever arm [m, body axes], heading error [rad], time
# offset [s], then for each bundle its place [m, world] and rotation [rad, its own axes].
TURN = slice(0, 3)
LEVER = slice(3, 6)
MOUNTING = slice(0, 6)
HEADING = 6
OFFSET = 7
BUNDLES = 8
_UP = np.array((0.0, 0.0, 1.0))


@dataclass(frozen=True, slots=True)
class Unknowns:
    """What is looked for, but for the errors of the motion.

    Attributes:
        camera_to_body: (3, 3). lever: (3,) m, the camera in the body.
        heading_rad: the autopilot's heading minus the true one. offset_s: exposure minus what the log says.
        bundle_position: (b, 3) m, world. bundle_to_world: (b, 3, 3).
    """

    camera_to_body: Array
    lever: Array
    heading_rad: float
    offset_s: float
    bundle_position: Array
    bundle_to_world: Array

    @property
    def size(self) -> int:
        """Number of errors."""
        return BUNDLES + 6 * len(self.bundle_position)

    def moved(self, step: Array) -> Unknowns:
        """With errors (size,) applied."""
        bundles = step[BUNDLES:].reshape(-1, 6)
        return Unknowns(
            rotations(step[TURN]) @ self.camera_to_body,
            self.lever + step[LEVER],
            self.heading_rad + float(step[HEADING]),
            self.offset_s + float(step[OFFSET]),
            self.bundle_position + bundles[:, :3],
            self.bundle_to_world @ rotations(bundles[:, 3:]),
        )


@dataclass(frozen=True, slots=True)
class Linearised:
    """Residuals (n, 6) and all that their weights and derivatives need.

    Attributes:
        residuals: (n, 6) position, rotation.
        by_unknowns: (n, 6, size). by_motion: (n, 6, 6) by e and a.
        seen: (n, 6, 6) covariance that the detector states, on the residual's axes.
        by_attitude: (n, 6, 3) by a small turn of the body.
    """

    residuals: Array
    by_unknowns: Array
    by_motion: Array
    seen: Array
    by_attitude: Array


def linearise(unknowns: Unknowns, place: Place, sightings: Sightings, errors: Array) -> Linearised:
    """Residuals and derivatives.

    Args:
        unknowns: where.
        place: of the vehicle at the sightings, with the unknown's time offset.
        sightings: what was seen.
        errors: (n, 6) e [m, world] and a [rad, body] of the motion then.
    """
    count, C = len(sightings.time_s), unknowns.camera_to_body
    small = rotations(errors[:, 3:])
    world_to_body = small @ place.rotation.transpose(0, 2, 1) @ rotations(unknowns.heading_rad * _UP)
    bundle = unknowns.bundle_to_world[sightings.bundle]
    away = unknowns.bundle_position[sightings.bundle] - place.position + errors[:, :3]
    expected, seen = _turn(world_to_body, away), sightings.position @ C.T
    to_bundle = (world_to_body @ bundle).transpose(0, 2, 1)
    misfit = (C @ sightings.rotation).transpose(0, 2, 1) @ to_bundle.transpose(0, 2, 1)
    turned = np.asarray(Rotation.from_matrix(misfit).as_rotvec(), dtype=float)
    by_right = np.linalg.inv(right_jacobians(turned))
    by_left = by_right @ to_bundle  # of r_q by a turn of D on its left, body axes
    by_attitude = np.concatenate((-skews(expected), by_left), axis=1)

    by_unknowns = np.zeros((count, 6, unknowns.size))
    by_unknowns[:, :3, TURN] = skews(seen)
    by_unknowns[:, 3:, TURN] = -by_left
    by_unknowns[:, :3, LEVER] = -np.eye(3)
    by_unknowns[:, :, HEADING] = _turn(by_attitude, world_to_body @ _UP)
    by_unknowns[:, :, OFFSET] = _turn(by_attitude, -_turn(small, place.rate))
    by_unknowns[:, :3, OFFSET] -= _turn(world_to_body, place.velocity)
    for index in range(len(sightings.ids)):
        its, first = sightings.bundle == index, BUNDLES + 6 * index
        by_unknowns[its, :3, first : first + 3] = world_to_body[its]
        by_unknowns[its, 3:, first + 3 : first + 6] = by_right[its]

    by_motion = np.empty((count, 6, 6))
    by_motion[:, :3, :3], by_motion[:, 3:, :3] = world_to_body, 0.0
    by_motion[:, :, 3:] = by_attitude @ right_jacobians(-errors[:, 3:])
    axes = np.zeros((6, 6))
    axes[:3, :3], axes[3:, 3:] = C, np.eye(3)
    residuals = np.concatenate((expected - unknowns.lever - seen, turned), axis=1)
    return Linearised(residuals, by_unknowns, by_motion, axes @ sightings.covariance @ axes.T, by_attitude)


def bundles_seen(camera_to_body: Array, lever: Array, place: Place, sightings: Sightings) -> tuple[Array, Array]:
    """Mean place (b, 3) [m] and rotation (b, 3, 3) of the bundles in the world, for a mounting."""
    position = place.position + _turn(place.rotation, sightings.position @ camera_to_body.T + lever)
    rotation = place.rotation @ camera_to_body @ sightings.rotation
    positions, turns = [], []
    for index in range(len(sightings.ids)):
        its = sightings.bundle == index
        positions.append(np.median(position[its], axis=0))
        turns.append(Rotation.from_matrix(rotation[its]).mean().as_matrix())
    return np.array(positions), np.array(turns)


def _turn(matrices: Array, vectors: Array) -> Array:
    return np.asarray((matrices @ vectors[..., None])[..., 0], dtype=float)
