"""Sequences of control problems: a disturbed vehicle, flown once, so that every solver gets the same problems."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uasfly.airframe import Airframe
from uasfly.bench.cases import Case
from uasfly.control.buffered import BufferedFunction, fill
from uasfly.control.iteration import RealTimeIteration
from uasfly.control.problem import Problem
from uasfly.control.transcription import interval_function
from uasfly.control.workspace import Workspace
from uasfly.messages import Array
from uasfly.model import STATES, controller_parameters

PERIOD_S = 0.02
EPISODE_STEPS = 50
NOISE = np.array((5e-3,) * 3 + (2e-2,) * 3 + (5e-3,) * 2)  # each step, on position, velocity, roll and pitch
RADIUS_M, TURN_S = 1.5, 12.0


@dataclass(frozen=True, slots=True)
class Sequence:
    """Everything that n solves one after the other are given; the first axis of each array is the step.

    Attributes:
        start_s: (n,) time of the plan's first node. fresh: (n,) an episode begins, there is no plan yet.
        initial: (n, 8). yaw: (n, N + 1). force: (n, 3). parameters: (n, 11). before: (n, 3) last command.
        position, velocity, acceleration: (n, N + 1, 3) reference motion.
        state_reference: (n, N + 1, 8), input_reference: (n, N, 3): what uasfly makes of the reference motion.
        saturated: (n,) share of the plan's inputs that lie at a bound.
    """

    start_s: Array
    fresh: NDArray[np.bool_]
    initial: Array
    yaw: Array
    force: Array
    parameters: Array
    before: Array
    position: Array
    velocity: Array
    acceleration: Array
    state_reference: Array
    input_reference: Array
    saturated: Array

    def __len__(self) -> int:
        return int(self.start_s.size)

    @property
    def saturated_share(self) -> float:
        """Share of all inputs of all plans that lie at a bound; first steps of episodes are left out."""
        return float(self.saturated[~self.fresh].mean())

    def load(self, work: Workspace, step: int) -> None:
        """Fill a solver's data with a step's, as the controller does before each solve."""
        work.parameters[:], work.force[:], work.yaw[:] = self.parameters[step], self.force[step], self.yaw[step]
        work.initial[:] = self.initial[step]
        work.position[:], work.velocity[:] = self.position[step], self.velocity[step]
        work.acceleration[:] = self.acceleration[step]


def fly_sequence(airframe: Airframe, problem: Problem, case: Case, steps: int, seed: int) -> Sequence:
    """Fly episodes of 50 steps in closed loop and keep what the solver was given; deterministic by its seed.

    The vehicle is the controller's own model with noise on every state each step, and a wind force that wanders; an
    episode starts off the reference by `case.start` (position, velocity, tilt) in random directions.
    """
    rng = np.random.default_rng(seed)
    rti = RealTimeIteration(problem)
    plant, work, nodes = BufferedFunction(interval_function()), rti.workspace, problem.grid.nodes
    record = _empty(steps, nodes)
    state, yaw, yaw_rate, force, clock = np.zeros(STATES), 0.0, 0.0, np.zeros(3), 0.0
    before = np.array((airframe.model.hover_thrust, 0.0, 0.0))
    for step in range(steps):
        if step % EPISODE_STEPS == 0:
            rti.drop_plan()
            clock = rng.uniform(0.0, TURN_S)
            yaw, yaw_rate, force = rng.uniform(-math.pi, math.pi), rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5, 3)
            state = _start(case, clock, rng)
            before = np.array((airframe.model.hover_thrust, 0.0, 0.0))
        record.fresh[step] = step % EPISODE_STEPS == 0
        record.start_s[step], record.initial[step], record.force[step] = clock, state, force
        record.yaw[step], record.before[step] = yaw + yaw_rate * problem.grid.time_s, before
        record.parameters[step] = controller_parameters(airframe.model, force, airframe.model.k_thrust_m_s2)
        for array, reference in zip(
            (record.position, record.velocity, record.acceleration), _circle(clock + problem.grid.time_s), strict=True
        ):
            array[step] = reference
        record.load(work, step)
        rti.solve(clock, before=before)
        record.state_reference[step], record.input_reference[step] = work.state_reference, work.input_reference
        record.saturated[step] = _at_bounds(problem, work.inputs).mean()
        before = work.inputs[0].copy()
        fill(plant.arguments, (state, before, work.parameters, np.array(yaw), np.array(yaw_rate)))
        plant.arguments[5][0] = PERIOD_S
        plant.call()
        state = plant.results[0] + rng.normal(size=STATES) * NOISE
        force = force + 0.5 * math.sqrt(PERIOD_S) * rng.normal(size=3)
        force = np.clip(force, -0.5, 0.5)
        yaw, clock = yaw + yaw_rate * PERIOD_S, clock + PERIOD_S
    return record


def _at_bounds(problem: Problem, inputs: Array) -> NDArray[np.bool_]:
    near = 1e-6 * (problem.input_upper - problem.input_lower)
    return np.asarray((inputs <= problem.input_lower + near) | (inputs >= problem.input_upper - near))


def _start(case: Case, time_s: float, rng: np.random.Generator) -> Array:
    position, velocity, _ = _circle(np.array((time_s,)))
    state = np.zeros(STATES)
    direction = rng.normal(size=3)
    state[:3] = position[0] + case.start_m * rng.uniform(0.5, 1.0) * direction / np.linalg.norm(direction)
    state[3:6] = velocity[0] + rng.uniform(-case.start_m_s, case.start_m_s, 3)
    state[6:] = rng.uniform(-case.start_rad, case.start_rad, 2)
    return state


def _circle(time_s: Array) -> tuple[Array, Array, Array]:
    """Position, velocity and acceleration (n, 3) on a circle of 1.5 m in 12 s, one metre above ground."""
    omega = 2.0 * math.pi / TURN_S
    cos, sin, zero = np.cos(omega * time_s), np.sin(omega * time_s), np.zeros_like(time_s)
    position = np.stack((RADIUS_M * cos, RADIUS_M * sin, zero + 1.0), axis=1)
    velocity = RADIUS_M * omega * np.stack((-sin, cos, zero), axis=1)
    return position, velocity, -(omega**2) * np.stack((RADIUS_M * cos, RADIUS_M * sin, zero), axis=1)


def _empty(steps: int, nodes: int) -> Sequence:
    def zeros(*shape: int) -> Array:
        return np.zeros((steps, *shape))

    return Sequence(
        start_s=zeros(),
        fresh=np.zeros(steps, np.bool_),
        initial=zeros(STATES),
        yaw=zeros(nodes + 1),
        force=zeros(3),
        parameters=zeros(11),
        before=zeros(3),
        position=zeros(nodes + 1, 3),
        velocity=zeros(nodes + 1, 3),
        acceleration=zeros(nodes + 1, 3),
        state_reference=zeros(nodes + 1, STATES),
        input_reference=zeros(nodes, 3),
        saturated=zeros(),
    )
