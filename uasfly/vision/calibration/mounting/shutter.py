"""Takes out of the sightings what a rolling shutter does to them: each row of the picture is from another time.

A pose that is fitted to a bent bundle is wrong in ways that go with the motion, so that they do not average out. How
the bundle is bent follows from the motion; the pose's error is what the fit of a straight bundle makes of it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from uasfly.bundle import Bundle
from uasfly.camera import Camera
from uasfly.messages import Array
from uasfly.vision.calibration.mounting.drift import Noise
from uasfly.vision.calibration.mounting.fit import Belief, MountingFit, fit_mounting
from uasfly.vision.calibration.mounting.model import Unknowns
from uasfly.vision.calibration.mounting.observations import Motion, Place, Sightings, Track
from uasfly.vision.pose import huber_weights
from uasfly.vision.rotations import rotations, skews

_FEWEST = 4  # corners in the picture
_STEPS = 40
_SETTLED = 1e-4  # of metres and radians
_PASSES = 2  # with the mounting found so far


def fit_through_shutter(
    motion: Motion,
    sightings: Sightings,
    belief: Belief,
    camera: Camera,
    bundles: tuple[Bundle, ...],
    noise: Noise | None = None,
) -> MountingFit:
    """`fit_mounting`, and again with the sightings as a shutter that opens everywhere at once would give them.

    Args:
        motion: of the vehicle.
        sightings: of bundles at rest.
        belief: see `fit_mounting`.
        camera: lens and time from the first row to the last; with a global shutter nothing is done.
        bundles: where the corners are; one that is missing leaves its sightings as they are.
        noise: see `fit_mounting`.
    """
    fit = fit_mounting(motion, sightings, belief, noise)
    if camera.rolling_shutter_s == 0.0 or not bundles:
        return fit
    place = Track(motion, np.clip(sightings.time_s, motion.time_s[0], motion.time_s[-1])).at(0.0)
    for _ in range(_PASSES):
        straight = straightened(sightings, place, fit.unknowns, camera, bundles)
        fit = fit_mounting(motion, straight, belief, noise)
    return fit


def straightened(
    sightings: Sightings, place: Place, unknowns: Unknowns, camera: Camera, bundles: tuple[Bundle, ...]
) -> Sightings:
    """The poses to which the shutter would make those that were found.

    Args:
        sightings: as they were made, of frames whose time is that of their middle row.
        place: of the vehicle at each of them.
        unknowns: the mounting.
        camera: lens and time from the first row to the last.
        bundles: where the corners are.
    """
    position, rotation = sightings.position.copy(), sightings.rotation.copy()
    turning, moving = _twist(place, unknowns)
    for bundle in bundles:
        if bundle.marker_id in sightings.ids:
            its = np.flatnonzero(sightings.bundle == sightings.ids.index(bundle.marker_id))
            corners = np.concatenate([marker.corners for marker in bundle.markers])
            found = position[its], rotation[its]
            position[its], rotation[its] = _straight(found, corners, turning[its], moving[its], camera)
    return replace(sightings, position=position, rotation=rotation)


def _straight(
    found: tuple[Array, Array], points: Array, turning: Array, moving: Array, camera: Camera
) -> tuple[Array, Array]:
    """Positions (n, 3) and rotations whose corners, bent by the motion, are fitted best by the poses that were found.

    The normal equations of `fit_pose` at those poses, with its weights, hold for the bent corners; solved by Newton's
    method. Where too few corners are in the picture the pose stays.
    """
    position, rotation = found
    fitted, by_point = _project(camera, points @ rotation.transpose(0, 2, 1) + position[:, None])
    inside = (fitted >= 0.0).all(axis=2) & (fitted <= (camera.width_px - 1.0, camera.height_px - 1.0)).all(axis=2)
    usable = inside.sum(axis=1) >= _FEWEST
    at_found = _by_pose(np.nan_to_num(by_point), rotation, points)
    later_s = camera.rolling_shutter_s * (np.nan_to_num(fitted[..., 1:]) / (camera.height_px - 1.0) - 0.5)
    for _ in range(_STEPS):
        straight = points @ rotation.transpose(0, 2, 1) + position[:, None]
        bent = straight - later_s * (moving[:, None] + np.cross(turning[:, None], straight))
        pixels, by_point = _project(camera, bent)
        away = fitted - pixels
        good = np.asarray(inside & np.isfinite(away).all(axis=2))
        away = np.where(good[..., None], away, 0.0)
        weights = good * huber_weights(np.linalg.norm(away, axis=2) / camera.pixel_sigma)
        normal = (at_found * np.repeat(weights, 2, axis=1)[..., None]).transpose(0, 2, 1)
        slope = normal @ _by_pose(np.nan_to_num(by_point), rotation, points)
        slope[~usable] = np.eye(6)
        step = np.linalg.solve(slope, normal @ away.reshape(len(away), -1, 1))[..., 0] * usable[:, None]
        position, rotation = position + step[:, :3], rotation @ rotations(step[:, 3:])
        if np.abs(step).max() < _SETTLED:
            break
    return position, rotation


def _project(camera: Camera, points: Array) -> tuple[Array, Array]:
    """Pixels (n, k, 2) of points (n, k, 3) in camera axes and their derivatives (n, k, 2, 3)."""
    pixels, by_point = camera.project_with_jacobian(points.reshape(-1, 3))
    return pixels.reshape(*points.shape[:2], 2), by_point.reshape(*points.shape[:2], 2, 3)


def _by_pose(by_point: Array, rotation: Array, points: Array) -> Array:
    """Derivative (n, 2k, 6) of pixels by the poses' errors."""
    by_turn = by_point @ (-rotation[:, None] @ skews(points))
    rows = np.concatenate((by_point, by_turn), axis=3)
    return np.asarray(rows, dtype=float).reshape(len(rotation), -1, 6)


def _twist(place: Place, unknowns: Unknowns) -> tuple[Array, Array]:
    """Turning (n, 3) [rad/s] and moving (n, 3) [m/s] of the camera, in its own axes."""
    in_body = (place.rotation.transpose(0, 2, 1) @ place.velocity[..., None])[..., 0]
    moving = in_body + np.cross(place.rate, unknowns.lever)
    return place.rate @ unknowns.camera_to_body, moving @ unknowns.camera_to_body
