"""The measurements, symbolically, and their Jacobians (Kalaitzakis & Vitzilaios 2023, eq. 6 and 7)."""

from __future__ import annotations

import casadi as ca

from uasfly.airframe import GRAVITY_M_S2
from uasfly.model import acceleration_in_world, quaternion_product, rotation_from_quaternion
from uasfly.observer import states as s
from uasfly.observer.error_state import (
    at_zero,
    conjugate,
    exponential,
    logarithm,
    pose_difference,
    retract,
    retract_pose,
)


def measure_position(core: ca.SX) -> ca.SX:
    """Position (3,) as GNSS gives it: y1a = p + b (eq. 6)."""
    return core[s.POSITION] + core[s.BIAS]


def measure_velocity(core: ca.SX) -> ca.SX:
    """Velocity (3,) as PX4 gives it.

    Eq. 6 has y2 = R' v, for a sensor on the body. PX4's velocity is its filter's, kept and corrected by GNSS in world
    axes: turning it into the body with the measured attitude would only add that attitude's error, correlated with y1b.
    """
    return core[s.VELOCITY] + core[s.VELOCITY_WANDER]


def measure_attitude(core: ca.SX) -> ca.SX:
    """Attitude (4,) as PX4 gives it: y1b = q of eq. 6, turned by its slow error."""
    return quaternion_product(core[s.QUATERNION], exponential(core[s.ATTITUDE_WANDER]))


def attitude_innovation(core: ca.SX, measured: ca.SX) -> ca.SX:
    """Innovation (3,) [rad] of a measured quaternion: the turn that leads to it from the expected one, body axes."""
    return logarithm(quaternion_product(conjugate(measure_attitude(core)), measured))


def measure_specific_force(core: ca.SX, thrust: ca.SX, drag: ca.SX) -> ca.SX:
    """What the accelerometer reads (3,) [m/s^2], body: R' (v' + g) of eq. 1.

    Along x and y that is the air's force alone: the thrust has no part in the plane of the rotors.
    """
    rotation = rotation_from_quaternion(core[s.QUATERNION])
    level = acceleration_in_world(core[s.VELOCITY], ca.SX.zeros(3), ca.SX(0.0), core[s.FORCE], drag)
    by_air = ca.mtimes(rotation.T, level + ca.DM([0.0, 0.0, GRAVITY_M_S2]))
    return by_air + ca.vertcat(0, 0, thrust)


def specific_force_jacobian(core: ca.SX, thrust: ca.SX, drag: ca.SX) -> ca.SX:
    """Derivative (3, 21) of `measure_specific_force` with respect to the error."""
    error = ca.SX.sym("error", s.CORE_ERROR)
    return at_zero(measure_specific_force(retract(core, error), thrust, drag), error)


def odometry_jacobian(core: ca.SX, sensor: int) -> ca.SX:
    """Derivative (3, 21) of a sensor's measurement with respect to the error; `sensor` indexes SENSORS."""
    error = ca.SX.sym("error", s.CORE_ERROR)
    if sensor == s.ATTITUDE_SENSOR:  # the same at every attitude: taken at the identity it comes out short
        level = ca.vertcat(core[: s.QUATERNION.start], 1, 0, 0, 0, core[s.QUATERNION.stop :])
        turn = quaternion_product(conjugate(measure_attitude(level)), measure_attitude(retract(level, error)))
        return at_zero(2.0 * turn[1:], error)
    moved = retract(core, error)
    return at_zero(measure_position(moved) if sensor == s.POSITION_SENSOR else measure_velocity(moved), error)


def measure_marker(core: ca.SX, marker: ca.SX) -> ca.SX:
    """Pose (7,) of a marker relative to the body: y3a = R' (p_M - p), y3b = q^-1 q_M (eq. 7)."""
    rotation = rotation_from_quaternion(core[s.QUATERNION])
    return ca.vertcat(
        ca.mtimes(rotation.T, marker[:3] - core[s.POSITION]),
        quaternion_product(conjugate(core[s.QUATERNION]), marker[3:]),
    )


def locate_marker(core: ca.SX, relative: ca.SX) -> ca.SX:
    """Pose (7,) in the world of a marker seen at `relative` (7,): the inverse of eq. 7, for its first sight."""
    rotation = rotation_from_quaternion(core[s.QUATERNION])
    return ca.vertcat(
        core[s.POSITION] + ca.mtimes(rotation, relative[:3]),
        quaternion_product(core[s.QUATERNION], relative[3:]),
    )


def marker_innovation(core: ca.SX, marker: ca.SX, relative: ca.SX) -> ca.SX:
    """Innovation (6,) of a marker sighting: position [m, body axes] and rotation [rad, marker axes] (eq. 7)."""
    expected = measure_marker(core, marker)
    turn = quaternion_product(conjugate(expected[3:]), relative[3:])
    return ca.vertcat(relative[:3] - expected[:3], logarithm(turn))


def marker_jacobians(core: ca.SX, marker: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Derivatives (6, 21) and (6, 6) of eq. 7 with respect to the core's and to the marker's error."""
    core_error, marker_error = ca.SX.sym("core_error", s.CORE_ERROR), ca.SX.sym("marker_error", s.MARKER_ERROR)
    expected = measure_marker(core, marker)
    by_core = pose_difference(expected, measure_marker(retract(core, core_error), marker))
    by_marker = pose_difference(expected, measure_marker(core, retract_pose(marker, marker_error)))
    return at_zero(by_core, core_error), at_zero(by_marker, marker_error)


def locating_jacobians(core: ca.SX, relative: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Derivatives (6, 21) and (6, 6) of `locate_marker` with respect to the core's error and to the sighting's."""
    core_error, noise = ca.SX.sym("core_error", s.CORE_ERROR), ca.SX.sym("noise", s.MARKER_ERROR)
    located = locate_marker(core, relative)
    by_core = pose_difference(located, locate_marker(retract(core, core_error), relative))
    by_noise = pose_difference(located, locate_marker(core, retract_pose(relative, noise)))
    return at_zero(by_core, core_error), at_zero(by_noise, noise)
