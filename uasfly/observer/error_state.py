"""The error-state calculus, symbolically: manifold, discrete model, its Jacobians and noise (eq. 4, 5).

Kalaitzakis & Vitzilaios 2023. The dynamics are `uasfly.model`'s; every Jacobian here is CasADi's derivative of them
along the manifold at zero error, nothing is derived by hand. Rotation errors are local: q = q_nominal * exp(error).
"""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca

from uasfly.model import body_dynamics, quaternion_product
from uasfly.observer import states as s

_SERIES_TERMS = 6


def exponential(rotation: ca.SX) -> ca.SX:
    """Unit quaternion (4,) of a rotation vector (3,) [rad] up to about 1 rad.

    A power series in the squared angle: smooth at zero, so that it can be differentiated there (error 1e-14 at 1 rad).
    """
    squared = 0.25 * ca.dot(rotation, rotation)
    cosine, sinc = ca.SX(1.0), ca.SX(1.0)
    for k in range(_SERIES_TERMS, 0, -1):
        cosine = 1.0 - cosine * squared / (2 * k * (2 * k - 1))
        sinc = 1.0 - sinc * squared / (2 * k * (2 * k + 1))
    return ca.vertcat(cosine, 0.5 * sinc * rotation)


def logarithm(quaternion: ca.SX) -> ca.SX:
    """Shortest rotation vector (3,) [rad] of a unit quaternion (4,), of any size."""
    vector = quaternion[1:]
    norm = ca.sqrt(ca.dot(vector, vector) + 1e-30)  # the term keeps 0/0 away
    sign = ca.if_else(quaternion[0] < 0.0, -1.0, 1.0)
    return sign * 2.0 * ca.atan2(norm, sign * quaternion[0]) / norm * vector


def conjugate(quaternion: ca.SX) -> ca.SX:
    """Inverse (4,) of a unit quaternion."""
    return ca.vertcat(quaternion[0], -quaternion[1:])


def retract(nominal: ca.SX, error: ca.SX) -> ca.SX:
    """Nominal state with an error added along the manifold; core alone or core and markers."""
    markers = (nominal.shape[0] - s.CORE_NOMINAL) // s.MARKER_NOMINAL
    parts = [
        nominal[s.POSITION] + error[s.D_POSITION],
        nominal[s.VELOCITY] + error[s.D_VELOCITY],
        quaternion_product(nominal[s.QUATERNION], exponential(error[s.D_ATTITUDE])),
        nominal[s.FORCE] + error[s.D_FORCE],
        nominal[s.BIAS] + error[s.D_BIAS],
        nominal[s.VELOCITY_WANDER] + error[s.D_VELOCITY_WANDER],
        nominal[s.ATTITUDE_WANDER] + error[s.D_ATTITUDE_WANDER],
    ]
    parts += [retract_pose(nominal[s.marker_nominal(k)], error[s.marker_error(k)]) for k in range(markers)]
    return ca.vertcat(*parts)


def retract_pose(pose: ca.SX, error: ca.SX) -> ca.SX:
    """Pose (7,) with an error (6,) added along the manifold."""
    return ca.vertcat(pose[:3] + error[:3], quaternion_product(pose[3:], exponential(error[3:])))


def normalised(nominal: ca.SX) -> ca.SX:
    """Nominal state with its quaternions brought back to unit length."""
    result = ca.SX(nominal)
    starts = [s.QUATERNION.start]
    starts += range(s.CORE_NOMINAL + 3, nominal.shape[0], s.MARKER_NOMINAL)
    for start in starts:
        quaternion = nominal[start : start + 4]
        result[start : start + 4] = quaternion / ca.sqrt(ca.dot(quaternion, quaternion))
    return result


def _rate(nominal: ca.SX, inputs: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Model rates; on the ground, where it carries the weight, the acceleration is zero."""
    position_rate, acceleration, quaternion_rate = body_dynamics(
        nominal[s.VELOCITY],
        nominal[s.QUATERNION],
        inputs[s.IN_RATE],
        inputs[s.IN_THRUST],
        nominal[s.FORCE],
        inputs[s.IN_DRAG],
    )
    return position_rate, inputs[s.IN_AIRBORNE] * acceleration, quaternion_rate


def predict_nominal(core: ca.SX, inputs: ca.SX) -> ca.SX:
    """Core nominal state (22,) after IN_DT: attitude and wanders exact for constant rates, else Runge-Kutta 4."""
    dt = inputs[s.IN_DT]
    half_turn = exponential(0.5 * dt * inputs[s.IN_RATE])
    start = core[s.QUATERNION]
    middle = quaternion_product(start, half_turn)
    end = quaternion_product(middle, half_turn)

    def rates(position: ca.SX, velocity: ca.SX, quaternion: ca.SX) -> tuple[ca.SX, ca.SX]:
        return _rate(ca.vertcat(position, velocity, quaternion, core[s.FORCE]), inputs)[:2]

    position, velocity = core[s.POSITION], core[s.VELOCITY]
    p1, v1 = rates(position, velocity, start)
    p2, v2 = rates(position + 0.5 * dt * p1, velocity + 0.5 * dt * v1, middle)
    p3, v3 = rates(position + 0.5 * dt * p2, velocity + 0.5 * dt * v2, middle)
    p4, v4 = rates(position + dt * p3, velocity + dt * v3, end)
    return ca.vertcat(
        position + dt / 6.0 * (p1 + 2 * p2 + 2 * p3 + p4),
        velocity + dt / 6.0 * (v1 + 2 * v2 + 2 * v3 + v4),
        end,
        core[s.FORCE],
        core[s.BIAS],
        ca.exp(-dt * inputs[s.IN_WANDER_RATE]) * core[s.BIAS.stop :],
    )


def difference_between(nominal: ca.SX, other: ca.SX) -> ca.SX:
    """Core error (21,) that leads from `nominal` to `other`, to first order (its derivative at zero error is exact)."""
    turn = quaternion_product(conjugate(nominal[s.QUATERNION]), other[s.QUATERNION])
    return ca.vertcat(
        other[s.POSITION] - nominal[s.POSITION],
        other[s.VELOCITY] - nominal[s.VELOCITY],
        2.0 * turn[1:],
        other[s.FORCE] - nominal[s.FORCE],
        other[s.BIAS.start :] - nominal[s.BIAS.start :],
    )


def at_zero(expression: ca.SX, error: ca.SX) -> ca.SX:
    """Derivative of `expression` with respect to `error` where the error is zero."""
    return ca.simplify(ca.sparsify(ca.substitute(ca.jacobian(expression, error), error, ca.SX.zeros(error.shape[0]))))


def along_manifold(difference: Callable[[ca.SX, ca.SX], ca.SX], core: ca.SX) -> ca.SX:
    """Derivative (21, 21) at zero error of a core difference, given as a function of the core and the error.

    The attitude's rows are left-invariant, the same at every attitude: taken at the identity they come out short.
    """
    error = ca.SX.sym("error", s.CORE_ERROR)
    derivative = at_zero(difference(core, error), error)
    level = ca.vertcat(core[: s.QUATERNION.start], 1, 0, 0, 0, core[s.QUATERNION.stop :])
    derivative[s.D_ATTITUDE, :] = at_zero(difference(level, error)[s.D_ATTITUDE], error)
    return ca.sparsify(derivative)


def transition(core: ca.SX, inputs: ca.SX) -> ca.SX:
    """Transition matrix (21, 21) of the error over IN_DT: the derivative of `predict_nominal` along the manifold."""

    def difference(start: ca.SX, error: ca.SX) -> ca.SX:
        return difference_between(predict_nominal(start, inputs), predict_nominal(retract(start, error), inputs))

    return along_manifold(difference, core)


def error_dynamics(core: ca.SX, inputs: ca.SX) -> ca.SX:
    """Matrix A (21, 21) [1/s] of the error's linear dynamics error' = A error + noise (eq. 5)."""

    def rate_difference(start: ca.SX, error: ca.SX) -> ca.SX:
        moved = retract(start, error)
        position_rate, acceleration, quaternion_rate = _rate(start, inputs)
        moved_position_rate, moved_acceleration, moved_quaternion_rate = _rate(moved, inputs)
        turn_rate = quaternion_product(conjugate(quaternion_rate), moved[s.QUATERNION]) + quaternion_product(
            conjugate(start[s.QUATERNION]), moved_quaternion_rate
        )
        return ca.vertcat(
            moved_position_rate - position_rate,
            moved_acceleration - acceleration,
            2.0 * turn_rate[1:],
            ca.SX.zeros(6),
            -inputs[s.IN_WANDER_RATE] * error[s.D_BIAS.stop :],
        )

    return along_manifold(rate_difference, core)


def noise_covariance(core: ca.SX, inputs: ca.SX, order: int = 5) -> ca.SX:
    """Covariance (21, 21) that the continuous noise adds over IN_DT: Van Loan's integral as a series in dt.

    Q(dt) = sum M_k dt^k with M_1 the noise densities and M_{k+1} = (A M_k + M_k A') / (k + 1). A is nilpotent but for
    drag, turn rate and the wanders' slow decay, so that five terms leave a relative error of about (|omega| dt)^5.
    """
    densities = ca.vertcat(
        ca.SX(3, 1),
        inputs[s.IN_ACCELERATION_DENSITY],
        ca.repmat(inputs[s.IN_ATTITUDE_DENSITY], 3, 1),
        inputs[s.IN_FORCE_DENSITY],
        ca.repmat(inputs[s.IN_BIAS_DENSITY], 3, 1),
        ca.repmat(inputs[s.IN_VELOCITY_WANDER_DENSITY], 3, 1),
        ca.repmat(inputs[s.IN_ATTITUDE_WANDER_DENSITY], 3, 1),
    )
    dynamics = error_dynamics(core, inputs)
    dt = inputs[s.IN_DT]
    term = ca.sparsify(ca.diag(densities)) * dt
    total = term
    for k in range(2, order + 1):
        half = ca.mtimes(dynamics, term) * (dt / k)
        term = half + half.T
        total = total + term
    return total


def pose_difference(pose: ca.SX, other: ca.SX) -> ca.SX:
    """Error (6,) that leads from one pose (7,) to another, to first order."""
    turn = quaternion_product(conjugate(pose[3:]), other[3:])
    return ca.vertcat(other[:3] - pose[:3], 2.0 * turn[1:])


def reset_jacobian(rotation: ca.SX) -> ca.SX:
    """Derivative (3, 3) of the error after a correction `rotation` [rad] with respect to the error before it.

    The new error is log(exp(-rotation) exp(error)); at error = rotation its derivative is the right Jacobian of SO(3).
    """
    step = ca.SX.sym("step", 3)
    turn = quaternion_product(conjugate(exponential(rotation)), exponential(rotation + step))
    return at_zero(2.0 * turn[1:], step)
