"""Fits first-order lag, gain and dead time of roll and pitch to PX4's log of an excitation flight.

The log holds the attitude setpoint at 20 Hz only, so a step is seen up to 60 ms late. The rate setpoint, at 50 Hz,
shows it sooner: divided by the attitude gain it is the difference between PX4's smoothed setpoint and the attitude. The
smoothing is a critically damped filter (MC_REF_W_N), whose response crosses one half 1.678 / w_n after the step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pyulog import ULog
from scipy.optimize import least_squares
from scipy.signal import lfilter

from uasfly.messages import Array

AXES = ("roll", "pitch")
BEGIN_S, END_S = 24.5, 100.5  # the doublets
STEP_S = 0.002
EVERY = 5  # residuals at 100 Hz
LATENESS_S = 0.02  # mean of the setpoint log
SMALLEST_STEP_RAD = math.radians(4.0)
HALF_WAY = 1.678347  # (1 + x) exp(-x) = 1/2


@dataclass(frozen=True)
class Fit:
    """Lag [s] and gain of roll and pitch, common dead time [s], RMS of what is left [rad]."""

    tau_s: tuple[float, float]
    gain: tuple[float, float]
    delay_s: float
    rms_rad: float


def fit_attitude_response(path: Path) -> Fit:
    """Simulation least squares over the whole flight, both axes at once."""
    topics = ["vehicle_attitude_setpoint", "vehicle_attitude_groundtruth", "vehicle_rates_setpoint"]
    log = ULog(str(path), topics)
    data = {topic.name: topic.data for topic in log.data_list}
    setpoint, truth, rates = (data[name] for name in topics)
    times = np.arange(BEGIN_S, END_S, STEP_S)
    commands, answers = [], []
    for axis, name in enumerate(AXES):
        attitude = _angles(truth, "q")[axis]
        gain = float(log.initial_parameters[f"MC_{name.upper()}_P"])
        seen = np.interp(_seconds(rates), _seconds(truth), attitude) + 2.0 * np.arcsin(rates[name] / (2.0 * gain))
        values = _angles(setpoint, "q_d")[axis]
        smoothing = float(log.initial_parameters["MC_REF_W_N"])
        commands.append((_arrivals(_seconds(setpoint), values, _seconds(rates), seen, smoothing), values))
        answers.append(np.interp(times, _seconds(truth), attitude))

    def residuals(parameters: Array) -> Array:
        *lags_and_gains, delay = parameters
        parts = []
        for axis in range(2):
            tau, gain = lags_and_gains[2 * axis : 2 * axis + 2]
            answer = answers[axis]
            parts.append((_respond(*commands[axis], times - delay, tau, gain, answer[0]) - answer)[::EVERY])
        return np.concatenate(parts)

    start = np.array((0.2, 1.0, 0.2, 1.0, 0.07))
    scale = np.array((0.1, 1.0, 0.1, 1.0, 0.05))
    for step in (1e-2, 3e-3):  # the dead time moves whole samples: differences need a step of some of them
        solution = least_squares(residuals, start, diff_step=step, x_scale=scale)
        start = solution.x
    tau_roll, gain_roll, tau_pitch, gain_pitch, delay = (float(value) for value in solution.x)
    rms = math.sqrt(float(np.mean(solution.fun**2)))
    return Fit((tau_roll, tau_pitch), (gain_roll, gain_pitch), delay, rms)


def _seconds(topic: dict[str, Array]) -> Array:
    return topic["timestamp"] * 1e-6


def _angles(topic: dict[str, Array], name: str) -> tuple[Array, Array]:
    w, x, y, z = (topic[f"{name}[{index}]"].astype(float) for index in range(4))
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    return roll, np.arcsin(np.clip(2.0 * (w * y - x * z), -1.0, 1.0))


def _arrivals(times: Array, values: Array, rate_times: Array, seen: Array, smoothing: float) -> Array:
    """When each logged setpoint took effect: steps from what the rate setpoint shows, the rest by the mean lateness."""
    arrivals = times - LATENESS_S
    for index in np.flatnonzero(np.abs(np.diff(values)) > SMALLEST_STEP_RAD):
        logged, half = times[index + 1], 0.5 * (values[index] + values[index + 1])
        above = (seen - half) * np.sign(values[index + 1] - values[index]) >= 0.0
        near = (rate_times[:-1] > logged - 0.09) & (rate_times[:-1] < logged + 0.08)
        crossings = np.flatnonzero(near & ~above[:-1] & above[1:])
        if len(crossings) == 1:
            k = int(crossings[0])
            share = (half - seen[k]) / (seen[k + 1] - seen[k])
            arrivals[index + 1] = rate_times[k] + share * (rate_times[k + 1] - rate_times[k]) - HALF_WAY / smoothing
    return np.maximum.accumulate(arrivals)


def _respond(times: Array, values: Array, at: Array, tau: float, gain: float, first: float) -> Array:
    """Response of the lag to a setpoint held between its changes."""
    held = values[np.maximum(np.searchsorted(times, at, "right") - 1, 0)]
    keep = math.exp(-STEP_S / tau)
    response, _ = lfilter([0.0, 1.0 - keep], [1.0, -keep], gain * held, zi=np.array([first]))
    return np.asarray(response)
