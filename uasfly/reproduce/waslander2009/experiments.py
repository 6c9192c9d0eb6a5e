"""What is flown: the paper's experiments, each with every one of its controllers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from uasfly.airframe import Airframe
from uasfly.messages import Array
from uasfly.reproduce.waslander2009 import vehicle
from uasfly.reproduce.waslander2009.flight import MakeOnboard, PaperFlight, Record
from uasfly.reproduce.waslander2009.onboard import Onboard
from uasfly.reproduce.waslander2009.sensors import AS_LARGEST, AS_SIGMA, SensorErrors
from uasfly.sim.plant import Plant

# The paper's controllers in its order, and how far they stray in its hover [m].
CONTROLLERS = {"waslander_pid": 0.4, "pid_dd": 0.15, "pid_dd_wind": 0.1}
OWN = ("pid", "pid_dd", "pid_dd_wind", "nmpc")
TITLES = {
    "waslander_pid": "PID",
    "pid_dd": "PID-DD",
    "pid_dd_wind": "PID-DD + wind",
    "pid": "backup PID",
    "nmpc": "NMPC",
}
MAIN = "sensors"  # the ones that feed; the others only look
BY_ACCELEROMETER = "wind and acceleration by the paper's sensors"
BY_ALL = "motion too"
BY_OBSERVER = "all by uasfly's observer, position noise 1 cm"
WRONG_DRAG = 1.1

HOVER, STRONG, STRAIGHT, CIRCLE = "hover", "hover, stronger wind", "straight path", "circular path"

Key = tuple[str, str, str]  # experiment, controller, what it is fed by
Records = Mapping[Key, Sequence[Record]]  # a record a seed


@dataclass(frozen=True, slots=True)
class Extent:
    """How much is flown: the hover's time, the line's length, the circle's turns."""

    hover_s: float = 30.0
    straight_m: float = 8.0
    turns: float = 2.0


def flight_plans(seed: int, extent: Extent) -> dict[Key, PaperFlight]:
    """Everything that is flown with one seed."""
    airframe, plant = vehicle.load_vehicle()
    hover = vehicle.hover(extent.hover_s)
    experiments = {
        HOVER: (hover, vehicle.LIGHT_M_S),
        STRONG: (hover, vehicle.STRONG_M_S),
        STRAIGHT: (vehicle.straight(extent.straight_m), vehicle.LIGHT_M_S),
        CIRCLE: (vehicle.circle(extent.turns), vehicle.LIGHT_M_S),
    }
    plans: dict[Key, PaperFlight] = {}
    for experiment, (mission, w20_m_s) in experiments.items():
        own: tuple[str, ...] = OWN if experiment == HOVER else ("nmpc",)
        scenario = vehicle.paper_scenario(w20_m_s)
        plan = PaperFlight(airframe, plant, scenario, mission, "", seed, {}, flies_by=None)
        for name in CONTROLLERS:
            looks_on = experiment in (HOVER, CIRCLE) and name == "pid_dd_wind"
            onboard = _sensors(airframe, plant, w20_m_s, looks_on)
            fed = replace(plan, controller=name, onboard=onboard, flies_by=MAIN)
            plans[experiment, name, BY_ACCELEROMETER] = fed
            if experiment == HOVER:
                onboard = _sensors(airframe, plant, w20_m_s, looks_on=False)
                plans[experiment, name, BY_ALL] = replace(fed, onboard=onboard, moves_by=True)
        for name in own:
            plans[experiment, name, BY_OBSERVER] = replace(plan, controller=name)
    return plans


def _sensors(airframe: Airframe, plant: Plant, w20_m_s: float, looks_on: bool) -> dict[str, MakeOnboard]:
    """The sensors that a flight is fed by, and with `looks_on` others that are only compared."""

    def aboard(errors: SensorErrors, *, treats_bias: bool = True, scale: float = 1.0) -> MakeOnboard:
        model, density = vehicle.accelerometer_model(plant, scale), vehicle.gust_density(w20_m_s)

        def make(quaternion: Array, rng: np.random.Generator) -> Onboard:
            lag_s = plant.rotors.lag_s
            return Onboard(
                airframe, lag_s, model, errors, rng, quaternion, wind_density=density, treats_bias=treats_bias
            )

        return make

    onboard = {MAIN: aboard(AS_LARGEST)}
    if looks_on:
        onboard["no bias"] = aboard(AS_LARGEST, treats_bias=False)
        onboard["sigma"] = aboard(AS_SIGMA)
        onboard["wrong drag"] = aboard(AS_LARGEST, scale=WRONG_DRAG)
        onboard["unknown ground"] = aboard(replace(AS_LARGEST, tilt_rad=math.radians(2.0)))
    return onboard
