"""Motion along curves: the phase of a harmonic path runs from rest to rest under the motion law of a straight line."""

from __future__ import annotations

import numpy as np

from uasfly.messages import Array
from uasfly.trajectories.pieces import CUBIC, HARMONICS, PHASE, Pieces
from uasfly.trajectories.polyline import move
from uasfly.trajectories.profile import MotionLimits


def curve(
    start_phase: float,
    end_phase: float,
    speed: float,
    limits: MotionLimits,
    scale: float,
    center: Array,
    harmonics: Array,
    climb_per_phase: float = 0.0,
) -> Pieces:
    """Pieces of a path p(theta) = center + harmonics of theta + climb, its phase running from start to end.

    Args:
        start_phase: phase at the start [rad].
        end_phase: phase at the end [rad].
        speed: cruise speed [m/s] where the path moves `scale` metres a radian.
        limits: acceleration and jerk along the path, at the same place.
        scale: largest |dp/dtheta| [m/rad].
        center: (3,) [m]; its height is that of the start.
        harmonics: (4, 3) vectors of cos, sin, cos of twice and sin of twice the phase [m].
        climb_per_phase: [m/rad].
    """
    phase = move(np.array([start_phase]), np.array([end_phase]), speed / scale, limits.scaled(1.0 / scale))
    polynomials = phase.polynomials.copy()
    polynomials[:, 0, CUBIC] = center
    polynomials[:, :, CUBIC.stop - 1] += climb_per_phase * polynomials[:, :, PHASE]
    polynomials[:, 0, CUBIC.stop - 1] -= climb_per_phase * start_phase
    return Pieces(phase.durations_s, polynomials, np.broadcast_to(harmonics, (len(polynomials), HARMONICS, 3)).copy())
