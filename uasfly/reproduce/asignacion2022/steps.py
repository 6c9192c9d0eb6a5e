"""A step of the force, and nothing but sensor noise, shown to the paper's observer and to the two it is compared with.

The gains that the paper gave the other two are not known here. The extended state observer has epsilon = 0.02 s, both
poles in -50 rad/s: eight times DP1's cut-off, a high gain as its name says. The acceleration-based estimator has
K_I = pi rad/s, half of DP1's cut-off. Which one is faster follows from that; what the noise is does not, and the last
estimator, with K_I as fast as DP1, shows what the accelerometers cost or save at the same speed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from uasfly.messages import Array
from uasfly.reproduce.asignacion2022.sensors import FLOWN_BODY, SAMPLE_S, USUAL_VELOCITY_M_S, SensorNoise
from uasfly.wind.acceleration_estimator import AccelerationEstimator
from uasfly.wind.extended_state_observer import ExtendedStateObserver
from uasfly.wind.fuzzy_observer import FuzzyDisturbanceObserver
from uasfly.wind.pole_circle import DP1, DP2
from uasfly.wind.six_axes import FORCES

EPSILON_S = 0.02
GAIN_1_S = math.pi
STEP_N = 2.0  # the gust's height on x
STEP_AT_S = 1.0
STEP_SHOWN_S = 5.0
_SETTLED_S = 5.0

EXTENDED = "extended state"
ACCELERATION = "acceleration"
ACCELERATION_FAST = "acceleration, K_I = 2 pi"

Watch = Callable[[float, Array, Array], Array]
"""Time [s], state (6,), acceleration (3,) [m/s^2] of a vehicle without inputs -> force in the world (3,) [N]."""


@dataclass(frozen=True, slots=True)
class Steps:
    """What the observers made of the step.

    Attributes:
        times_s: (n,), the step comes at `STEP_AT_S`.
        forces: observer's name -> (n,) force on x [N] without sensor noise.
        noisy: the same with it.
        rise_s: from a tenth to nine tenths of the step.
        noise_n: RMS over the three forces where there is none, with sensor noise.
    """

    times_s: Array
    forces: Mapping[str, Array]
    noisy: Mapping[str, Array]
    rise_s: Mapping[str, float]
    noise_n: Mapping[str, float]


def compare_steps(noise_s: float, rng: np.random.Generator) -> Steps:
    """Show all observers the same step, and so many seconds of noise after they have settled."""
    times = np.arange(0.0, STEP_AT_S + STEP_SHOWN_S, SAMPLE_S)
    still = np.arange(0.0, noise_s + _SETTLED_S, SAMPLE_S)
    noise = SensorNoise(rng, len(times)), SensorNoise(rng, len(still))
    forces, noisy, rises, noises = {}, {}, {}, {}
    for name, watch in _observers().items():
        forces[name] = _shown(watch(), times, STEP_N, None)[:, 0]
        noisy[name] = _shown(watch(), times, STEP_N, noise[0])[:, 0]
        rises[name] = rise_s(times, forces[name])
        settled = _shown(watch(), still, 0.0, noise[1])[still > _SETTLED_S]
        noises[name] = float(np.sqrt(np.mean(settled**2)))
    return Steps(times, forces, noisy, rises, noises)


def rise_s(times_s: Array, values: Array) -> float:
    """Time from a tenth to nine tenths of the last value [s], between samples by a line."""
    marks = []
    for share in (0.1, 0.9):
        level = share * values[-1]
        above = int(np.argmax(values >= level))
        low, high = values[above - 1], values[above]
        marks.append(times_s[above - 1] + (times_s[above] - times_s[above - 1]) * (level - low) / (high - low))
    return float(marks[1] - marks[0])


def _observers() -> dict[str, Callable[[], Watch]]:
    inputs = np.zeros(6)

    def fuzzy(design: str) -> Watch:
        observer = FuzzyDisturbanceObserver(FLOWN_BODY, {"DP1": DP1, "DP2": DP2}[design])
        return lambda time_s, state, _: observer.update(time_s, state, inputs)[FORCES]

    def extended() -> Watch:
        observer = ExtendedStateObserver(FLOWN_BODY, EPSILON_S)
        return lambda time_s, state, _: observer.update(time_s, state, inputs)[FORCES]

    def acceleration(gain_1_s: float) -> Watch:
        observer = AccelerationEstimator(FLOWN_BODY, gain_1_s)
        return lambda time_s, state, measured: observer.update(time_s, state, inputs, measured)[FORCES]

    return {
        "DP1": lambda: fuzzy("DP1"),
        "DP2": lambda: fuzzy("DP2"),
        EXTENDED: extended,
        ACCELERATION: lambda: acceleration(GAIN_1_S),
        ACCELERATION_FAST: lambda: acceleration(DP1.cutoff_rad_s),
    }


def _shown(watch: Watch, times: Array, step_n: float, noise: SensorNoise | None) -> Array:
    """Forces (n, 3) that an observer finds on a body that nothing but the step pushes, along x."""
    pushed_s = np.maximum(0.0, times - STEP_AT_S)
    states = np.zeros((len(times), 6))
    states[:, 0] = step_n / FLOWN_BODY.mass_kg * pushed_s
    accelerations = np.zeros((len(times), 3))
    accelerations[1:, 0] = np.diff(states[:, 0]) / SAMPLE_S
    if noise is not None:
        states += noise.state
        states[:, FORCES] += USUAL_VELOCITY_M_S * noise.velocity
        accelerations += noise.acceleration_m_s2
    samples = zip(times.tolist(), states, accelerations, strict=True)
    return np.array([watch(*sample) for sample in samples])
