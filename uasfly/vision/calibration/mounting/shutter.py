"""Takes out of the sightings what a rolling shutter does to them: each row of the picture is from another time.

A pose that is fitted to a bent bundle is wrong in ways that go with the motion, so that they do not average out. How
the bundle is bent follows from the motion; the pose's error is what the fit of a straight bundle makes of it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from uasfly.bundle import Bundle
from uasfly.camera import Camera
from uasfly.messages import Array
from uasfly.vision.calibration.mounting.drift import Noise
from uasfly.vision.calibration.mounting.fit import Belief, MountingFit, fit_mounting
from uasfly.vision.calibration.mounting.model import Unknowns
from uasfly.vision.calibration.mounting.observations import Motion, Place, Sightings, Track
from uasfly.vision.rotations import skews

_FEWEST = 4  # corners in the picture
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
    """The poses without what the rolling shutter has done, to first order.

    Args:
        sightings: as they were made, of frames whose time is that of their middle row.
        place: of the vehicle at each of them.
        unknowns: the mounting.
        camera: lens and time from the first row to the last.
        bundles: where the corners are.
    """
    position, rotation = sightings.position.copy(), sightings.rotation.copy()
    corners = {b.marker_id: np.concatenate([marker.corners for marker in b.markers]) for b in bundles}
    turning, moving = _twist(place, unknowns)
    for index in range(len(sightings.time_s)):
        points = corners.get(sightings.ids[sightings.bundle[index]])
        if points is None:
            continue
        seen = points @ rotation[index].T + position[index]
        pixels, by_point = camera.project_with_jacobian(seen)
        inside = (pixels >= 0.0).all(axis=1) & (pixels <= (camera.width_px - 1.0, camera.height_px - 1.0)).all(axis=1)
        if inside.sum() < _FEWEST:
            continue
        later_s = camera.rolling_shutter_s * (pixels[inside, 1] / (camera.height_px - 1.0) - 0.5)
        speed = -moving[index] - np.cross(turning[index], seen[inside])
        bent = np.einsum("nij,nj->ni", by_point[inside], speed * later_s[:, None])
        by_turn = by_point[inside] @ (-rotation[index] @ skews(points[inside]))
        by_pose = np.concatenate((by_point[inside], by_turn), axis=2).reshape(-1, 6)
        error = np.linalg.lstsq(by_pose, bent.ravel(), rcond=None)[0]
        position[index] -= error[:3]
        rotation[index] = rotation[index] @ Rotation.from_rotvec(-error[3:]).as_matrix()
    return replace(sightings, position=position, rotation=rotation)


def _twist(place: Place, unknowns: Unknowns) -> tuple[Array, Array]:
    """Turning (n, 3) [rad/s] and moving (n, 3) [m/s] of the camera, in its own axes."""
    in_body = (place.rotation.transpose(0, 2, 1) @ place.velocity[..., None])[..., 0]
    moving = in_body + np.cross(place.rate, unknowns.lever)
    return place.rate @ unknowns.camera_to_body, moving @ unknowns.camera_to_body
