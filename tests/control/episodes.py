"""Stress episodes of the solver, as section 6 of the project's reference describes them."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from tests.control.vehicle import circle, f550
from uasfly.control.buffered import BufferedFunction, fill
from uasfly.control.iteration import RealTimeIteration
from uasfly.control.qp import SolveStatus
from uasfly.control.transcription import interval_function
from uasfly.messages import Array
from uasfly.model import controller_parameters

PERIOD_S = 0.02


def load(rti: RealTimeIteration, state: Array, yaw: float, yaw_rate: float, force: Array, start_s: float) -> None:
    """Fill a solver's data for a circle of 1.5 m from a time on."""
    work, times = rti.workspace, rti.problem.grid.time_s
    reference = circle(1.5, 12.0)(start_s + times)
    work.parameters[:] = controller_parameters(f550().model, force, 28.54209)
    work.force[:], work.initial[:], work.yaw[:] = force, state, yaw + yaw_rate * times
    work.position[:], work.velocity[:] = reference.position_in_world, reference.velocity_in_world
    work.acceleration[:] = reference.acceleration_in_world


def episodes(
    rti: RealTimeIteration,
    count: int,
    steps: int,
    rng: np.random.Generator,
    also: Callable[[], None] = lambda: None,
) -> Iterator[SolveStatus]:
    """Fly random starts (2.5-5 m off, 10-20 deg of tilt, up to 2 m/s, any yaw); yields the status of each step.

    `also` is called after each solve and before the vehicle moves on.
    """
    interval = BufferedFunction(interval_function())
    for _ in range(count):
        state = np.empty(8)
        direction = rng.normal(size=3)
        state[:3] = direction / np.linalg.norm(direction) * rng.uniform(2.5, 5.0)
        state[3:6] = rng.uniform(-2.0, 2.0, 3)
        state[6:] = np.radians(rng.uniform(10.0, 20.0, 2)) * rng.choice((-1.0, 1.0), 2)
        yaw, yaw_rate, force = rng.uniform(-np.pi, np.pi), rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5, 3)
        rti.drop_plan()
        for step in range(steps):
            load(rti, state, yaw, yaw_rate, force, step * PERIOD_S)
            status = rti.solve(step * PERIOD_S)
            also()
            yield status
            inputs = rti.workspace.inputs[0]
            fill(interval.arguments, (state, inputs, rti.workspace.parameters, np.array(yaw), np.array(yaw_rate)))
            interval.arguments[5][0] = PERIOD_S
            interval.call()
            noise = rng.normal(size=8) * np.array((5e-3,) * 3 + (2e-2,) * 3 + (5e-3,) * 2)
            state = interval.results[0] + noise
            yaw += yaw_rate * PERIOD_S
