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
    axes = _axes(camera)
    result: Array = axes @ covariance @ axes.T + _mounting_part(camera, pose)
    return 0.5 * (result + result.T)


def seen_by_camera(camera: Camera, sample: MarkerSample) -> tuple[Pose, Array]:
    """The pose in camera axes and its covariance (6, 6) that `marker_sample` was given: its inverse.

    Args:
        camera: the mounting that the sample was made with.
        sample: what the filter took in.
    """
    pose = pose_in_camera(camera, sample.position_in_body, sample.quaternion_marker_to_body)
    axes = _axes(camera)
    covariance: Array = axes.T @ (sample.covariance - _mounting_part(camera, pose)) @ axes
    return pose, 0.5 * (covariance + covariance.T)


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


def _axes(camera: Camera) -> Array:
    """(6, 6) that turns the position of a pose's error into the body."""
    axes = np.eye(6)
    axes[:3, :3] = camera.transform_camera_to_body.rotation
    return axes


def _mounting_part(camera: Camera, pose: Pose) -> Array:
    """Covariance (6, 6) that the mounting's uncertainty adds, see `covariance_in_body`."""
    by_turn = np.vstack((-camera.transform_camera_to_body.rotation @ skew(pose.position), pose.rotation.T))
    result: Array = math.radians(camera.mounting_sigma_deg) ** 2 * by_turn @ by_turn.T
    result[:3, :3] += camera.mounting_sigma_m**2 * np.eye(3)
    return result
