"""From views to a bundle: start, adjustment, and what has to be left out on the way."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass

import numpy as np

from uasfly.bundle import Bundle, Family
from uasfly.camera import Camera
from uasfly.errors import UasflyError
from uasfly.messages import Array
from uasfly.vision.bundle_survey.adjustment import Adjusted, Adjustment, Observation
from uasfly.vision.bundle_survey.start import first_marker_poses, first_view_pose, plane_frame
from uasfly.vision.bundle_survey.views import View
from uasfly.vision.consistency import tolerance_px
from uasfly.vision.pose import Pose

LEAST_VIEWS = 3  # of a marker: one picture more than could agree by chance
_ROUNDS = 8
_WORST_SHARE = 0.2  # of the observations that may be rejected in a round: the worst ones bend the others
_OUTLIER = 4.0  # an observation this many times the median misfit is one, where the median is already small
_LEAST_OUTLIER_PX = 0.4


@dataclass(frozen=True, slots=True)
class SurveyedMarker:
    """One marker of the result.

    Attributes:
        marker_id: its id.
        pose: in the bundle's frame.
        views: pictures that it is from.
        position_sigma_m: (3,) standard deviations, bundle axes, relative to the origin marker.
        rotation_sigma_rad: (3,) the same of its rotation, its own axes.
        rms_px: distance of its corners from where they should be.
        size_m: its side, as told.
    """

    marker_id: int
    pose: Pose
    views: int
    position_sigma_m: Array
    rotation_sigma_rad: Array
    rms_px: float
    size_m: float


@dataclass(frozen=True, slots=True)
class SurveyResult:
    """What a survey has found.

    Attributes:
        origin: id of the marker whose frame the bundle's is, or that the bundle's frame is at.
        markers: by id, the origin among them.
        left_out: markers that are not in it, with the reason.
        views: names of the pictures that were used.
        rejected: pictures and markers in them that did not fit, with the reason.
        rms_px: of all corners that were used.
    """

    origin: int
    markers: list[SurveyedMarker]
    left_out: dict[int, str]
    views: list[str]
    rejected: list[str]
    rms_px: float

    def bundle(self, name: str, family: Family) -> Bundle:
        """The bundle file's content; rounded to a micrometre and 1e-7, so that a file holds exactly this."""
        markers = [
            {
                "id": marker.marker_id,
                "size_m": marker.size_m,
                "position_m": [round(float(value), 6) + 0.0 for value in marker.pose.position],
                "quaternion": [round(float(value), 7) + 0.0 for value in marker.pose.quaternion],
            }
            for marker in self.markers
        ]
        text = f"surveyed from {len(self.views)} pictures"
        fields = {"name": name, "description": text, "family": family, "markers": markers}
        return Bundle.model_validate(fields)


def survey_bundle(
    views: list[View],
    camera: Camera,
    sizes: dict[int, float],
    size_m: float,
    origin: int | None,
    *,
    plane: bool = False,
) -> SurveyResult:
    """Poses of the markers in the frame of one of them.

    Args:
        views: pictures with two markers or more.
        camera: the lens.
        sizes: sides [m] by id, where they differ from `size_m`.
        size_m: side of the others.
        origin: id of the marker at the origin; the one that most pictures see where not given.
        plane: turn the frame, so that z is normal to the plane through all markers.

    Raises:
        UasflyError: the origin is not seen, or no two markers are seen together often enough.
    """
    views, left_out = _often_seen(views)
    counts = Counter(marker for view in views for marker in view.seen)
    if not counts:
        raise UasflyError(
            f"the survey needs pictures that show two markers or more, each marker in {LEAST_VIEWS}; found "
            f"{_told(left_out) or 'none'}; take more pictures, or look at --family and --size"
        )
    if origin is None:
        origin = min(counts, key=lambda marker: (-counts[marker], marker))
    elif origin not in counts:
        why = left_out.get(origin, "it is in no picture that shows a second marker")
        seen = ", ".join(str(marker) for marker in sorted(counts))
        raise UasflyError(f"--origin: marker {origin} cannot be the origin: {why}; expected one of {seen}")
    every = {marker: sizes.get(marker, size_m) for marker in counts}
    markers = first_marker_poses(views, camera, every, origin)
    for marker in sorted(counts.keys() - markers.keys()):
        left_out[marker] = f"no chain of pictures joins it to the origin, marker {origin}"
    views = _only(views, set(markers))
    started = [(view, first_view_pose(view, camera, markers, every)) for view in views]
    kept = [(view, pose) for view, pose in started if pose is not None]
    return _Rounds(camera, every, origin, kept, markers, left_out).result(plane)


class _Rounds:
    """Adjusts, takes out what does not fit, and adjusts again until all fits."""

    def __init__(
        self,
        camera: Camera,
        sizes: dict[int, float],
        origin: int,
        views: list[tuple[View, Pose]],
        markers: dict[int, Pose],
        left_out: dict[int, str],
    ) -> None:
        self._camera, self._sizes, self._origin = camera, sizes, origin
        self._views, self._markers, self._left_out = views, markers, left_out
        self._rejected: list[str] = []

    def result(self, plane: bool) -> SurveyResult:
        for number in range(_ROUNDS):
            observations = [
                Observation(index, marker, view.seen[marker])
                for index, (view, _) in enumerate(self._views)
                for marker in sorted(view.seen)
            ]
            self._check()
            poses = [pose for _, pose in self._views]
            adjusted = Adjustment(self._camera, observations, self._markers, poses, self._sizes, self._origin).solve()
            if number == _ROUNDS - 1 or not self._take_out(observations, adjusted):
                break
        return self._summary(observations, adjusted, plane)

    def _check(self) -> None:
        if len(self._markers) < 2 or len(self._views) < LEAST_VIEWS:
            raise UasflyError(
                f"the survey has too little left that fits together: {len(self._markers)} markers in "
                f"{len(self._views)} pictures; expected 2 in {LEAST_VIEWS}. Look at --size, camera file and sharpness"
                + "".join(f"\n{text}" for text in self._rejected[:10])
            )

    def _take_out(self, observations: list[Observation], adjusted: Adjusted) -> bool:
        """Whether something did not fit and is out now; the poses go on from where they have come to."""
        misfits = adjusted.misfits_px
        usual = max(_OUTLIER * float(np.median(misfits)), _LEAST_OUTLIER_PX)
        limits = np.array(
            [min(tolerance_px(o.detection), max(usual, 5.0 * o.detection.sigma_px)) for o in observations]
        )
        over = misfits / limits
        order = np.argsort(-over)[: max(1, math.ceil(_WORST_SHARE * len(observations)))]
        bad = [int(index) for index in order if over[index] > 1.0 and over[index] > 0.3 * over.max()]
        views = [(View(view.name, dict(view.seen)), adjusted.views[i]) for i, (view, _) in enumerate(self._views)]
        for index in bad:
            view = views[observations[index].view][0]
            del view.seen[observations[index].marker_id]
            self._rejected.append(f"{view.name}: marker {observations[index].marker_id} is {misfits[index]:.2f} px off")
        before = {marker for view, _ in views for marker in view.seen}
        kept, seldom = _often_seen([view for view, _ in views])
        for marker, why in seldom.items():
            if marker in self._markers:
                self._left_out[marker] = f"{why} once those that do not fit are out"
        by_name = {view.name: view for view in kept}
        lost = [view.name for view, _ in views if view.name not in by_name]
        self._rejected += [f"{name}: fewer than two markers are left in it" for name in lost]
        self._views = [(by_name[view.name], pose) for view, pose in views if view.name in by_name]
        left = {marker for view in kept for marker in view.seen}
        if self._origin not in left:
            raise UasflyError(
                f"--origin: marker {self._origin} does not fit the others in enough pictures; is its size right? "
                f"Give --sizes {self._origin}=SIDE_M, or another --origin"
            )
        self._markers = {marker: pose for marker, pose in adjusted.markers.items() if marker in left}
        return bool(bad) or left != before

    def _summary(self, observations: list[Observation], adjusted: Adjusted, plane: bool) -> SurveyResult:
        squares: dict[int, list[float]] = {marker: [] for marker in adjusted.markers}
        for observation, misfit in zip(observations, adjusted.misfits_px, strict=True):
            squares[observation.marker_id].append(float(misfit) ** 2)
        frame = Pose(np.zeros(3), np.array((1.0, 0.0, 0.0, 0.0)))
        if plane:
            frame = plane_frame(adjusted.markers, self._sizes, self._origin)
        turn, markers = frame.rotation.T, []
        for marker, pose in sorted(adjusted.markers.items()):
            covariance = adjusted.covariances[marker]
            markers.append(
                SurveyedMarker(
                    marker,
                    frame.inverse.of_frame(pose),
                    len(squares[marker]),
                    np.sqrt(np.maximum(np.diag(turn @ covariance[:3, :3] @ turn.T), 0.0)),
                    np.sqrt(np.maximum(np.diag(covariance[3:, 3:]), 0.0)),
                    math.sqrt(float(np.mean(squares[marker]))),
                    self._sizes[marker],
                )
            )
        rms = float(np.sqrt(np.mean(adjusted.misfits_px**2)))
        names = [view.name for view, _ in self._views]
        return SurveyResult(self._origin, markers, self._left_out, names, self._rejected, rms)


def _only(views: list[View], markers: set[int]) -> list[View]:
    """The views without other markers; without those in which fewer than two remain."""
    parts = [View(v.name, {marker: seen for marker, seen in v.seen.items() if marker in markers}) for v in views]
    return [view for view in parts if len(view.seen) > 1]


def _often_seen(views: list[View]) -> tuple[list[View], dict[int, str]]:
    """The views with the markers that are seen often enough, and why the others are not in them."""
    seldom: dict[int, str] = {}
    while True:
        counts = Counter(marker for view in views for marker in view.seen)
        few = {marker for marker, count in counts.items() if count < LEAST_VIEWS}
        if not few:
            return views, dict(sorted(seldom.items()))
        for marker in few:
            seldom[marker] = f"seen with others in {counts[marker]} pictures, expected {LEAST_VIEWS}"
        views = _only(views, counts.keys() - few)


def _told(left_out: dict[int, str]) -> str:
    return "; ".join(f"marker {marker}: {why}" for marker, why in left_out.items())
