"""A log as what a mounting is calibrated from: the vehicle's motion, and the bundles in the camera's own axes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from uasfly.bundle import Bundle
from uasfly.camera import Camera
from uasfly.errors import FileError
from uasfly.messages import MarkerSample, OdometrySample
from uasfly.record.reader import LogReader
from uasfly.vision.calibration.mounting.observations import Motion, Sightings
from uasfly.vision.mounting import seen_by_camera


@dataclass(frozen=True, slots=True)
class MountingLog:
    """What a log holds for the calibration of a mounting.

    Attributes:
        camera: the file that the sightings were made with; its mounting is taken out of them.
        motion: of the vehicle. sightings: of bundles in camera axes.
        bundles: that were seen through the camera's shutter; none where the sightings are drawn by a noise model.
        complete: whether the log has its end.
    """

    camera: Camera
    motion: Motion
    sightings: Sightings
    bundles: tuple[Bundle, ...]
    complete: bool


def read_mounting_log(path: Path) -> MountingLog:
    """Read a flight log.

    Raises:
        FileError: it is no flight log, was flown without a camera, or holds no odometry or no sightings.
    """
    reader = LogReader(path)
    camera, bundles = _sight(path, reader.description())
    motion: list[OdometrySample] = []
    seen: list[MarkerSample] = []
    for entry in reader.messages(OdometrySample, MarkerSample):
        message: OdometrySample | MarkerSample = entry.message
        if isinstance(message, OdometrySample):
            motion.append(message)
        else:
            seen.append(message)
    problems = [
        f"expected {what}, found none in it"
        for what, found in (("odometry of the vehicle", motion), ("sightings of a bundle", seen))
        if not found
    ]
    if problems:
        raise FileError(str(path), problems)
    return MountingLog(camera, _motion(motion), _sightings(camera, seen), bundles, reader.complete)


def _sight(path: Path, description: dict[str, Any]) -> tuple[Camera, tuple[Bundle, ...]]:
    sight = description.get("sight")
    if not isinstance(sight, dict):
        raise FileError(str(path), ["expected the log of a flight with a camera (--camera), found one without"])
    try:
        camera = Camera.model_validate(sight.get("camera"))
        bundles = tuple(Bundle.model_validate(bundle) for bundle in sight.get("bundles") or ())
    except ValidationError as error:
        raise FileError(
            str(path), [f"the camera or a bundle in its description cannot be used: {error.errors()[0]['msg']}"]
        ) from None
    # the noise model of rehearsals knows no rows
    return camera, () if sight.get("modelled") else bundles


def _motion(samples: list[OdometrySample]) -> Motion:
    """In the order of time, without what does not move on or is not finite."""
    rows = np.array(
        [
            (
                sample.time_s,
                *sample.position_in_world,
                *sample.velocity_in_world,
                *sample.quaternion_body_to_world,
                *sample.angular_rate_in_body,
                sample.reset_counter,
            )
            for sample in samples
        ]
    )
    rows = rows[np.isfinite(rows).all(axis=1) & (np.abs(np.linalg.norm(rows[:, 7:11], axis=1) - 1.0) < 0.01)]
    rows = rows[np.unique(rows[:, 0], return_index=True)[1]]
    jumps = np.cumsum(np.diff(rows[:, 14], prepend=rows[:1, 14]) != 0.0)
    return Motion(rows[:, 0], rows[:, 1:4], rows[:, 4:7], rows[:, 7:11], rows[:, 11:14], jumps.astype(np.intp))


def _sightings(camera: Camera, samples: list[MarkerSample]) -> Sightings:
    samples = sorted(samples, key=lambda sample: sample.time_s)
    ids = sorted({sample.marker_id for sample in samples})
    poses, covariances = zip(*(seen_by_camera(camera, sample) for sample in samples), strict=True)
    return Sightings(
        np.array([sample.time_s for sample in samples]),
        np.array([ids.index(sample.marker_id) for sample in samples], dtype=np.intp),
        np.array([pose.position for pose in poses]),
        np.array([pose.rotation for pose in poses]),
        np.array(covariances),
        tuple(ids),
    )
