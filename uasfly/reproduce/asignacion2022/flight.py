"""A flight of the simulated quadrotor, sample by sample, and what observers make of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from uasfly.messages import Array
from uasfly.reproduce.asignacion2022.conditions import Condition
from uasfly.reproduce.asignacion2022.controller import Course, control
from uasfly.reproduce.asignacion2022.vehicle import Disturbance, Vehicle
from uasfly.wind.fuzzy_observer import FuzzyDisturbanceObserver
from uasfly.wind.pole_circle import DP1, DP2
from uasfly.wind.six_axes import SixAxisBody

PERIOD_S = 0.004  # of plant, controller and, in the simulation, observers
DESIGNS = {"DP1": DP1, "DP2": DP2}


@dataclass(frozen=True, slots=True)
class Sample:
    """What is true at the end of a step, and the inputs that were held during it.

    Attributes:
        time_s: now.
        state: (6,) velocity in the world [m/s], body rates [rad/s].
        quaternion: (4,) body to world.
        disturbance: (6,) force in the world [N], torque in the body [N m].
        thrust_n, torque_nm: in the step that ends now; (3,) in the body.
        mean_inputs: (6,) virtual inputs, mean over that step.
    """

    time_s: float
    state: Array
    quaternion: Array
    disturbance: Array
    thrust_n: float
    torque_nm: Array
    mean_inputs: Array


def flown(
    body: SixAxisBody,
    course: Course,
    disturbance: Disturbance,
    duration_s: float,
    condition: Condition,
    rng: np.random.Generator,
) -> Iterator[Sample]:
    """Fly the course; the first sample is the beginning, then comes one every `PERIOD_S`."""
    steps = round(duration_s / PERIOD_S)
    position, velocity, _ = course.at(0.0)
    vehicle = Vehicle(body, position, velocity, disturbance)
    inputs = body.virtual_inputs(vehicle.quaternion, 0.0, np.zeros(3))
    yield Sample(0.0, vehicle.state, vehicle.quaternion, vehicle.disturbance, 0.0, np.zeros(3), inputs)
    times_s: Array = PERIOD_S * np.arange(steps, dtype=float)
    for factors in condition.factors(rng, times_s):
        thrust_n, torque_nm = control(body, vehicle, course)
        before = body.virtual_inputs(vehicle.quaternion, thrust_n, torque_nm)
        vehicle.step(PERIOD_S, thrust_n, torque_nm, factors)
        mean = 0.5 * (before + body.virtual_inputs(vehicle.quaternion, thrust_n, torque_nm))
        yield Sample(vehicle.time_s, vehicle.state, vehicle.quaternion, vehicle.disturbance, thrust_n, torque_nm, mean)


@dataclass(frozen=True, slots=True)
class Estimates:
    """Disturbance and what the observers say it is.

    Attributes:
        times_s: (n,).
        truth: (n, 6) force in the world [N], torque in the body [N m].
        inputs: (n, 6) virtual inputs, in the same units; as the observers know them.
        estimates: observer's name -> (n, 6).
    """

    times_s: Array
    truth: Array
    inputs: Array
    estimates: Mapping[str, Array]

    def rmse(self, name: str) -> Array:
        """(6,) root of the mean square of estimate minus truth on each axis."""
        error: Array = np.sqrt(np.mean((self.estimates[name] - self.truth) ** 2, axis=0))
        return error

    def input_rms(self) -> Array:
        """(6,) root of the mean square of the virtual inputs."""
        size: Array = np.sqrt(np.mean(self.inputs**2, axis=0))
        return size


def watched(samples: Iterator[Sample], body: SixAxisBody, told: Callable[[float], None]) -> Estimates:
    """Let both of the paper's designs watch a flight, without sensor noise; `told` hears the time now and then."""
    observers = {name: FuzzyDisturbanceObserver(body, design) for name, design in DESIGNS.items()}
    times: list[float] = []
    truth: list[Array] = []
    inputs: list[Array] = []
    estimates: dict[str, list[Array]] = {name: [] for name in observers}
    for number, sample in enumerate(samples):
        times.append(sample.time_s)
        truth.append(sample.disturbance)
        inputs.append(sample.mean_inputs)
        for name, observer in observers.items():
            estimates[name].append(observer.update(sample.time_s, sample.state, sample.mean_inputs))
        if number % 250 == 0:
            told(sample.time_s)
    found = {name: np.array(rows) for name, rows in estimates.items()}
    return Estimates(np.array(times), np.array(truth), np.array(inputs), found)
