"""Thrust of a rotor in wind over its thrust in still air, by momentum theory at constant power.

Waslander & Wang 2009 (after Hoffmann et al. 2007; Leishman, Principles of Helicopter Aerodynamics, 2.13): at a given
command and battery voltage a rotor has the power P = T_h v_h of still air, whatever the wind. With

    v_h = sqrt(T_h / (2 rho A)),  a = climb / v_h (through the disc),  b = in-plane airspeed / v_h,
    lambda = a + v_i / v_h (all that flows through the disc),

power gives T / T_h = 1 / lambda and momentum (v_i / v_h) sqrt(b^2 + lambda^2) = T / T_h, together

    (lambda - a) lambda sqrt(b^2 + lambda^2) = 1.

For lambda > max(a, 0) the left side rises from 0 without a bound, so there is exactly one answer, and it lies within
1 of that end. In fast descent (a between about -2 and -0.5) there is no slipstream and momentum theory says nothing;
the formula goes on smoothly there and is not to be believed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

AIR_DENSITY_KG_M3 = 1.225  # ICAO standard atmosphere, sea level
_MOST_STEPS = 60
_TOLERANCE = 1e-12


@dataclass(frozen=True, slots=True)
class ThrustRatio:
    """T / T_h and its derivatives by the two airspeed ratios a and b."""

    value: float
    by_axial: float
    by_in_plane: float


def hover_inflow_m_s(static_thrust_m_s2: float, disc_area_per_mass_m2_kg: float) -> float:
    """v_h [m/s] of a thrust in still air [m/s^2 of the vehicle] over the discs' area for each kilogram of it."""
    return math.sqrt(max(static_thrust_m_s2, 0.0) / (2.0 * AIR_DENSITY_KG_M3 * disc_area_per_mass_m2_kg))


def thrust_ratio(axial: float, in_plane: float) -> ThrustRatio:
    """T / T_h from the airspeed through the disc (positive: climbing) and along it, both over v_h.

    Newton's method, kept inside the interval that holds the answer; derivatives by the implicit function theorem. What
    is solved for is lambda beyond max(a, 0): neither lambda nor the induced flow is then a difference of large numbers.
    """
    climb, descent = max(axial, 0.0), max(-axial, 0.0)
    low, high = 0.0, 1.0
    beyond = min(max(1.0 - 2.0 / 3.0 * climb - descent / 3.0, 0.05), 1.0)  # the slope of lambda at hover is 1/3
    for _ in range(_MOST_STEPS):
        residual, slope, _, _ = _mismatch(beyond + climb, beyond + descent, in_plane)
        if residual > 0.0:
            high = beyond
        else:
            low = beyond
        step = residual / slope
        following = beyond - step
        if abs(step) <= _TOLERANCE * beyond:
            beyond = following
            break
        beyond = following if low < following < high else 0.5 * (low + high)
    inflow = beyond + climb
    _, slope, by_axial, by_in_plane = _mismatch(inflow, beyond + descent, in_plane)
    by_inflow = -1.0 / (inflow * inflow)
    return ThrustRatio(1.0 / inflow, -by_inflow * by_axial / slope, -by_inflow * by_in_plane / slope)


def _mismatch(inflow: float, induced: float, in_plane: float) -> tuple[float, float, float, float]:
    """Left minus right side of the module's equation, and its derivatives by lambda, a and b."""
    swept = math.hypot(in_plane, inflow)
    by_inflow = (inflow + induced) * swept + induced * inflow * inflow / swept
    return induced * inflow * swept - 1.0, by_inflow, -inflow * swept, induced * inflow * in_plane / swept


def thrust_ratio_in_wind(airspeed_m_s: float, angle_of_attack_rad: float, inflow_m_s: float) -> float:
    """T / T_h as the paper writes it, from airspeed, angle of attack and (through v_h) voltage.

    Args:
        airspeed_m_s: of the vehicle through the air.
        angle_of_attack_rad: between the oncoming air and the disc, positive where air comes from below.
        inflow_m_s: v_h of the present command and voltage, see `hover_inflow_m_s`.
    """
    axial = -airspeed_m_s * math.sin(angle_of_attack_rad) / inflow_m_s
    return thrust_ratio(axial, airspeed_m_s * math.cos(angle_of_attack_rad) / inflow_m_s).value
