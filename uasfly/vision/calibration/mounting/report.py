"""A calibrated mounting for files, scripts and eyes: fields of a camera file, comments, JSON, a picture."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from uasfly.camera import Camera
from uasfly.errors import FileError, UasflyError
from uasfly.frames import euler_from_quaternion, quaternion_from_euler, rotation_matrix
from uasfly.vision.calibration.mounting.fit import MountingFit
from uasfly.vision.calibration.mounting.missing import Missing
from uasfly.vision.square import quaternion_of

_SAME_RAD = 1e-7  # angles that give back the rotation
_SPAN_SHARE = (5.0, 95.0)  # percentiles between which a span of motion is told


def mounting_fields(fit: MountingFit, latency_s: float | None = None) -> dict[str, object]:
    """Fields of a camera file; None takes one out.

    Args:
        fit: the mounting.
        latency_s: the camera's latency with the time offset taken in, see `latency`; None leaves it as it is.

    Raises:
        UasflyError: the latency would be negative.
    """
    quaternion = quaternion_of(fit.unknowns.camera_to_body)
    angles = euler_from_quaternion(quaternion)
    away = rotation_matrix(quaternion_from_euler(*angles)) - fit.unknowns.camera_to_body
    plain = bool(np.abs(away).max() < _SAME_RAD)  # else it looks along the axis where roll and yaw are one
    degrees = [round(math.degrees(angle), 4) for angle in angles]
    turn, lever = fit.worst_sigmas
    fields: dict[str, object] = {
        "transform_camera_to_body.position_m": [round(float(value), 5) for value in fit.unknowns.lever],
        "transform_camera_to_body.rpy_deg": degrees if plain else None,
        "transform_camera_to_body.quaternion": None if plain else [round(float(value), 9) for value in quaternion],
        "mounting_sigma_m": float(f"{lever:.2g}"),
        "mounting_sigma_deg": float(f"{math.degrees(turn):.2g}"),
    }
    if latency_s is not None:
        fields["latency_s"] = round(latency_s, 5)
    return fields


def latency(fit: MountingFit, camera: Camera) -> float:
    """Latency [s] of the camera that the log was made with, mended by the time offset.

    Raises:
        UasflyError: it would be negative.
    """
    latency_s = camera.latency_s - fit.unknowns.offset_s
    if latency_s < 0.0:
        raise UasflyError(
            f"--latency: expected a latency of 0 s or more, found {latency_s:.4f} s: the vehicle's odometry is later "
            "than it says, by more than the camera; leave --latency out"
        )
    return latency_s


def mounting_comments(fit: MountingFit, log: str, date: str) -> list[str]:
    """Comments of a camera file."""
    turns = " ".join(f"{math.degrees(value):.2g}" for value in fit.turn_sigma_rad)
    levers = " ".join(f"{1000.0 * value:.2g}" for value in fit.lever_sigma_m)
    used = int(np.count_nonzero(fit.weights))
    return [
        f"calibrated on {date} from {used} sightings in {log}",
        f"standard deviations about and along the body's axes: rotation {turns} deg, position {levers} mm",
    ]


def mounting_record(fit: MountingFit, stated: Camera, lacks: Missing | None) -> dict[str, Any]:
    """Plain data for scripts.

    Args:
        fit: the mounting.
        stated: the camera's file; how far the mounting is from it is told.
        lacks: motion that the log lacks.
    """
    unknowns, placement = fit.unknowns, stated.transform_camera_to_body
    turned = Rotation.from_matrix(unknowns.camera_to_body @ placement.rotation.T).as_rotvec(degrees=True)
    scatter = fit.residuals[fit.weights > 0.0]
    return {
        "known": lacks is None,
        "missing": None if lacks is None else {"motions": list(lacks.motions), "text": lacks.text},
        **{name: value for name, value in mounting_fields(fit).items() if value is not None},
        "turned_deg": [float(value) for value in turned],
        "moved_m": [float(value) for value in unknowns.lever - placement.position],
        "sigmas": {
            "turn_deg": np.degrees(fit.turn_sigma_rad).tolist(),
            "position_m": fit.lever_sigma_m.tolist(),
        },
        "covariance": fit.covariance[:6, :6].tolist(),
        "time_offset_s": unknowns.offset_s,
        "time_offset_sigma_s": fit.offset_sigma_s,
        "heading_error_deg": math.degrees(unknowns.heading_rad),
        "heading_error_sigma_deg": math.degrees(fit.heading_sigma_rad),
        "sightings": {
            "used": int(np.count_nonzero(fit.weights)),
            "left_out": int(np.count_nonzero(fit.weights == 0.0)),
            "bundles": list(fit.sightings.ids),
            "position_rms_m": _rms(scatter[:, :3]),
            "rotation_rms_deg": math.degrees(_rms(scatter[:, 3:])),
        },
        "disturbances": {
            "sighting_scale": fit.noise.sighting_scale,
            "position_white_m": fit.noise.position_m,
            "position_walk_m_sqrt_s": fit.noise.walk_m_sqrt_s,
            "attitude_white_deg": math.degrees(fit.noise.attitude_rad),
            "attitude_wander_deg": math.degrees(fit.noise.wander_rad),
        },
        "motion": motion_spans(fit),
    }


def motion_spans(fit: MountingFit) -> dict[str, float]:
    """What the vehicle did while bundles were seen, without the outermost tenth: yaw, roll, pitch [deg], way [m]."""
    place = fit.track.at(fit.unknowns.offset_s)
    yaw, pitch, roll = Rotation.from_matrix(place.rotation).as_euler("ZYX", degrees=True).T
    yaw = np.degrees(np.unwrap(np.radians(yaw)))
    away = np.linalg.norm(np.ptp(np.percentile(place.position, _SPAN_SHARE, axis=0), axis=0))
    return {
        "seconds": float(fit.sightings.time_s[-1] - fit.sightings.time_s[0]),
        **{name: _span(values) for name, values in (("yaw_deg", yaw), ("roll_deg", roll), ("pitch_deg", pitch))},
        "way_m": float(away),
    }


def write_mounting_picture(path: Path, fit: MountingFit) -> None:
    """Residuals over time, and the errors of the vehicle's motion that were taken off (PNG).

    Raises:
        FileError: the file cannot be written.
    """
    from uasfly.plotting import quiet_figure, save

    time_s = fit.sightings.time_s - fit.sightings.time_s[0]
    used = fit.weights > 0.0
    drift = fit.errors
    figure, panels = quiet_figure(4, 1, (9.0, 10.0), share_x=True)
    rows = (
        (1000.0 * fit.residuals[:, :3], "position [mm]", "xyz", "Residuals of the sightings, body axes"),
        (np.degrees(fit.residuals[:, 3:]), "rotation [deg]", "xyz", "Residuals of the sightings, bundle axes"),
        (drift[:, :3], "position [m]", "enu", "Slow error of the vehicle's position, from the first sighting"),
        (np.degrees(drift[:, 3:]), "attitude [deg]", "xyz", "Slow error of its attitude, body axes"),
    )
    for index, ((values, label, names, title), axes) in enumerate(zip(rows, panels[:, 0], strict=True)):
        for column, name in zip(values.T, names, strict=True):
            axes.plot(time_s[used], column[used], ".", markersize=3.0, label=name)
        if index < 2:
            limit = 1.3 * float(np.abs(values[used]).max())
            axes.set_ylim(-limit, limit)
            for when in time_s[~used]:
                axes.axvline(when, ymax=0.05, color="#c23b3b", linewidth=1.0)
        axes.set_ylabel(label)
        axes.set_title(title, fontsize=10)
        axes.legend(loc="upper right", fontsize=8, ncols=3)
    panels[-1, 0].set_xlabel("time [s]; red at the bottom: sightings that were left out")
    try:
        save(figure, path)
    except OSError as error:
        raise FileError(str(path), [f"the picture cannot be written: {error.strerror or error}"]) from None


def _rms(values: Any) -> float:
    return float(np.sqrt((np.asarray(values) ** 2).sum(axis=1).mean()))


def _span(values: Any) -> float:
    low, high = np.percentile(values, _SPAN_SHARE)
    return float(high - low)
