"""The vehicle, the wind and the paths that are flown."""

from __future__ import annotations

import math
from typing import Any

from uasfly.airframe import GRAVITY_M_S2, Airframe
from uasfly.files import find_file, load_file
from uasfly.mission import Mission
from uasfly.sim.plant import AIR_DENSITY_KG_M3, Plant
from uasfly.sim.scenario import Scenario
from uasfly.sim.wind.dryden import low_altitude_parameters
from uasfly.sim.wind.settings import TEN_METRES_M, TWENTY_FEET_M
from uasfly.wind.accelerometer_model import AccelerometerModel

VEHICLE = "f550"
KNOT_M_S = 1852.0 / 3600.0
LIGHT_M_S = 15.0 * KNOT_M_S  # at 20 ft: light turbulence of MIL-F-8785C
STRONG_M_S = 20.0 * KNOT_M_S  # what 30 deg of tilt hold against, with some reserve for the gusts
ROUGHNESS_M = 0.05
TOWARD_DEG = 30.0
HEIGHT_M = 2.0


def load_vehicle() -> tuple[Airframe, Plant]:
    """The shipped airframe and its plant."""
    airframe = load_file(find_file("airframe", VEHICLE), Airframe)
    return airframe, load_file(find_file("plant", airframe.plant), Plant)


def accelerometer_model(plant: Plant, scale: float = 1.0) -> AccelerometerModel:
    """Eq. 28 of a plant at hover; `scale` makes its drag and flapping coefficients wrong."""
    rotors = plant.rotors
    hover_rad_s = math.sqrt(plant.mass_kg * GRAVITY_M_S2 / (rotors.count * rotors.thrust_coefficient))
    flapping = rotors.flapping_kg * rotors.count * hover_rad_s
    drag_x, _, drag_z = plant.drag.linear_n_s_m
    return AccelerometerModel(
        in_plane_1_s=scale * (flapping + drag_x) / plant.mass_kg,
        axial_1_s=scale * drag_z / plant.mass_kg,
        quadratic_1_m=scale * 0.5 * AIR_DENSITY_KG_M3 * plant.drag.area_m2[0] / plant.mass_kg,
        disc_area_per_mass_m2_kg=rotors.count * rotors.disc_area_m2 / plant.mass_kg,
    )


def gust_density(w20_m_s: float) -> tuple[float, float, float]:
    """Density of the random walk [m/s/sqrt(s)] with the power of the paper's gusts above their corner.

    A random walk of density q has q^2 / (pi Omega^2). Half of PSD_h, which is what the sum of sines carries, is
    sigma^2 / (pi L Omega^2) for large L Omega, half of PSD_v 3 sigma^2 / (2 pi L Omega^2).
    """
    figures = low_altitude_parameters(HEIGHT_M, w20_m_s)
    horizontal = figures.sigma_u_m_s / math.sqrt(figures.length_u_m)
    return horizontal, horizontal, figures.sigma_w_m_s * math.sqrt(1.5 / figures.length_w_m)


def paper_scenario(w20_m_s: float) -> Scenario:
    """The paper's wind, so strong at 20 ft; estimate and link as in the shipped scenarios."""
    speed = w20_m_s * math.log(TEN_METRES_M / ROUGHNESS_M) / math.log(TWENTY_FEET_M / ROUGHNESS_M)
    return Scenario.model_validate(
        {
            "name": "waslander2009",
            "wind": {
                "mean": {
                    "kind": "boundary_layer",
                    "speed_at_10_m_m_s": speed,
                    "toward_deg": TOWARD_DEG,
                    "roughness_m": ROUGHNESS_M,
                },
                "gusts": "sum_of_sines",
            },
            "link": {"telemetry_latency_s": 0.005, "command_latency_s": 0.005, "jitter_s": 0.002},
        }
    )


def hover(duration_s: float) -> Mission:
    """Stand at (0, 0, 2)."""
    return _mission("hover", {"type": "hover", "position_m": [0.0, 0.0, HEIGHT_M], "duration_s": duration_s})


def straight(length_m: float) -> Mission:
    """A straight line along x at 1 m/s."""
    half = 0.5 * length_m
    leg = {"type": "line", "from_m": [-half, 0.0, HEIGHT_M], "to_m": [half, 0.0, HEIGHT_M], "speed_m_s": 1.0}
    return _mission("straight", leg)


def circle(turns: float) -> Mission:
    """Circles of 2 m radius at 0.8 m/s, the nose along the path: the body turns against the world's wind."""
    leg = {"type": "circle", "center_m": [0.0, 0.0], "radius_m": 2.0, "height_m": HEIGHT_M, "period_s": 16.0}
    return _mission("circle", {**leg, "turns": turns, "yaw": {"rule": "path"}})


def _mission(name: str, leg: dict[str, Any]) -> Mission:
    return Mission.model_validate(
        {
            "name": name,
            "takeoff": {"height_m": HEIGHT_M},
            "legs": [leg],
            "yaw": {"rule": "fixed", "yaw_deg": 0.0},
            "ending": {"action": "hold"},
            "limits": {"geofence": {"radius_m": 10.0}, "altitude_min_m": 0.5, "altitude_max_m": 6.0},
        }
    )
