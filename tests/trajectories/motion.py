"""What the tests of the trajectories share: missions in few words, and the check that derivatives are derivatives."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from uasfly.airframe import Limits
from uasfly.messages import Array, ReferenceHorizon
from uasfly.mission import Mission
from uasfly.trajectories.mission_trajectory import MissionTrajectory
from uasfly.trajectories.trajectory import Trajectory

LIMITS = Limits(
    wind_m_s=10.0,
    tilt_deg=30.0,
    thrust_min=0.1,
    thrust_max=0.7,
    speed_m_s=5.0,
    climb_m_s=2.0,
    descent_m_s=1.0,
    acceleration_m_s2=3.0,
    yaw_rate_deg_s=90.0,
)
LegFields = Mapping[str, object]  # a leg as its file says it
HOME = np.array((0.0, 0.0, 1.5))


def mission(*legs: LegFields, **fields: object) -> Mission:
    """A mission of these legs that takes off to 1.5 m."""
    return Mission.model_validate({"name": "test", "takeoff": {"height_m": 1.5}, "legs": legs, **fields})


def fly(*legs: LegFields, start: Array = HOME, start_yaw: float = 0.0, **fields: object) -> MissionTrajectory:
    """The trajectory of a mission of these legs."""
    return MissionTrajectory(mission(*legs, **fields), LIMITS, start, start_yaw)


def leg_samples(trajectory: MissionTrajectory, leg: int, step_s: float = 0.01) -> ReferenceHorizon:
    """A leg, from its first to its last moment."""
    (span,) = (span for span in trajectory.spans if span.is_leg and span.leg == leg)
    count = max(2, round((span.end_s - span.start_s) / step_s) + 1)
    return trajectory.sample(np.linspace(span.start_s, span.end_s, count))


def assert_consistent(
    trajectory: Trajectory, jerk: float, yaw_acceleration: float = 50.0, step_s: float = 2e-3
) -> None:
    """Velocity, acceleration and yaw rate are the derivatives of position, velocity and yaw, everywhere.

    Central differences over 2 h miss a piecewise smooth function's derivative by at most h/2 times the jump of the next
    one (h^2/6 times the one after, where there is none), so the tolerances follow from the bound on jerk.
    """
    times = np.arange(-1.0, trajectory.duration_s + 1.0, step_s)
    h = 1e-4
    here, before, after = (trajectory.sample(times + shift) for shift in (0.0, -h, h))
    velocity = (after.position_in_world - before.position_in_world) / (2.0 * h)
    acceleration = (after.velocity_in_world - before.velocity_in_world) / (2.0 * h)
    yaw_rate = (after.yaw_rad - before.yaw_rad) / (2.0 * h)
    np.testing.assert_allclose(here.velocity_in_world, velocity, atol=h**2 * jerk + 1e-9)
    np.testing.assert_allclose(here.acceleration_in_world, acceleration, atol=h * jerk + 1e-9)
    np.testing.assert_allclose(here.yaw_rate_rad_s, yaw_rate, atol=h * yaw_acceleration)


def peak(vectors: Array) -> float:
    """Largest length of the rows."""
    return float(np.linalg.norm(vectors, axis=1).max())


def peak_jerk(trajectory: Trajectory, step_s: float = 1e-3) -> float:
    """Largest mean jerk over steps: the slope of the acceleration, which a jump would make huge."""
    times = np.arange(-1.0, trajectory.duration_s + 1.0, step_s)
    return peak(np.diff(trajectory.sample(times).acceleration_in_world, axis=0)) / step_s
