"""How late and how small an observer shows a sine: measured on what it gives, by least squares."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from uasfly.messages import Array
from uasfly.wind.fuzzy_observer import FuzzyDisturbanceObserver
from uasfly.wind.pole_circle import PoleCircle
from uasfly.wind.six_axes import SixAxisBody

_SAMPLES_A_PERIOD = 50
_LONGEST_STEP_S = 0.004  # as in the simulation: a force shows half a step late
_SETTLING = 8.0  # time constants of the observer
_PERIODS = 1


@dataclass(frozen=True, slots=True)
class Response:
    """A sine against the one it answers to.

    Attributes:
        gain: ratio of the amplitudes. lag_deg: how far behind it is.
    """

    gain: float
    lag_deg: float


def response(times_s: Array, truth: Array, estimate: Array, frequency_hz: float) -> Response:
    """Fit a sine, a cosine and a constant to both signals (each (n,)) and compare the fits."""
    phase = 2.0 * math.pi * frequency_hz * times_s
    basis = np.column_stack((np.sin(phase), np.cos(phase), np.ones_like(phase)))
    (sine, cosine), (late_sine, late_cosine) = (
        np.linalg.lstsq(basis, signal, rcond=None)[0][:2] for signal in (truth, estimate)
    )
    ratio = complex(late_sine, late_cosine) / complex(sine, cosine)
    return Response(abs(ratio), -math.degrees(math.atan2(ratio.imag, ratio.real)))


def swept(design: PoleCircle, frequencies_hz: Array) -> list[Response]:
    """The observer's response to a sinusoidal force of each frequency on a body that is pushed by nothing else."""
    body = SixAxisBody(1.0, (1.0, 1.0, 1.0))
    responses = []
    for frequency in frequencies_hz.tolist():
        turn = 2.0 * math.pi * frequency
        settled_s = _SETTLING / design.cutoff_rad_s
        step_s = min(_LONGEST_STEP_S, 1.0 / (_SAMPLES_A_PERIOD * frequency))
        times = np.arange(0.0, settled_s + _PERIODS / frequency, step_s)
        states = np.zeros((len(times), 6))
        states[:, 0] = (1.0 - np.cos(turn * times)) / turn  # of 1 kg under sin(turn t) N
        observer = FuzzyDisturbanceObserver(body, design)
        inputs = np.zeros(6)
        forces = [observer.update(t, state, inputs)[0] for t, state in zip(times.tolist(), states, strict=True)]
        late = times > settled_s
        responses.append(response(times[late], np.sin(turn * times[late]), np.array(forces)[late], frequency))
    return responses
