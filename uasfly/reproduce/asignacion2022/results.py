"""Flies everything, and puts the figures beside the paper's."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from uasfly.messages import Array
from uasfly.reproduce.asignacion2022 import pictures
from uasfly.reproduce.asignacion2022.conditions import BODY, DC1, DC2, DC3, GUST_HZ, SPIRAL, gust, sine
from uasfly.reproduce.asignacion2022.experiment import (
    SETTLED_S,
    Hover,
    force_rmse,
    hover_in_wind,
    noise_for,
    observed,
    torque_rmse,
)
from uasfly.reproduce.asignacion2022.flight import DESIGNS, Estimates, flown, watched
from uasfly.reproduce.asignacion2022.sensors import USUAL_VELOCITY_M_S
from uasfly.reproduce.asignacion2022.sines import Response, response
from uasfly.reproduce.asignacion2022.steps import ACCELERATION, ACCELERATION_FAST, EXTENDED, Steps, compare_steps
from uasfly.reproduce.asignacion2022.uncertainty import least_input
from uasfly.reproduce.rows import SEEDS, Progress, Reproduction, Row, holds_in, mean_row
from uasfly.wind.six_axes import AXES

CONDITIONS = (DC1, DC2, DC3)
SPIRAL_S = 60.0
SINE_S = 30.0
NOISE_S = 60.0
EXPERIMENT_S = 120.0
_FIRST_PERIOD_S = 1.0 / GUST_HZ

_LAG = {"DP1": 5.7, "DP2": None}  # [deg], the paper's
_FORCE_RMSE = {"DP1": 0.43, "DP2": 1.03}  # [N], the paper's
_LOWER = {"DC1": "DP2", "DC2": "DP1", "DC3": "DP1"}  # whose RMSE is the lower one in the paper


@dataclass(frozen=True, slots=True)
class Durations:
    """How long each experiment goes on [s]."""

    spiral_s: float = SPIRAL_S
    sine_s: float = SINE_S
    noise_s: float = NOISE_S
    experiment_s: float = EXPERIMENT_S


def reproduce(seed: int, progress: Progress, durations: Durations | None = None) -> Reproduction:
    """Fly all experiments of the paper.

    Args:
        seed: of gusts and sensor noise, and the first of five of the uncertainty.
        progress: told what is being flown.
        durations: the usual ones when not given.
    """
    durations = durations or Durations()
    flights = [
        (number, condition, its_seed)
        for number, condition in enumerate(CONDITIONS)
        for its_seed in range(seed, seed + (SEEDS if condition.axes else 1))
    ]
    whole_s = len(flights) * durations.spiral_s + durations.sine_s + durations.experiment_s + SETTLED_S
    done_s = 0.0

    def telling(text: str) -> Callable[[float], None]:
        before_s = done_s
        return lambda time_s: progress(text, (before_s + time_s) / whole_s)

    spirals: dict[str, list[Estimates]] = {}
    for number, condition, its_seed in flights:
        samples = flown(BODY, SPIRAL, gust, durations.spiral_s, condition, np.random.default_rng((its_seed, number)))
        text = f"spiral, {condition.name}, seed {its_seed}"
        spirals.setdefault(condition.name, []).append(watched(samples, BODY, telling(text)))
        done_s += durations.spiral_s
    samples = flown(BODY, SPIRAL, sine, durations.sine_s, DC1, np.random.default_rng((seed, 3)))
    waves = watched(samples, BODY, telling("spiral, sine"))
    done_s += durations.sine_s
    steps = compare_steps(durations.noise_s, np.random.default_rng((seed, 4)))
    hover = hover_in_wind(durations.experiment_s, np.random.default_rng((seed, 5)), telling("hover in wind"))
    white_m_s = noise_for(hover, "DP2", _FORCE_RMSE["DP2"])
    inferred = observed(hover, white_m_s)
    progress("done", 1.0)

    rows = (
        *_spiral_rows(spirals),
        *_phase_rows(waves),
        *_step_rows(steps),
        *_experiment_rows(hover, white_m_s, inferred),
    )
    drawn = {name.lower(): pictures.estimates(name, found[0]) for name, found in spirals.items()}
    drawn |= {
        "bode": pictures.bode(_lags(waves)),
        "step": pictures.steps(steps),
        "experiment": pictures.experiment(inferred),
    }
    return Reproduction("asignacion2022", rows, drawn)


def _spiral_rows(spirals: Mapping[str, Sequence[Estimates]]) -> Iterator[Row]:
    for name, flights in spirals.items():
        errors = {design: np.array([found.rmse(design) for found in flights]) for design in DESIGNS}
        for design, values in errors.items():
            for number, axis in enumerate(AXES):
                yield mean_row(name, f"RMSE {axis}, {design}", _unit(number), None, values[:, number], "")
        for number, axis in enumerate(AXES):
            ratios = errors["DP2"][:, number] / errors["DP1"][:, number]
            yield mean_row(name, f"RMSE {axis}, DP2 / DP1", "", None, ratios, _ordering(name, number, ratios))
    yield from _uncertain_rows(spirals[DC1.name][0], spirals[DC2.name])


def _unit(axis: int) -> str:
    return "N" if axis < 3 else "N m"


def _ordering(condition: str, axis: int, ratios: Array) -> str:
    if condition == DC2.name and axis not in DC2.axes:
        return "this axis has no uncertainty"
    below = _LOWER[condition] == "DP2"

    def holds(ratio: float) -> bool:
        return (ratio < 1.0) == below

    so = "so here" if holds(float(ratios.mean())) else "NOT so here"
    if len(ratios) > 1:
        so += f" in the mean, {holds_in(ratios, holds)}"
    return f"paper: {_LOWER[condition]} is the lower, {'below' if below else 'above'} 1; {so}"


def _uncertain_rows(certain: Estimates, flights: Sequence[Estimates]) -> Iterator[Row]:
    """Why the ordering of DC2 comes out on one axis and not on another."""
    low, high = certain.rmse("DP1"), certain.rmse("DP2")
    for axis in DC2.axes:
        least = least_input(
            DC2,
            (DESIGNS["DP1"].cutoff_rad_s, float(low[axis])),
            (DESIGNS["DP2"].cutoff_rad_s, float(high[axis])),
        )
        gust_rms = float(np.sqrt(np.mean(certain.truth[:, axis] ** 2)))
        title, unit = f"RMS of what is uncertain, {AXES[axis]}", _unit(axis)
        note = (
            f"DP1 is the lower from {least:.3g} {unit} on, by theory; balancing the gust takes {gust_rms:.3g}, "
            "the rest is the spiral, whose size the paper does not state"
        )
        flown_rms = [found.input_rms()[axis] for found in flights]
        yield mean_row(DC2.name, title, unit, None, flown_rms, note)


def _lags(waves: Estimates) -> dict[str, Response]:
    """Mean gain and phase lag of the six axes, from the second period on."""
    late = waves.times_s > _FIRST_PERIOD_S
    means = {}
    for design, estimate in waves.estimates.items():
        axes = [
            response(waves.times_s[late], waves.truth[late, axis], estimate[late, axis], GUST_HZ)
            for axis in range(len(AXES))
        ]
        gain, lag = float(np.mean([one.gain for one in axes])), float(np.mean([one.lag_deg for one in axes]))
        means[design] = Response(gain, lag)
    return means


def _phase_rows(waves: Estimates) -> Iterator[Row]:
    for design, found in _lags(waves).items():
        paper = _LAG[design]
        better = None if paper is None else round(found.lag_deg, 1) <= paper
        cutoff = f"f_c = {DESIGNS[design].cutoff_hz:g} Hz"
        note = "" if paper is None else "compared in the one decimal that the paper gives"
        yield Row("phase", f"lag at {GUST_HZ:g} Hz, {cutoff}", "deg", paper, found.lag_deg, better, note)


def _step_rows(steps: Steps) -> Iterator[Row]:
    own = "gains of the two others are uasfly's choice; see uasfly/reproduce/asignacion2022/steps.py"
    for name, value in steps.rise_s.items():
        yield Row("step", f"rise time 10-90 %, {name}", "s", None, value, None)
    for name, value in steps.noise_n.items():
        yield Row("step", f"noise RMS, {name}", "N", None, value, None)
    orderings = (
        ("rise time", EXTENDED, steps.rise_s, "below"),
        ("noise RMS", EXTENDED, steps.noise_n, "above"),
        ("rise time", ACCELERATION, steps.rise_s, "above"),
    )
    for quantity, name, values, side in orderings:
        ratio = values[name] / values["DP1"]
        found = "so here" if (ratio < 1.0) == (side == "below") else "NOT so here"
        yield Row("step", f"{quantity}, {name} / DP1", "", None, ratio, None, f"paper: {side} 1; {found}; {own}")
    ratio = steps.noise_n[ACCELERATION_FAST] / steps.noise_n["DP1"]
    note = "not in the paper; both equally fast; accelerometer noise is assumed"
    yield Row("step", f"noise RMS, {ACCELERATION_FAST} / DP1", "", None, ratio, None, note)


def _experiment_rows(hover: Hover, white_m_s: float, inferred: Estimates) -> Iterator[Row]:
    name, paper = "experiment", _FORCE_RMSE["DP1"]
    note = f"inferred: with it DP2 has the paper's {_FORCE_RMSE['DP2']:g} N; the paper does not state its noise"
    yield Row(name, "white noise of the velocity", "m/s", None, white_m_s, None, note)
    found = force_rmse(inferred, "DP1")
    note = "over time and three axes, with that noise; simulated gusts, thrust known exactly"
    yield Row(name, "force RMSE, DP1", "N", paper, found, found <= paper, note)
    note = "by construction; not a comparison"
    yield Row(name, "force RMSE, DP2", "N", None, force_rmse(inferred, "DP2"), None, note)
    usual = observed(hover, USUAL_VELOCITY_M_S)
    for design, figure in _FORCE_RMSE.items():
        found = force_rmse(usual, design)
        note = "uasfly's usual noise, not the paper's, which it does not state"
        quantity = f"force RMSE, {design}, noise {USUAL_VELOCITY_M_S:g} m/s"
        yield Row(name, quantity, "N", figure, found, found <= figure, note)
    for design in DESIGNS:
        along = float(inferred.rmse(design)[0])
        yield Row(name, f"force RMSE along the wind, {design}", "N", None, along, None)
    for design in DESIGNS:
        yield Row(name, f"torque RMSE, {design}", "N m", None, torque_rmse(inferred, design), None)
    spread = float(np.std(hover.truth[:, 0]))
    yield Row(name, "standard deviation of the force along the wind", "N", None, spread, None)
