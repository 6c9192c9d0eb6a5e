"""Waslander & Wang 2009: wind from accelerometers, and PID, PID with double derivative and with wind compensation.

What the paper's text states and what had to be assumed:

- Vehicle: the figures at hand do not describe one. The shipped f550 flies, plant and airframe as they are, at 50 Hz.
- Wind: the paper's boundary layer (z0 = 0.05 m) and sum of sines, towards 30 deg, so that both axes meet mean and
  gusts; how strong is not stated. Flown are 15 knots at 20 ft, the light turbulence of MIL-F-8785C (5.9 m/s at 2 m), in
  which the plain PID strays a third as far as the paper's, and for the hover 20 knots (7.9 m/s at 2 m), half as far.
  22 take all of the f550's tilt now and then (seed 20). The paper's wind was stronger, its gains softer, or both. What
  can be compared is the order of the three and what each step gains.
- Sensors: the upper end of each range that the paper gives. The accelerometer's "0.3 g" cannot be the standard
  deviation of white noise at 50 Hz if the wind is to be seen (a sample of 2.9 m/s^2 is 8 m/s of wind): read as the
  largest error, three standard deviations, it is 0.1 g. The other reading is flown beside it. Gyro and magnetometer
  are white at 50 Hz; the sonar reaches 1.5 m and does not help at 2 m.
- What the controllers fly by: wind and acceleration from the accelerometer (and the rest of the paper's sensors)
  through the Kalman filter, position and velocity from the vehicle's own estimate. With position and velocity from
  5 cm of white GPS noise at 10 Hz as well, that noise moves the vehicle more than the wind does; it is flown beside.
- Attitude: gyro from the ground on, heading pulled to the magnetometer. The ground is level to 0.3 deg (sigma, drawn
  for each flight; not the paper's). On one heading that cannot be told from the accelerometer's bias, and a degree is
  0.5 m/s of wind: flights with an RMSE above 0.5 m/s come of it (seeds 5 and 10, 0.7 and 1.2 deg: 0.56 and 0.69 m/s;
  on level ground 0.42 and 0.41).
- Drag and flapping coefficients are those of the plant file at hover, as a bench test would give them; the thrust in
  wind is the paper's (constant power), which is not the plant's (constant speed).
- Compensation: at 0.1 g of noise the wind is known to 0.3 m/s on each axis, in light wind about half of the gusts
  themselves. Level, what the compensation gains over the double derivative is lost to that noise there; in the stronger
  wind it is not. Upright there is no double derivative (the thrust has no attitude loop whose lag it could shorten):
  PID and PID-DD are the same, and the compensation leaves a third.
- Seeds: figures are means of five, the one that is asked for and the ones after it: a single flight tells by chance
  which of two controllers is the better where they are near each other.
- Gains: by one rule for all three controllers, see `uasfly.control.position_gains`; the paper gives none. Height keeps
  the airframe file's, so PID and PID-DD stray alike there, and by the largest deviation where that is height's.
  Tried with seeds 1 to 5: a double derivative on height (0.26 or 0.5) lets PID-DD stray up to 2.5 cm more. The rule's
  gains on height (for 0.08 s of lag) leave 2 to 6 cm there; the largest deviations are then 11.6, 6.5 and 6.4 cm in
  15 knots and 23.8, 10.7 and 8.6 in 20, in the paper's order.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from uasfly.reproduce.rows import SEEDS, Progress, Reproduction
from uasfly.reproduce.waslander2009 import experiments as e
from uasfly.reproduce.waslander2009 import pictures
from uasfly.reproduce.waslander2009.flight import Record, fly
from uasfly.reproduce.waslander2009.results import all_rows

PAPER = "waslander2009"


def reproduce(seed: int, progress: Progress) -> Reproduction:
    """Fly all experiments with this seed and the ones after it, and compare with the paper."""
    extent = e.Extent()
    plans = [item for one in range(seed, seed + SEEDS) for item in e.flight_plans(one, extent).items()]
    records: dict[e.Key, list[Record]] = {}
    for number, (key, plan) in enumerate(plans):
        experiment, name, fed_by = key
        progress(f"{experiment}, {e.TITLES[name]}, {fed_by}, seed {plan.seed}", number / len(plans))
        records.setdefault(key, []).append(fly(plan))
    progress("all flown", 1.0)
    return compare(records, extent)


def compare(records: e.Records, extent: e.Extent) -> Reproduction:
    """Rows and pictures of flights, as many seeds as there are of each of `experiments.flight_plans`."""
    return Reproduction(PAPER, all_rows(records, extent), _pictures(records))


def _pictures(records: e.Records) -> dict[str, Callable[[Path], None]]:
    """Of each experiment's first flight."""

    def first(experiment: str) -> dict[str, Record]:
        return {e.TITLES[name]: records[experiment, name, e.BY_ACCELEROMETER][0] for name in e.CONTROLLERS}

    def hover(experiment: str) -> dict[str, Record]:
        return {**first(experiment), "uasfly's NMPC": records[experiment, "nmpc", e.BY_OBSERVER][0]}

    return {
        "hover": partial(pictures.positions, hover(e.HOVER)),
        "hover_stronger": partial(pictures.positions, hover(e.STRONG)),
        "wind": partial(pictures.winds, records[e.HOVER, "pid_dd_wind", e.BY_ACCELEROMETER][0], e.MAIN),
        "straight": partial(pictures.paths, first(e.STRAIGHT)),
        "circle": partial(pictures.paths, first(e.CIRCLE)),
    }
