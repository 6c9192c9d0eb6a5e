"""The two poses that a square can have (Collins & Bartoli 2014, Infinitesimal Plane-based Pose Estimation)."""

from __future__ import annotations

import numpy as np

from uasfly.frames import quaternion_inverse, quaternion_product, rotation_vector_from_quaternion
from uasfly.messages import Array
from uasfly.vision.pose import Pose


def square_poses(plane: Array, size_m: float) -> list[tuple[Pose, float]]:
    """Poses of a square marker in camera axes and their residuals (RMS, in the plane z = 1), the better one first.

    Args:
        plane: (4, 2) corners in the plane z = 1 of an ideal camera, top-left first, clockwise.
        size_m: its side.
    """
    import cv2

    half = 0.5 * size_m
    square = np.array(((-half, half, 0.0), (half, half, 0.0), (half, -half, 0.0), (-half, -half, 0.0)))
    try:
        _, rotations, translations, _ = cv2.solvePnPGeneric(
            square, np.ascontiguousarray(plane), np.eye(3), np.zeros(4), flags=cv2.SOLVEPNP_IPPE_SQUARE
        )
    except cv2.error:
        return []
    poses = []
    for rotation_vector, translation in zip(rotations, translations, strict=True):
        matrix, _ = cv2.Rodrigues(rotation_vector)
        position = np.asarray(translation, dtype=float).ravel()
        if not (np.isfinite(matrix).all() and np.isfinite(position).all()) or position[2] <= 0.0:
            continue
        pose = Pose(position, quaternion_of(np.asarray(matrix, dtype=float)))
        points = pose.points(square)
        if (points[:, 2] <= 0.0).any():
            continue
        residual = points[:, :2] / points[:, 2:] - plane
        poses.append((pose, float(np.sqrt((residual**2).sum(axis=1).mean()))))
    return sorted(poses, key=lambda entry: entry[1])


def quaternion_of(matrix: Array) -> Array:
    """Unit quaternion (4,) of a rotation matrix (3, 3): the eigenvector of Bar-Itzhack's symmetric matrix (2000)."""
    (a, b, c), (d, e, f), (g, h, i) = matrix.tolist()
    symmetric = np.array(
        (
            (a + e + i, h - f, c - g, d - b),
            (h - f, a - e - i, b + d, c + g),
            (c - g, b + d, e - a - i, f + h),
            (d - b, c + g, f + h, i - a - e),
        )
    )
    _, vectors = np.linalg.eigh(symmetric)
    quaternion: Array = vectors[:, -1]
    return quaternion if quaternion[0] >= 0.0 else -quaternion


def turn_between(one: Pose, other: Pose) -> float:
    """Angle [rad] between the orientations of two poses."""
    between = quaternion_product(quaternion_inverse(one.quaternion), other.quaternion)
    return float(np.linalg.norm(rotation_vector_from_quaternion(between)))
