"""Cameras, bundles and views that the tests of the simulated camera share."""

from __future__ import annotations

from typing import Any

import numpy as np

from uasfly.bundle import Bundle
from uasfly.camera import Camera
from uasfly.frames import quaternion_from_rotation_vector, rotation_matrix
from uasfly.messages import Array
from uasfly.sim.camera.motion import CameraMotion
from uasfly.sim.camera.renderer import Renderer
from uasfly.sim.camera.settings import Background, CameraSettings, Noise

DISTORTED = [-0.25, 0.08, 0.001, -0.0015, 0.01]
AHEAD = np.array(((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0)))  # camera axes in the world: looking to +x
STILL = np.zeros(3)


def camera(**changes: Any) -> Camera:
    """A 640 x 480 camera with a global shutter on the nose, changed as said."""
    fields: dict[str, Any] = {
        "name": "test",
        "width_px": 640,
        "height_px": 480,
        "fx": 554.0,
        "fy": 550.0,
        "cx": 322.3,
        "cy": 236.1,
        "exposure_s": 0.0,
        "transform_camera_to_body": {"position_m": (0.1, 0.0, 0.0), "rpy_deg": (-90.0, 0.0, -90.0)},
    }
    return Camera.model_validate({**fields, **changes})


def single(size_m: float = 0.2, marker_id: int = 5) -> Bundle:
    """One AprilTag."""
    return Bundle.model_validate({"name": "one", "family": "36h11", "markers": [{"id": marker_id, "size_m": size_m}]})


def four() -> Bundle:
    """Four AprilTags of 20 cm."""
    places = ((-0.3, 0.3), (0.3, 0.3), (-0.3, -0.3), (0.3, -0.3))
    markers = [{"id": i, "size_m": 0.2, "position_m": (x, y, 0.0)} for i, (x, y) in enumerate(places)]
    return Bundle.model_validate({"name": "four", "family": "36h11", "markers": markers})


def clean(**changes: Any) -> CameraSettings:
    """A wall at x = 2 that faces a camera looking to +x, without blur, noise and vignetting; changed as said."""
    fields: dict[str, Any] = {
        "bundle": {"on": "wall", "position_m": (2.0, 0.0, 0.0), "facing_deg": 180.0},
        "lens_blur_px": 0.0,
        "noise": Noise(read=0.0, shot=0.0),
        "vignetting": 0.0,
        "ink": 20 / 255,  # whole numbers in the picture, so that sums of them are exact
        "paper": 215 / 255,
        "background": Background(kind="plain", level=0.5),
        "after": "boot",
    }
    return CameraSettings.model_validate({**fields, **changes})


def view(
    position: tuple[float, float, float] = (0.0, 0.0, 0.0),
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0),
    velocity: Array = STILL,
    rate: Array = STILL,
) -> CameraMotion:
    """A camera that looks to +x, turned by a rotation vector [rad, world]."""
    turned = rotation_matrix(quaternion_from_rotation_vector(np.array(turn)))
    return CameraMotion(np.array(position), turned @ AHEAD, velocity, rate)


def corners_in_camera(renderer: Renderer, bundle: Bundle, motion: CameraMotion, marker_id: int) -> Array:
    """Black corners (4, 3) of a marker [m, camera axes] at mid-exposure."""
    position, to_world = renderer.placed.pose(0.0)
    in_world = bundle.corners(marker_id) @ to_world.T + position
    moved: Array = (in_world - motion.position_in_world) @ motion.rotation_camera_to_world
    return moved
