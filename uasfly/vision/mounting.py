"""From the camera's axes to the body's and back, with the mounting's uncertainty."""

from __future__ import annotations

import math

import numpy as np

from uasfly.camera import Camera
from uasfly.frames import skew
from uasfly.messages import Array, MarkerSample
from uasfly.vision.pose import Pose


def camera_in_body(camera: Camera) -> Pose:
    """Pose of the camera's optical axes in the body."""
    placement = camera.transform_camera_to_body
    return Pose(placement.position, placement.unit_quaternion)


def pose_in_camera(camera: Camera, position_in_body: Array, quaternion_marker_to_body: Array) -> Pose:
    """A marker's pose relative to the body (as the filter predicts it) in camera axes."""
    return camera_in_body(camera).inverse.of_frame(Pose(position_in_body, quaternion_marker_to_body))


def covariance_in_body(camera: Camera, pose: Pose, covariance: Array) -> Array:
    """Covariance (6, 6) of a pose relative to the body, with the camera's mounting uncertain.

    With C the camera's and R the marker's rotation, p its position in camera axes: a mounting that is off by a rotation
    d [rad, camera axes] and t [m, body axes] moves the marker by t - C [p]x d and turns it by R' d, in marker axes.

    Args:
        camera: its mounting.
        pose: of the marker in camera axes.
        covariance: (6, 6) position [m^2, camera axes], rotation [rad^2, marker axes].
    """
    C, R = camera.transform_camera_to_body.rotation, pose.rotation
    axes = np.eye(6)
    axes[:3, :3] = C
    by_turn = np.vstack((-C @ skew(pose.position), R.T))
    result: Array = axes @ covariance @ axes.T + math.radians(camera.mounting_sigma_deg) ** 2 * by_turn @ by_turn.T
    result[:3, :3] += camera.mounting_sigma_m**2 * np.eye(3)
    return 0.5 * (result + result.T)


def marker_sample(camera: Camera, marker_id: int, time_s: float, pose: Pose, covariance: Array) -> MarkerSample:
    """What the filter takes in.

    Args:
        camera: its mounting.
        marker_id: number of the marker or bundle.
        time_s: middle of the exposure, host's clock.
        pose: of the marker in camera axes.
        covariance: (6, 6) of the pose in camera axes.
    """
    in_body = camera_in_body(camera).of_frame(pose)
    return MarkerSample(
        time_s=time_s,
        marker_id=marker_id,
        position_in_body=in_body.position,
        quaternion_marker_to_body=in_body.quaternion,
        covariance=covariance_in_body(camera, pose, covariance),
    )
