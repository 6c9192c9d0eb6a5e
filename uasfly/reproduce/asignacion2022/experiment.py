"""The paper's experiment in simulation: a hover of 2.5 kg in wind of 8 m/s, observed at 50 Hz with sensor noise.

The force is that of a linear drag in the wind relative to the vehicle: with the damping that was identified for the
f550 (Kalaitzakis & Vitzilaios 2023), about 5 N. The wind is 8 m/s along x with Dryden gusts of that strength, 2 m above
the ground. Thrust and torque are known exactly; on the real vehicle their errors came on top.

The paper does not state its sensors' noise, but it follows from its figures: 1.03 N of DP2, the design that shows the
noise, tell how much white noise of the velocity there was. With that, 0.43 N of DP1 can be compared.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from uasfly.frames import quaternion_from_rotation_vector, quaternion_product
from uasfly.messages import Array
from uasfly.reproduce.asignacion2022.conditions import DC1
from uasfly.reproduce.asignacion2022.controller import Course
from uasfly.reproduce.asignacion2022.flight import DESIGNS, PERIOD_S, Estimates, Sample, flown
from uasfly.reproduce.asignacion2022.sensors import FLOWN_BODY, SAMPLE_S, SensorNoise
from uasfly.reproduce.asignacion2022.vehicle import Disturbance, SixFloats
from uasfly.sim.wind.dryden import DrydenGusts
from uasfly.wind.fuzzy_observer import FuzzyDisturbanceObserver
from uasfly.wind.six_axes import FORCES, TORQUES

WIND_M_S = 8.0
HEIGHT_M = 2.0
DRAG_1_S = 0.26057  # f550, mass-normalised
SETTLED_S = 5.0  # before that the observers find the mean wind
_STEPS = round(SAMPLE_S / PERIOD_S)


@dataclass(frozen=True, slots=True)
class Hover:
    """What was true and what was measured, sample by sample.

    Attributes:
        times_s: (n,).
        truth: (n, 6) force in the world [N], torque in the body [N m].
        states: (n, 6) as measured, but for the white noise of the velocity.
        white: (n, 3) that noise, with variance 1.
        inputs: (n, 6) virtual inputs as a computer with these samples knows them, mean since the last one.
    """

    times_s: Array
    truth: Array
    states: Array
    white: Array
    inputs: Array


def hover_in_wind(duration_s: float, rng: np.random.Generator, told: Callable[[float], None]) -> Hover:
    """Hover for so long after the observers have settled; `told` hears the time now and then."""
    whole_s = duration_s + SETTLED_S
    force = _wind_force(whole_s, rng)
    noise = SensorNoise(rng, round(whole_s / SAMPLE_S) + 1)
    times, truth, states, inputs = [], [], [], []
    attitude = np.array((1.0, 0.0, 0.0, 0.0))
    since: list[Sample] = []
    for number, sample in enumerate(flown(FLOWN_BODY, Course(), force, whole_s, DC1, rng)):
        since.append(sample)
        if number % _STEPS:
            continue
        k = number // _STEPS
        error = quaternion_from_rotation_vector(noise.rotation_rad[k])
        before, attitude = attitude, quaternion_product(sample.quaternion, error)
        times.append(sample.time_s)
        truth.append(sample.disturbance)
        states.append(sample.state + noise.state[k])
        inputs.append(_mean_inputs(since, before, attitude))
        since = []
        if k % 50 == 0:
            told(sample.time_s)
    return Hover(np.array(times), np.array(truth), np.array(states), noise.velocity, np.array(inputs))


def observed(hover: Hover, white_m_s: float) -> Estimates:
    """Both designs' estimates with this white noise of the velocity, from where they have settled."""
    states = hover.states.copy()
    states[:, FORCES] += white_m_s * hover.white
    settled = hover.times_s > SETTLED_S
    estimates = {}
    for name, design in DESIGNS.items():
        update = FuzzyDisturbanceObserver(FLOWN_BODY, design).update
        samples = zip(hover.times_s.tolist(), states, hover.inputs, strict=True)
        estimates[name] = np.array([update(*sample) for sample in samples])[settled]
    return Estimates(hover.times_s[settled], hover.truth[settled], hover.inputs[settled], estimates)


def noise_for(hover: Hover, design: str, rmse_n: float) -> float:
    """White noise of the velocity [m/s] with which a design's force RMSE is this; zero where it is larger without any.

    Force estimates are linear in the velocity, so the mean square is quadratic in the noise: two observations give it.
    """
    quiet, noisy = (observed(hover, white).estimates[design][:, FORCES] for white in (0.0, 1.0))
    error = quiet - hover.truth[hover.times_s > SETTLED_S, FORCES]
    a, b, c = (float(np.mean(value)) for value in ((noisy - quiet) ** 2, error * (noisy - quiet), error**2))
    return max(0.0, (math.sqrt(max(0.0, b * b - a * (c - rmse_n * rmse_n))) - b) / a)


def force_rmse(estimates: Estimates, name: str) -> float:
    """Root of the mean square of the force's error over time and the three axes [N]."""
    error = estimates.estimates[name][:, FORCES] - estimates.truth[:, FORCES]
    return float(np.sqrt(np.mean(error**2)))


def torque_rmse(estimates: Estimates, name: str) -> float:
    """The same of the torque [N m]; there is none in truth."""
    error = estimates.estimates[name][:, TORQUES] - estimates.truth[:, TORQUES]
    return float(np.sqrt(np.mean(error**2)))


def _wind_force(duration_s: float, rng: np.random.Generator) -> Disturbance:
    """Drag in 8 m/s with gusts; the gusts are drawn beforehand and linear in between."""
    gusts = DrydenGusts(WIND_M_S, rng, PERIOD_S)
    drawn = [gusts.step(HEIGHT_M, WIND_M_S) for _ in range(round(duration_s / PERIOD_S) + 2)]
    winds = [(WIND_M_S + u, v, w) for u, v, w in drawn]
    drag = DRAG_1_S * FLOWN_BODY.mass_kg

    def force(time_s: float, velocity: tuple[float, float, float]) -> SixFloats:
        part, number = math.modf(time_s / PERIOD_S + 1e-9)
        before, after = winds[int(number)], winds[int(number) + 1]
        x, y, z = (drag * (a + part * (b - a) - v) for a, b, v in zip(before, after, velocity, strict=True))
        return x, y, z, 0.0, 0.0, 0.0

    return force


def _mean_inputs(since: list[Sample], before: Array, attitude: Array) -> Array:
    """What was commanded in the mean, with the measured attitude at both ends."""
    thrust_n = float(np.mean([sample.thrust_n for sample in since]))
    torque_nm = np.mean([sample.torque_nm for sample in since], axis=0)
    both = [FLOWN_BODY.virtual_inputs(quaternion, thrust_n, torque_nm) for quaternion in (before, attitude)]
    mean: Array = 0.5 * (both[0] + both[1])
    return mean
