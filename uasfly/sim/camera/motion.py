"""Where the camera is and how it moves while a frame is exposed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uasfly.frames import quaternion_from_rotation_vector, rotation_matrix
from uasfly.messages import Array


@dataclass(frozen=True, slots=True)
class CameraMotion:
    """Pose of a camera at mid-exposure and its rates, which hold for the exposure.

    Attributes:
        position_in_world: (3,) m, of the camera's centre.
        rotation_camera_to_world: (3, 3).
        velocity_in_world: (3,) m/s, of the camera's centre.
        angular_rate_in_camera: (3,) rad/s.
    """

    position_in_world: Array
    rotation_camera_to_world: Array
    velocity_in_world: Array
    angular_rate_in_camera: Array

    def at(self, offset_s: float) -> tuple[Array, Array]:
        """Position (3,) [m, world] and rotation camera to world (3, 3), `offset_s` after mid-exposure."""
        position = self.position_in_world + offset_s * self.velocity_in_world
        turn = rotation_matrix(quaternion_from_rotation_vector(offset_s * self.angular_rate_in_camera))
        return position, self.rotation_camera_to_world @ turn

    def plane_to_camera(
        self, plane_to_bundle: Array, bundle_position: Array, bundle_to_world: Array, offset_s: float
    ) -> Array:
        """Matrix (3, 3) from (u, v, 1) on a plane of the bundle to camera axes [m], `offset_s` after mid-exposure.

        Args:
            plane_to_bundle: (3, 3), from (u, v, 1) to the bundle's frame [m].
            bundle_position: (3,) m, world.
            bundle_to_world: (3, 3).
            offset_s: [s].
        """
        position, rotation = self.at(offset_s)
        in_world = bundle_to_world @ plane_to_bundle
        in_world[:, 2] += bundle_position - position
        return np.asarray(rotation.T @ in_world, dtype=float)


def camera_motion(
    body_position: Array,
    body_velocity: Array,
    body_to_world: Array,
    angular_rate_in_body: Array,
    camera_in_body: Array,
    camera_to_body: Array,
    mount_rate_in_body: Array,
) -> CameraMotion:
    """Motion of a camera that is mounted on a body.

    Args:
        body_position: (3,) m, world.
        body_velocity: (3,) m/s, world.
        body_to_world: (3, 3).
        angular_rate_in_body: (3,) rad/s.
        camera_in_body: (3,) m, where the camera's centre is.
        camera_to_body: (3, 3), how it is turned now.
        mount_rate_in_body: (3,) rad/s, how the mount turns against the body.
    """
    lever_velocity = body_to_world @ np.cross(angular_rate_in_body, camera_in_body)
    return CameraMotion(
        body_position + body_to_world @ camera_in_body,
        body_to_world @ camera_to_body,
        body_velocity + lever_velocity,
        camera_to_body.T @ (angular_rate_in_body + mount_rate_in_body),
    )
