"""Finite differences along the manifold, independent of the symbolic calculus."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import casadi as ca
import numpy as np

from tests.observer.truth import turn_between
from uasfly.frames import quaternion_from_rotation_vector, quaternion_product
from uasfly.messages import Array
from uasfly.observer import states as s


def plus_core(core: Array, error: Array) -> Array:
    """Core state (22,) with an error (21,) added."""
    turned = quaternion_product(core[s.QUATERNION], quaternion_from_rotation_vector(error[s.D_ATTITUDE]))
    return np.concatenate((core[:6] + error[:6], turned, core[10:22] + error[9:21]))


def minus_core(core: Array, other: Array) -> Array:
    """Error (21,) with plus_core(core, error) == other."""
    turn = turn_between(core[s.QUATERNION], other[s.QUATERNION])
    return np.concatenate((other[:6] - core[:6], turn, other[10:22] - core[10:22]))


def plus_pose(pose: Array, error: Array) -> Array:
    """Pose (7,) with an error (6,) added."""
    return np.concatenate(
        (pose[:3] + error[:3], quaternion_product(pose[3:], quaternion_from_rotation_vector(error[3:])))
    )


def minus_pose(pose: Array, other: Array) -> Array:
    """Error (6,) with plus_pose(pose, error) == other."""
    return np.concatenate((other[:3] - pose[:3], turn_between(pose[3:], other[3:])))


def difference_quotient(function: Callable[[Array], Array], size: int, step: float = 1e-5) -> Array:
    """Derivative (m, size) at zero of `function` of an error, by central differences."""
    columns = []
    for k in range(size):
        error = np.zeros(size)
        error[k] = step
        columns.append((function(error) - function(-error)) / (2.0 * step))
    return np.stack(columns, axis=1)


@lru_cache
def _compiled(build: Callable[..., ca.SX | tuple[ca.SX, ...]], sizes: tuple[int, ...]) -> ca.Function:
    symbols = [ca.SX.sym(f"a{k}", size) for k, size in enumerate(sizes)]
    result = build(*symbols)
    return ca.Function("f", symbols, list(result) if isinstance(result, tuple) else [result])


def evaluated(build: Callable[..., ca.SX | tuple[ca.SX, ...]], *arguments: Array) -> list[Array]:
    """Numbers from a function that builds symbolic expressions of column vectors."""
    function = _compiled(build, tuple(len(argument) for argument in arguments))
    values = function.call([ca.DM(argument) for argument in arguments])
    arrays = [np.array(value.full()) for value in values]
    return [array[:, 0] if array.shape[1] == 1 else array for array in arrays]


def random_core(rng: np.random.Generator) -> Array:
    """Core state (22,) of a vehicle somewhere in the world, tilted and moving."""
    core = rng.standard_normal(s.CORE_NOMINAL)
    core[s.POSITION] *= 10.0
    core[s.VELOCITY] *= 3.0
    core[s.QUATERNION] /= np.linalg.norm(core[s.QUATERNION])
    core[s.ATTITUDE_WANDER] *= 0.1
    return core


def random_pose(rng: np.random.Generator) -> Array:
    """Pose (7,) within some metres."""
    pose = rng.standard_normal(7)
    pose[3:] /= np.linalg.norm(pose[3:])
    return pose


def flying_inputs(rng: np.random.Generator, dt_s: float) -> Array:
    """Inputs (PREDICTION_INPUTS,) of a prediction in flight with a brisk turn."""
    inputs = np.zeros(s.PREDICTION_INPUTS)
    inputs[s.IN_DT] = dt_s
    inputs[s.IN_THRUST] = 9.0 + rng.standard_normal()
    inputs[s.IN_RATE] = 2.0 * rng.standard_normal(3)
    inputs[s.IN_AIRBORNE] = 1.0
    inputs[s.IN_BIAS_DENSITY] = 0.3**2
    inputs[s.IN_FORCE_DENSITY] = (0.5**2, 0.3**2, 1.2**2)
    inputs[s.IN_ACCELERATION_DENSITY] = (0.1**2, 0.05**2, 0.3**2)
    inputs[s.IN_ATTITUDE_DENSITY] = 0.02**2
    inputs[s.IN_DRAG] = (0.26, 0.2, 0.1)
    inputs[s.IN_WANDER_RATE] = 0.5
    inputs[s.IN_VELOCITY_WANDER_DENSITY] = 0.02**2
    inputs[s.IN_ATTITUDE_WANDER_DENSITY] = 0.002**2
    return inputs
