"""First poses for the adjustment: pairs of markers that are seen together, then a tree of pairs from the origin.

A marker alone has two poses in a picture (IPPE), so a pair has four relative poses. The true one is the same in all
pictures, the false ones change with the direction of view: the one that most pictures agree with is taken.
"""

from __future__ import annotations

import heapq
from itertools import combinations

import numpy as np

from uasfly.camera import Camera
from uasfly.messages import Array
from uasfly.vision.bundle_survey.views import View
from uasfly.vision.pose import Pose, fit_pose
from uasfly.vision.square import quaternion_of, square_poses

_TURN_CAP_RAD = 0.15  # relative poses that differ by more disagree
_SHIFT_CAP = 0.15  # the same of positions, as a share of the distance from the camera
_MOST_PER_PAIR = 40  # pictures that a pair is taken from
_ORIGIN = Pose(np.zeros(3), np.array((1.0, 0.0, 0.0, 0.0)))
_SQUARE = np.array(((-0.5, 0.5, 0.0), (0.5, 0.5, 0.0), (0.5, -0.5, 0.0), (-0.5, -0.5, 0.0)))


def square_corners(size_m: float) -> Array:
    """Corners (4, 3) [m] of a marker in its own frame: top-left, top-right, bottom-right, bottom-left."""
    return size_m * _SQUARE


def first_marker_poses(views: list[View], camera: Camera, sizes: dict[int, float], origin: int) -> dict[int, Pose]:
    """Rough poses of the markers in the frame of `origin`; those that no chain of pairs leads to are not in it.

    Args:
        views: what is seen.
        camera: the lens.
        sizes: sides [m] of all markers by id.
        origin: id of the marker whose frame it is.
    """
    candidates = [
        {marker: square_poses(camera.normalise(seen.corners), sizes[marker]) for marker, seen in view.seen.items()}
        for view in views
    ]
    together: dict[tuple[int, int], list[int]] = {}
    for index, view in enumerate(views):
        for pair in combinations(sorted(view.seen), 2):
            together.setdefault(pair, []).append(index)
    edges: dict[int, list[tuple[float, int, Pose]]] = {}
    for (a, b), where in together.items():
        sample = where[:: max(1, len(where) // _MOST_PER_PAIR)]
        pose, support = _agreed([([p for p, _ in candidates[i][a]], [p for p, _ in candidates[i][b]]) for i in sample])
        edges.setdefault(a, []).append((-support, b, pose))
        edges.setdefault(b, []).append((-support, a, pose.inverse))
    return _tree(edges, origin)


def _agreed(pairs: list[tuple[list[Pose], list[Pose]]]) -> tuple[Pose, float]:
    """The pose of b in a's frame that most pictures agree with, and how many do."""
    poses, picture, depth = [], [], []
    for index, (of_a, of_b) in enumerate(pairs):
        for a in of_a:
            for b in of_b:
                poses.append(a.inverse.of_frame(b))
                picture.append(index)
                depth.append(float(np.linalg.norm(b.position)))
    turns = np.array([pose.quaternion for pose in poses])
    places = np.array([pose.position for pose in poses])
    far = np.minimum.outer(np.array(depth), np.array(depth))
    turn = 2.0 * np.arccos(np.clip(np.abs(turns @ turns.T), 0.0, 1.0)) / _TURN_CAP_RAD
    shift = np.linalg.norm(places[:, None] - places[None], axis=2) / (_SHIFT_CAP * far)
    agreement = np.clip(1.0 - np.hypot(turn, shift), 0.0, 1.0)
    numbers = np.array(picture)
    support = np.zeros(len(poses))
    for index in range(len(pairs)):
        support += agreement[:, numbers == index].max(axis=1, initial=0.0)
    best = int(np.argmax(support))
    return poses[best], float(support[best])


def _tree(edges: dict[int, list[tuple[float, int, Pose]]], origin: int) -> dict[int, Pose]:
    """Poses in the origin's frame along the tree of the best supported pairs (Prim)."""
    poses: dict[int, Pose] = {origin: _ORIGIN}
    queue = [(support, marker, origin, index) for index, (support, marker, _) in enumerate(edges.get(origin, []))]
    heapq.heapify(queue)
    while queue:
        _, marker, parent, index = heapq.heappop(queue)
        if marker in poses:
            continue
        poses[marker] = poses[parent].of_frame(edges[parent][index][2])
        for at, (support, other, _) in enumerate(edges[marker]):
            if other not in poses:
                heapq.heappush(queue, (support, other, marker, at))
    return poses


def first_view_pose(view: View, camera: Camera, markers: dict[int, Pose], sizes: dict[int, float]) -> Pose | None:
    """Pose of the markers' common frame in a picture's camera axes: the best of what each marker says, refined."""
    known = [marker for marker in view.seen if marker in markers]
    if not known:
        return None
    points = np.concatenate([markers[marker].points(square_corners(sizes[marker])) for marker in known])
    pixels = np.concatenate([view.seen[marker].corners for marker in known])
    side = np.concatenate([np.full(4, np.ptp(view.seen[marker].corners, axis=0).max()) for marker in known])
    best, best_cost = None, np.inf
    for marker in known:
        for pose, _ in square_poses(camera.normalise(view.seen[marker].corners), sizes[marker]):
            hypothesis = pose.of_frame(markers[marker].inverse)
            misfit = np.linalg.norm(pixels - camera.project(hypothesis.points(points)), axis=1) / (0.5 * side)
            cost = float(np.minimum(np.nan_to_num(misfit, nan=1.0), 1.0).sum())
            if cost < best_cost:
                best, best_cost = hypothesis, cost
    if best is None:
        return None
    fit = fit_pose(camera, best, points, pixels, np.maximum(0.05 * side, 1.0))
    return best if fit is None else fit.pose


def plane_frame(poses: dict[int, Pose], sizes: dict[int, float], origin: int) -> Pose:
    """Frame at the origin marker whose z is normal to the plane through all corners and whose x is the marker's."""
    corners = np.concatenate([pose.points(square_corners(sizes[marker])) for marker, pose in poses.items()])
    _, _, axes = np.linalg.svd(corners - corners.mean(axis=0))
    own = poses[origin].rotation
    z = axes[2] * (1.0 if axes[2] @ own[:, 2] >= 0.0 else -1.0)
    x = own[:, 0] - (own[:, 0] @ z) * z
    x /= np.linalg.norm(x)
    return Pose(poses[origin].position, quaternion_of(np.column_stack((x, np.cross(z, x), z))))
