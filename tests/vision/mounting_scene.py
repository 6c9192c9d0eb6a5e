"""A vehicle that moves over a bundle, as an autopilot tells it and as a camera sees it; truth included."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from uasfly.messages import Array
from uasfly.vision.calibration.mounting.drift import WANDER_TIME_S, Noise
from uasfly.vision.calibration.mounting.fit import Belief, MountingFit
from uasfly.vision.calibration.mounting.observations import Motion, Sightings

DOWN = Rotation.from_euler("ZYX", (-90.0, 0.0, 180.0), degrees=True)
BUNDLE = np.array((0.2, 0.1, 0.0))
BUNDLE_TURNED = Rotation.from_euler("ZYX", (0.4, 0.0, 0.02))
SIGHTING_SIGMAS = np.array((0.002, 0.002, 0.004, 0.006, 0.006, 0.002))
SAMPLE_S = 0.01
USUAL = Noise(position_m=0.02, walk_m_sqrt_s=0.04, attitude_rad=0.0005, wander_rad=0.004)
TELEMETRY_RAD = 0.002  # scatter of a single attitude; its mean over half a second scatters by USUAL.attitude_rad


@dataclass(frozen=True)
class Flight:
    """What a calibration gets, and the truth."""

    motion: Motion
    sightings: Sightings
    camera_to_body: Rotation
    lever: Array
    offset_s: float
    heading_rad: float

    def belief(self) -> Belief:
        """As a camera file says that is a few degrees and centimetres wrong."""
        return Belief(DOWN.as_matrix(), np.zeros(3), heading_sigma_rad=math.radians(1.5))

    def error(self, fit: MountingFit) -> Array:
        """(6,) of a mounting: true turn on the left [rad, body axes] and lever arm [m]."""
        turn = self.camera_to_body * Rotation.from_matrix(fit.unknowns.camera_to_body).inv()
        return np.concatenate((turn.as_rotvec(), self.lever - fit.unknowns.lever))


def fly(
    seed: int,
    *,
    duration_s: float = 30.0,
    rate_hz: float = 8.0,
    yaw_rad: float = 2.0,
    tilt_rad: float = 0.2,
    way_m: float = 0.6,
    noise: Noise = USUAL,
) -> Flight:
    """A flight in slow circles, with turns and tilts as asked for; everything else is drawn."""
    rng = np.random.default_rng(seed)
    count = round(duration_s / SAMPLE_S)
    time_s = SAMPLE_S * np.arange(count, dtype=np.float64)
    phase = rng.uniform(0.0, 2.0 * math.pi, 6)
    rates = np.array((0.7, 0.9, 0.5))
    position = np.array((way_m, way_m, 0.3 * way_m)) * np.sin(rates * time_s[:, None] + phase[:3]) + (0.0, 0.0, 1.6)
    velocity = np.array((way_m, way_m, 0.3 * way_m)) * rates * np.cos(rates * time_s[:, None] + phase[:3])
    angles = np.array((yaw_rad, tilt_rad, tilt_rad)) * np.sin(np.array((0.4, 1.6, 2.1)) * time_s[:, None] + phase[3:])
    attitude = Rotation.from_euler("ZYX", angles)
    turns = (attitude[:-1].inv() * attitude[1:]).as_rotvec() / SAMPLE_S
    rate = np.concatenate((turns[:1], 0.5 * (turns[1:] + turns[:-1]), turns[-1:]))

    camera_to_body = Rotation.from_rotvec(rng.normal(0.0, 0.03, 3)) * DOWN
    lever, offset_s, heading_rad = rng.normal(0.0, 0.03, 3), float(rng.normal(0.0, 0.01)), float(rng.normal(0.0, 0.026))
    seen_s = np.arange(0.5, duration_s - 0.5, 1.0 / rate_hz)
    body = Slerp(time_s, attitude)(seen_s + offset_s)
    place = np.stack([np.interp(seen_s + offset_s, time_s, column) for column in position.T], axis=-1)
    camera = body * camera_to_body
    errors = noise.sighting_scale * SIGHTING_SIGMAS * rng.normal(size=(len(seen_s), 6))
    sightings = Sightings(
        seen_s,
        np.zeros(len(seen_s), dtype=np.intp),
        camera.inv().apply(BUNDLE - place - body.apply(lever)) - errors[:, :3],
        (camera.inv() * BUNDLE_TURNED * Rotation.from_rotvec(-errors[:, 3:])).as_matrix(),
        np.repeat(np.diag(SIGHTING_SIGMAS**2)[None], len(seen_s), axis=0),
        (3,),
    )
    walk = np.cumsum(noise.walk_m_sqrt_s * math.sqrt(SAMPLE_S) * rng.normal(size=(count, 3)), axis=0)
    held = rng.normal(size=(len(seen_s) + 1, 3))[np.clip((time_s - 0.5) * rate_hz + 0.5, 0, len(seen_s)).astype(int)]
    told = (
        Rotation.from_euler("Z", heading_rad)
        * attitude
        * Rotation.from_rotvec(_wander(rng, count, noise.wander_rad) + TELEMETRY_RAD * rng.normal(size=(count, 3)))
    )
    motion = Motion(
        time_s,
        position + walk + noise.position_m * held,
        velocity,
        np.roll(told.as_quat(), 1, axis=1),
        rate,
        np.zeros(count, dtype=np.intp),
    )
    return Flight(motion, sightings, camera_to_body, lever, offset_s, heading_rad)


def _wander(rng: np.random.Generator, count: int, sigma: float) -> Array:
    from scipy.signal import lfilter

    keep = math.exp(-SAMPLE_S / WANDER_TIME_S)
    drawn = sigma * rng.normal(size=(count, 3))
    drawn[1:] *= math.sqrt(1.0 - keep**2)
    return np.asarray(lfilter([1.0], [1.0, -keep], drawn, axis=0), dtype=float)
