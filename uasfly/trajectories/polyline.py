"""Motion along straight lines: from rest to rest over a chain of corners that are passed in flight.

Between corners the velocity is constant; at each corner it changes from one vector to the next by a jerk-limited ramp
along their difference, centred on the moment at which the unrounded path would turn. The ramp's mean velocity is the
mean of both, so the chain arrives exactly where it should, acceleration and jerk never exceed their limits, and a
corner that changes nothing leaves no trace. With two corners this is the seven-phase S-curve.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from uasfly.messages import Array
from uasfly.trajectories.pieces import Pieces, rest, straight_pieces
from uasfly.trajectories.profile import MotionLimits, peak_speed, ramp_duration, ramp_phases

SAME_POINT_M = 1e-9


def chain(corners: Array, speeds: Sequence[float], limits: MotionLimits) -> Pieces:
    """Fly from rest at the first corner to rest at the last.

    Args:
        corners: (m + 1, d) with d = 3 for points [m], d = 1 for a path parameter.
        speeds: m highest speeds, one a side; a side too short for its speed is flown slower.
        limits: acceleration and jerk.
    """
    steps = np.diff(corners, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    keep = lengths > SAME_POINT_M
    if not keep.any():
        return straight_pieces([0.0], corners[0], np.zeros((1, corners.shape[1])))
    lengths, directions = lengths[keep], steps[keep] / lengths[keep, None]
    cruise = _fitting_speeds(lengths, directions, np.asarray(speeds, dtype=float)[keep], limits)

    changes = _changes(cruise, directions)
    sizes = np.linalg.norm(changes, axis=1)
    phases = [ramp_phases(float(size), limits) for size in sizes]
    ramps = np.array([2.0 * growing + constant for growing, constant in phases])
    cruising = np.maximum(lengths / cruise - 0.5 * (ramps[:-1] + ramps[1:]), 0.0)
    durations: list[float] = []
    jerks: list[Array] = []
    for corner, (growing, constant) in enumerate(phases):
        if ramps[corner] > 0.0:
            jerk = changes[corner] / (growing * (growing + constant))
            durations += [growing, constant, growing]
            jerks += [jerk, np.zeros_like(jerk), -jerk]
        if corner < len(cruising):
            durations.append(float(cruising[corner]))
            jerks.append(np.zeros(corners.shape[1]))
    return straight_pieces(durations, corners[0], np.array(jerks))


def move(start: Array, end: Array, speed: float, limits: MotionLimits) -> Pieces:
    """Fly straight from rest at `start` (d,) to rest at `end`."""
    return chain(np.stack((start, end)), [speed], limits)


def stop(position: Array, duration_s: float) -> list[Pieces]:
    """A stop of that duration, or nothing when it takes no time."""
    return [rest(position, duration_s)] if duration_s > 0.0 else []


def _changes(cruise: Array, directions: Array) -> Array:
    """Change of velocity at each corner, the first and the last included: (m + 1, d)."""
    velocities = np.zeros((len(cruise) + 2, directions.shape[1]))
    velocities[1:-1] = cruise[:, None] * directions
    return np.diff(velocities, axis=0)


def _fitting_speeds(lengths: Array, directions: Array, speeds: Array, limits: MotionLimits) -> Array:
    """Speeds, lowered until the ramps at both ends of every side fit into it."""
    if len(lengths) == 1:
        return np.minimum(speeds, peak_speed(float(lengths[0]), limits))
    cruise = speeds.copy()
    while True:
        sizes = np.linalg.norm(_changes(cruise, directions), axis=1)
        ramps = np.array([ramp_duration(float(size), limits) for size in sizes])
        available, needed = lengths / cruise, 0.5 * (ramps[:-1] + ramps[1:])
        tight = available < needed
        if not tight.any():
            return cruise
        # The root is exact where the acceleration limit rules and steady where the jerk does; slightly more ends it.
        cruise[tight] *= np.sqrt(available[tight] / needed[tight]) * (1.0 - 1e-7)
