"""Pose of a bundle from every visible corner at once, without the markers that do not belong.

Each marker alone has two poses; each gives a hypothesis about the bundle. The one that most markers agree with is
refined on all of their corners, markers that do not fit are taken out one by one. A flat bundle far away may still be
seen in two ways: the second is refined too, the prediction tells them apart, the covariance holds the doubt left.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from uasfly.bundle import Bundle, BundleMarker
from uasfly.camera import Camera
from uasfly.messages import Array
from uasfly.vision.consistency import LeftOut, explain, implausible, side_px, tolerance_px
from uasfly.vision.detectors import Detection
from uasfly.vision.pose import Pose, PoseFit, fit_pose, pixel_residuals
from uasfly.vision.square import quaternion_of, square_poses, turn_between

_MOST_HYPOTHESES = 8  # markers that are asked for their poses, the largest ones
_PREDICTED_TURN_RAD = 0.06  # how well the prediction's orientation is known
_SAME_TURN_RAD = math.radians(1.0)
_DOUBT = 0.05  # probability of the other pose from which on a pose is called ambiguous
_FLAT = 1e-3


@dataclass(frozen=True, slots=True)
class BundleSight:
    """What a picture says about a bundle.

    Attributes:
        pose: bundle to camera; None where no marker can be used.
        covariance: (6, 6) of position [m^2, camera axes] and rotation [rad^2, bundle axes]; None without a pose.
        used: ids of the markers that made it.
        left_out: the others, with reasons.
        residual_px: RMS of the used corners; NaN without a pose.
        ambiguous: the bundle may be tilted the other way: the covariance's rotation says so too.
    """

    pose: Pose | None
    covariance: Array | None
    used: tuple[int, ...]
    left_out: tuple[LeftOut, ...]
    residual_px: float = math.nan
    ambiguous: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class _Entry:
    detection: Detection
    marker: BundleMarker
    hypotheses: tuple[Pose, ...]


def solve_bundle(
    bundle: Bundle, camera: Camera, detections: list[Detection], prediction: Pose | None = None
) -> BundleSight:
    """Pose of the bundle in camera axes from the markers found in a picture.

    Args:
        bundle: the markers and their places.
        camera: the lens.
        detections: markers of the bundle's family.
        prediction: its pose in camera axes as the filter expects it; tells the two poses of a flat marker apart.
    """
    entries, left_out = _plausible(bundle, camera, detections)
    active = _agreeing(camera, entries, prediction)
    fit = _fit(camera, active, prediction)
    while fit is not None and (bad := _worst(camera, active, fit.pose, prediction)) is not None:
        active = [entry for entry in active if entry is not bad]
        if _contradiction(camera, [*active, bad], prediction):
            active = []
        fit = _fit(camera, active, prediction)
    if fit is None:
        text = "the markers contradict each other, and nothing says which are right" if entries else ""
        left_out += [LeftOut(e.detection.marker_id, e.detection.corners, "contradicts", text) for e in entries]
        return BundleSight(None, None, (), tuple(left_out))
    for entry in entries:
        if entry in active:
            continue
        if entry.marker.id in {other.marker.id for other in active}:
            text = "the same id is nearer to where it belongs"
            left_out.append(LeftOut(entry.marker.id, entry.detection.corners, "seen twice", text))
        else:
            left_out.append(explain(bundle, camera, fit.pose, entry.marker, entry.detection))
    fit, doubt = _either_way(camera, active, fit, prediction)
    residual = float(np.sqrt((fit.residuals_px**2).sum(axis=1).mean()))
    used = tuple(sorted(entry.marker.id for entry in active))
    return BundleSight(fit.pose, fit.covariance, used, tuple(left_out), residual, doubt > _DOUBT)


def _plausible(bundle: Bundle, camera: Camera, detections: list[Detection]) -> tuple[list[_Entry], list[LeftOut]]:
    entries: list[_Entry] = []
    left_out: list[LeftOut] = []
    focal = 0.5 * (camera.fx + camera.fy)
    for detection in detections:
        marker = bundle.by_id.get(detection.marker_id)
        if marker is None:
            text = f"the bundle {bundle.name} has no marker {detection.marker_id}"
            left_out.append(LeftOut(detection.marker_id, detection.corners, "not in the bundle", text))
            continue
        plane = camera.normalise(detection.corners)
        poses = square_poses(plane, marker.size_m) if np.isfinite(plane).all() else []
        problem = implausible(detection, focal * poses[0][1] if poses else None)
        if problem:
            left_out.append(LeftOut(detection.marker_id, detection.corners, "torn", problem))
            continue
        place = Pose(marker.position, marker.unit_quaternion).inverse
        entries.append(_Entry(detection, marker, tuple(pose.of_frame(place) for pose, _ in poses)))
    return entries, left_out


def _arrays(camera: Camera, entries: list[_Entry]) -> tuple[Array, Array, Array]:
    """Points (4n, 3) m in the bundle, pixels (4n, 2) and their sigmas (4n,)."""
    points = np.concatenate([entry.marker.corners for entry in entries])
    pixels = np.concatenate([entry.detection.corners for entry in entries])
    sigma = np.repeat([max(entry.detection.sigma_px, camera.pixel_sigma) for entry in entries], 4)
    return points, pixels, sigma


def _misfits(camera: Camera, entries: list[_Entry], pose: Pose) -> Array:
    """RMS distance (n,) [px] of each marker's corners from where the pose puts them; infinite behind the camera."""
    points, pixels, _ = _arrays(camera, entries)
    distance = pixels - camera.project(pose.points(points))
    rms = np.sqrt((distance**2).sum(axis=1).reshape(-1, 4).mean(axis=1))
    return np.where(np.isfinite(rms), rms, np.inf)


def _agreeing(camera: Camera, entries: list[_Entry], prediction: Pose | None) -> list[_Entry]:
    """The markers that agree, roughly, with the hypothesis that most of them agree with."""
    if not entries:
        return []
    largest = sorted(entries, key=lambda entry: -side_px(entry.detection.corners))[:_MOST_HYPOTHESES]
    hypotheses = [pose for entry in largest for pose in entry.hypotheses]
    if prediction is not None:
        hypotheses.append(prediction)
    # One marker's tilt is rough, so that its neighbours' places are: they may be a fifth of a side away.
    caps = np.array([3.0 * tolerance_px(e.detection) + 0.2 * side_px(e.detection.corners) for e in entries])
    costs = []
    for pose in hypotheses:
        cost = float(np.minimum(_misfits(camera, entries, pose) / caps, 1.0).sum())
        turn = 0.0 if prediction is None else min(turn_between(pose, prediction), 1.0)
        costs.append(cost + 1e-3 * turn)
    best = hypotheses[int(np.argmin(costs))]
    misfits = _misfits(camera, entries, best)
    active: list[_Entry] = []
    for index in np.argsort(misfits):
        known = {entry.marker.id for entry in active}
        if misfits[index] < caps[index] and entries[index].marker.id not in known:
            active.append(entries[index])
    start = _refined(camera, active, best)
    if start is None:
        return active
    misfits = _misfits(camera, entries, start.pose)  # with the refined pose some more may agree
    for index in np.argsort(misfits):
        known = {entry.marker.id for entry in active}
        if misfits[index] < tolerance_px(entries[index].detection) and entries[index].marker.id not in known:
            active.append(entries[index])
    return active


def _refined(camera: Camera, entries: list[_Entry], start: Pose) -> PoseFit | None:
    return fit_pose(camera, start, *_arrays(camera, entries)) if entries else None


def _fit(camera: Camera, entries: list[_Entry], prediction: Pose | None) -> PoseFit | None:
    """Best fit of these markers from the hypotheses of the largest of them, and from the prediction."""
    if not entries:
        return None
    largest = max(entries, key=lambda entry: side_px(entry.detection.corners))
    starts = [*largest.hypotheses, *([prediction] if prediction is not None else [])]
    fits = [fit for start in starts if (fit := _refined(camera, entries, start)) is not None]
    return min(fits, key=_square_sum) if fits else None


def _square_sum(fit: PoseFit) -> float:
    return float((fit.residuals_px**2).sum())


def _worst(camera: Camera, active: list[_Entry], pose: Pose, prediction: Pose | None) -> _Entry | None:
    """The marker to take out, None where all fit: the one without which the others fit best."""
    if len(active) < 2:
        return None
    misfits = _misfits(camera, active, pose)
    if all(misfit <= tolerance_px(entry.detection) for misfit, entry in zip(misfits, active, strict=True)):
        return None
    if len(active) == 2:
        by = prediction if prediction is not None else pose
        return active[int(np.argmax(_misfits(camera, active, by)))]
    rests = []
    for index in np.argsort(-misfits)[:_MOST_HYPOTHESES]:
        others = [entry for entry in active if entry is not active[index]]
        fit = _fit(camera, others, prediction)
        if fit is not None:
            rests.append((_square_sum(fit), int(index)))
    return active[min(rests)[1]] if rests else active[int(np.argmax(misfits))]


def _contradiction(camera: Camera, two: list[_Entry], prediction: Pose | None) -> bool:
    """Whether two markers disagree and the prediction does not say which one is right."""
    if len(two) != 2:
        return False
    if prediction is None:
        return True
    good, bad = sorted(_misfits(camera, two, prediction))
    return bool(bad < 2.0 * good)


def _either_way(camera: Camera, entries: list[_Entry], fit: PoseFit, prediction: Pose | None) -> tuple[PoseFit, float]:
    """The better of the two poses of a flat bundle, and the probability of the other one.

    Seen from far away, a flat thing tilted one way looks like the same thing tilted the other way: with v the line of
    sight and m the flat thing's normal, (I - 2 v v') R (I - 2 m m') projects its points alike. The covariance of the
    result grows by the other pose's distance times its probability.
    """
    points, pixels, sigma = _arrays(camera, entries)
    centre = points.mean(axis=0)
    _, spread, axes = np.linalg.svd(points - centre)
    if spread[2] > _FLAT * spread[0]:
        return fit, 0.0
    normal, rotation = axes[2], fit.pose.rotation
    middle = rotation @ centre + fit.pose.position
    sight = middle / np.linalg.norm(middle)
    turned = (np.eye(3) - 2.0 * np.outer(sight, sight)) @ rotation @ (np.eye(3) - 2.0 * np.outer(normal, normal))
    start = Pose(middle - turned @ centre, quaternion_of(turned))
    other = fit_pose(camera, start, points, pixels, sigma)
    if other is None or turn_between(other.pose, fit.pose) < _SAME_TURN_RAD:
        return fit, 0.0
    scale = min(fit.scale, other.scale)
    costs = []
    for candidate in (fit, other):
        cost = 0.5 * float((candidate.residuals_px**2 / sigma[:, None] ** 2).sum()) / scale**2
        if prediction is not None:
            cost += 0.5 * (turn_between(candidate.pose, prediction) / _PREDICTED_TURN_RAD) ** 2
        costs.append(cost)
    best, rest = (fit, other) if costs[0] <= costs[1] else (other, fit)
    doubt = 1.0 / (1.0 + math.exp(min(abs(costs[0] - costs[1]), 700.0)))
    distance = rest.pose.minus(best.pose)
    covariance = best.covariance + doubt * np.outer(distance, distance)
    residuals, _ = pixel_residuals(camera, best.pose, points, pixels)
    return PoseFit(best.pose, covariance, residuals, best.scale), doubt
