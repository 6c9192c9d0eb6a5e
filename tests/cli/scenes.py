"""Moments of a flight to draw."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from uasfly.cli.scene import Note, Scene
from uasfly.messages import Authority, FlightMode, Phase, StateEstimate, Status


def estimate(
    force: tuple[float, float, float] = (1.5, 0.0, -0.2), position: tuple[float, float, float] = (1.0, -2.0, 1.5)
) -> StateEstimate:
    """An estimate, 6 cm below the reference of `status`."""
    return StateEstimate(
        time_s=0.0,
        position_in_world=np.array(position),
        velocity_in_world=np.array([0.25, 0.0, -0.5]),
        quaternion_body_to_world=np.array([1.0, 0.0, 0.0, 0.0]),
        angular_rate_in_body=np.zeros(3),
        force_in_world=np.array(force),
        gnss_bias_in_world=np.zeros(3),
        position_sigma_m=np.array([0.01, 0.02, 0.015]),
        velocity_sigma_m_s=np.full(3, 0.03),
        force_sigma_m_s2=np.zeros(3),
    )


def status(time_s: float = 1.0, **changes: Any) -> Status:
    """In the second leg, all well."""
    values: dict[str, Any] = {
        "phase": Phase.LEGS,
        "leg": 1,
        "leg_started": True,
        "progress": 0.25,
        "estimate": estimate(),
        "reference_position_in_world": np.array([1.0, -2.0, 1.56]),
        "mode": FlightMode.OFFBOARD,
        "armed": True,
        "battery_remaining": 0.87,
        "battery_voltage_v": 15.8,
        "telemetry_age_s": 0.008,
        "authority": Authority(0.3, 0.1, 0.38, 0.5),
    }
    return Status(time_s, **(values | changes))


def unknown(time_s: float = 0.0) -> Status:
    """Before anything has been heard."""
    return Status(time_s, Phase.CONNECT, -1, False, 0.0, None, None)


def not_finite(value: float) -> Status:
    """Every number that a status holds is this one."""
    filled = np.full(3, value)
    return status(
        progress=value,
        estimate=StateEstimate(value, filled, filled, np.full(4, value), *[filled] * 6),
        reference_position_in_world=filled,
        battery_remaining=value,
        battery_voltage_v=value,
        telemetry_age_s=value,
        authority=Authority(value, value, value, value),
        pace=value,
    )


def scene(of: Status | None = None, notes: tuple[Note, ...] = (), **changes: Any) -> Scene:
    """A moment of the flight of hover in the scenario gusty, at 50 Hz."""
    values: dict[str, Any] = {
        "title": "uasfly · hover · f550 · gusty",
        "legs": ("hover", "spiral"),
        "period_ms": 20.0,
        "status": of or status(),
        "clock_s": 75.0,
        "cycle_hz": 50.0,
        "sent_hz": 49.0,
        "cycle_ms": 2.5,
        "solve_ms": 1.0,
        "last_solve_ms": 1.25,
        "notes": notes,
    }
    return Scene(**(values | changes))


NAN = math.nan
