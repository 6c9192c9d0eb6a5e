"""The paper's pictures: estimates against truth, the observers' Bode plots, the step, the experiment."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from uasfly.messages import Array
from uasfly.plotting import quiet_figure, save
from uasfly.reproduce.asignacion2022.conditions import GUST_HZ
from uasfly.reproduce.asignacion2022.flight import DESIGNS, Estimates
from uasfly.reproduce.asignacion2022.sensors import SAMPLE_S
from uasfly.reproduce.asignacion2022.sines import Response, swept
from uasfly.reproduce.asignacion2022.steps import ACCELERATION_FAST, STEP_AT_S, STEP_N, Steps
from uasfly.wind.bands import GUST_BAND_HZ, BandSplit
from uasfly.wind.six_axes import AXES

_TRUTH = "#5b6470"
_COLOURS = ("#2f6fd0", "#e0762a", "#2f9e5a", "#c23b3b", "#7d55c7")
_NOISIER_FIRST = (("DP2", _COLOURS[1]), ("DP1", _COLOURS[0]))  # so that the other is drawn over it

Draw = Callable[[Path], None]


def estimates(name: str, found: Estimates) -> Draw:
    """Six panels, one an axis: disturbance, and both designs' estimates of it."""

    def draw(path: Path) -> None:
        figure, panels = quiet_figure(2, 3, (13.0, 6.5))
        figure.suptitle(f"{name}: disturbance and its estimates")
        for number, (axes, axis) in enumerate(zip(panels.flat, AXES, strict=True)):
            for design, colour in _NOISIER_FIRST:
                axes.plot(found.times_s, found.estimates[design][:, number], color=colour, linewidth=1.0, label=design)
            axes.plot(found.times_s, found.truth[:, number], color="black", linewidth=1.0, label="truth")
            axes.set_ylabel(f"{axis} [{'N' if number < 3 else 'N m'}]")
            axes.set_xlabel("time [s]")
        panels.flat[0].legend(loc="upper right", framealpha=0.9)
        save(figure, path)

    return draw


def bode(measured: Mapping[str, Response]) -> Draw:
    """Gain and phase lag of both designs over frequency, measured sine by sine; the flight's lag as a ring."""

    def draw(path: Path) -> None:
        figure, ((above,), (below,)) = quiet_figure(2, 1, (9.0, 7.0))
        frequencies: Array = np.geomspace(0.02, 50.0, 21)
        for colour, (name, design) in zip(_COLOURS, DESIGNS.items(), strict=False):
            found = swept(design, frequencies)
            label = f"{name}, f_c = {design.cutoff_hz:g} Hz"
            above.semilogx(frequencies, [20.0 * np.log10(one.gain) for one in found], "o-", color=colour, label=label)
            below.semilogx(frequencies, [one.lag_deg for one in found], "o-", color=colour, label=label)
            flight = measured[name]
            text = f"{name} in flight: {flight.lag_deg:.2f} deg at {GUST_HZ:g} Hz"
            below.plot(GUST_HZ, flight.lag_deg, "o", color=colour, markersize=12, fillstyle="none", label=text)
        for axes in (above, below):
            axes.axvspan(*GUST_BAND_HZ, color="#dbe7f8", label="gust band")
            axes.legend(loc="best", framealpha=0.9)
        above.set_ylabel("gain [dB]")
        below.set_ylabel("phase lag [deg]")
        below.set_xlabel("frequency of the disturbance [Hz]")
        save(figure, path)

    return draw


def steps(found: Steps) -> Draw:
    """All observers' answers to a step, without and with sensor noise."""

    def draw(path: Path) -> None:
        figure, ((above,), (below,)) = quiet_figure(2, 1, (9.0, 7.0))
        step: Array = np.where(found.times_s > STEP_AT_S, STEP_N, 0.0)
        for axes, forces, what in ((above, found.forces, "without"), (below, found.noisy, "with")):
            axes.plot(found.times_s, step, color="black", label="truth")
            for colour, (name, values) in zip(_COLOURS, forces.items(), strict=True):
                style = "--" if name == ACCELERATION_FAST else "-"  # without noise it lies upon DP1
                axes.plot(found.times_s, values, style, color=colour, linewidth=1.2, label=name)
            axes.set_ylabel(f"force [N], {what} sensor noise")
        above.legend(loc="lower right", framealpha=0.9)
        below.set_xlabel("time [s]")
        save(figure, path)

    return draw


def experiment(found: Estimates) -> Draw:
    """Force along the wind: truth and estimates; and DP1's estimate by bands."""

    def draw(path: Path) -> None:
        figure, ((above,), (below,)) = quiet_figure(2, 1, (11.0, 7.0))
        for design, colour in _NOISIER_FIRST:
            above.plot(found.times_s, found.estimates[design][:, 0], color=colour, linewidth=0.9, label=design)
        above.plot(found.times_s, found.truth[:, 0], color="black", linewidth=1.0, label="truth")
        split = BandSplit(SAMPLE_S)
        times = found.times_s.tolist()
        bands = [split.update(time_s, row[:1]) for time_s, row in zip(times, found.estimates["DP1"], strict=True)]
        low, high = GUST_BAND_HZ
        parts = {
            f"quasi-static, below {low:g} Hz": [band.quasi_static[0] for band in bands],
            f"gust, {low:g} to {high:g} Hz": [band.gust[0] for band in bands],
            "rest": [band.rest[0] for band in bands],
        }
        for colour, (name, part) in zip((_COLOURS[0], _COLOURS[3], _TRUTH), parts.items(), strict=True):
            below.plot(times, part, color=colour, linewidth=0.9, label=name)
        above.set_ylabel("force along the wind [N]")
        below.set_ylabel("DP1's estimate by bands [N]")
        below.set_xlabel("time [s]")
        for axes in (above, below):
            axes.legend(loc="upper right", framealpha=0.9)
        save(figure, path)

    return draw
