"""Pictures and detections of a bundle of six markers on a corner, an edge and a slope, none in one plane."""

from __future__ import annotations

from functools import cache

import numpy as np

from tests.vision.test_camera import camera
from uasfly.bundle import Bundle
from uasfly.camera import Camera
from uasfly.messages import Array
from uasfly.sim.camera.motion import CameraMotion
from uasfly.sim.camera.renderer import Renderer
from uasfly.sim.camera.settings import CameraSettings
from uasfly.vision.detectors import Image
from uasfly.vision.pose import Pose
from uasfly.vision.square import quaternion_of

LENS = camera([-0.2, 0.06, 0.0004, -0.0003, 0.0])
SIX = Bundle.model_validate(
    {
        "name": "six",
        "family": "36h11",
        "markers": [
            {"id": 3, "size_m": 0.2},
            {"id": 5, "size_m": 0.2, "position_m": [0.32, 0.02, 0.03], "rpy_deg": [5.0, 20.0, 3.0]},
            {"id": 8, "size_m": 0.2, "position_m": [-0.31, 0.01, 0.05], "rpy_deg": [0.0, -30.0, -4.0]},
            {"id": 11, "size_m": 0.2, "position_m": [0.02, 0.30, 0.04], "rpy_deg": [35.0, 0.0, 2.0]},
            {"id": 12, "size_m": 0.2, "position_m": [0.28, 0.33, 0.12], "rpy_deg": [20.0, 25.0, 0.0]},
            {"id": 20, "size_m": 0.15, "position_m": [-0.26, 0.29, -0.06], "rpy_deg": [-10.0, -15.0, 12.0]},
        ],
    }
)


def camera_poses(count: int) -> list[Pose]:
    """Poses of the camera in the bundle's frame, 1 to 1.5 m away, from all sides in front of it."""
    rng = np.random.default_rng(7)
    poses = []
    for index in range(count):
        around, off = 2.0 * np.pi * index / count, np.radians(rng.uniform(5.0, 40.0))
        out = np.array((np.sin(off) * np.cos(around), np.sin(off) * np.sin(around), np.cos(off)))
        middle = np.array((0.0, 0.15, 0.0)) + rng.uniform(-0.08, 0.08, 3)
        down = np.array((0.2 * rng.normal(), -1.0, 0.0))
        right = np.cross(down, -out)
        right /= np.linalg.norm(right)
        rotation = np.column_stack((right, np.cross(-out, right), -out))
        poses.append(Pose(middle + rng.uniform(1.0, 1.5) * out, quaternion_of(rotation)))
    return poses


def render_all(bundle: Bundle, lens: Camera, poses: list[Pose], seed: int = 1) -> list[Image]:
    """Pictures with blur 0.7 px and the sensor's usual noise, from camera poses in the bundle's frame."""
    placement = {"position_m": [0.0, 0.0, 0.0], "on": "floor", "facing_deg": 90.0}  # its axes are the world's
    settings = CameraSettings.model_validate(
        {"bundle": placement, "exposure_s": 0.0, "lens_blur_px": 0.7, "vignetting": 0.2}
    )
    renderer = Renderer(lens, bundle, settings, np.random.default_rng(seed))
    still = np.zeros(3)
    return [renderer.render(CameraMotion(pose.position, pose.rotation, still, still)) for pose in poses]


@cache
def pictures_of_six() -> tuple[Image, ...]:
    """Twelve views."""
    return tuple(render_all(SIX, LENS, camera_poses(12)))


def turn_deg(one: Array, other: Array) -> float:
    """Angle between two rotation matrices."""
    return float(np.degrees(np.arccos(np.clip(0.5 * (np.trace(one.T @ other) - 1.0), -1.0, 1.0))))
