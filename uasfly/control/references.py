"""References that can be flown: tilt and thrust from motion and force (differential flatness of eq. 1).

With hover as the input reference, as in the paper, wind bends every optimum away from the path: the cost of the inputs
pulls against the cost of the position. Here inputs and tilt have as reference what flies the path in this very wind, so
on the path every term of the cost is zero.
"""

from __future__ import annotations

import casadi as ca

from uasfly.control.transcription import with_force
from uasfly.model import (
    INPUTS,
    PARAMETER_GAIN_PITCH,
    PARAMETER_GAIN_ROLL,
    PARAMETER_TAU_PITCH,
    PARAMETER_TAU_ROLL,
    PARAMETERS,
    trim_from_acceleration,
)


def trim_function() -> ca.Function:
    """Roll, pitch and thrust (3,) that fly a reference point.

    The function maps acceleration (3,), velocity (3,), yaw, force (3,), parameters (11,) and limits (3,) (see
    `uasfly.model.trim_from_acceleration`) to [roll, pitch, thrust].
    """
    acceleration, velocity, force = ca.SX.sym("a", 3), ca.SX.sym("v", 3), ca.SX.sym("force", 3)
    yaw, parameters, limits = ca.SX.sym("yaw"), ca.SX.sym("p", PARAMETERS), ca.SX.sym("limits", 3)
    trim = trim_from_acceleration(acceleration, velocity, with_force(parameters, force), yaw, limits)
    arguments = [acceleration, velocity, yaw, force, parameters, limits]
    return ca.Function("uasfly_trim", arguments, [trim], {"cse": True})


def input_reference_function() -> ca.Function:
    """Inputs (3,) that lead from one node's trim to the next.

    The mean of eq. 2 over the interval: gain * command = mean angle + tau * change of the angle / interval.
    The function maps two trims (3,), parameters (11,), interval, lower and upper bounds (3,) to inputs (3,).
    """
    start, end, parameters = ca.SX.sym("start", 3), ca.SX.sym("end", 3), ca.SX.sym("p", PARAMETERS)
    interval, lower, upper = ca.SX.sym("h"), ca.SX.sym("lower", INPUTS), ca.SX.sym("upper", INPUTS)
    mean, slope = 0.5 * (start + end), (end - start) / interval
    wanted = ca.vertcat(
        mean[2],
        (mean[0] + parameters[PARAMETER_TAU_ROLL] * slope[0]) / parameters[PARAMETER_GAIN_ROLL],
        (mean[1] + parameters[PARAMETER_TAU_PITCH] * slope[1]) / parameters[PARAMETER_GAIN_PITCH],
    )
    inputs = ca.fmin(ca.fmax(wanted, lower), upper)
    arguments = [start, end, parameters, interval, lower, upper]
    return ca.Function("uasfly_input_reference", arguments, [inputs], {"cse": True})


def reference_stage_function() -> ca.Function:
    """Both of them and the state reference for one interval: a third of the calls for who pays for each.

    The function maps the trim at the interval's end (3,), then acceleration, velocity and position (3,) and yaw at its
    start, force (3,), parameters (11,), limits (3,), interval, lower and upper bounds (3,) to trim (3,) and state
    reference (8,) at the start and the input reference (3,).
    """
    trim, input_reference = trim_function(), input_reference_function()
    end, position, interval = ca.SX.sym("end", 3), ca.SX.sym("position", 3), ca.SX.sym("h")
    acceleration, velocity, yaw, force, parameters, limits = trim.sx_in()
    lower, upper = ca.SX.sym("lower", INPUTS), ca.SX.sym("upper", INPUTS)
    start = trim(acceleration, velocity, yaw, force, parameters, limits)
    inputs = input_reference(start, end, parameters, interval, lower, upper)
    motion = [acceleration, velocity, position, yaw]
    arguments = [end, *motion, force, parameters, limits, interval, lower, upper]
    results = [start, ca.vertcat(position, velocity, start[:2]), inputs]
    return ca.Function("uasfly_reference_stage", arguments, results, {"cse": True})
