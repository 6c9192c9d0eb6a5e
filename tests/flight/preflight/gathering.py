"""A vehicle on the ground with which all is well; tests change what they look at."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from tests.observer.airframes import f550
from uasfly.flight.choices import Engage
from uasfly.flight.preflight import judge
from uasfly.flight.preflight.gathered import Gathered
from uasfly.flight.view import VehicleView
from uasfly.messages import (
    BatterySample,
    FactsSample,
    FlightMode,
    HealthSample,
    NamedValue,
    StateEstimate,
    VehicleSample,
)
from uasfly.mission import Mission
from uasfly.observer.diagnosis import Diagnosis
from uasfly.preflight_messages import PreflightCheck, Verdict

PLACE = np.array((4.0, -3.0, 0.5))
LEVEL = np.array((1.0, 0.0, 0.0, 0.0))
ZERO = np.zeros(3)
CHARGED = BatterySample(100.0, 16.4, 0.9)
AIRFRAME = f550()
OK, WARNING, STOP = Verdict.OK, Verdict.WARNING, Verdict.STOP

PX4 = {
    "COM_OF_LOSS_T": 1.0,
    "COM_OBL_RC_ACT": 5.0,
    "COM_RC_IN_MODE": 3.0,
    "COM_RCL_EXCEPT": 0.0,
    "COM_DLL_EXCEPT": 0.0,
    "COM_DISARM_PRFLT": 10.0,
    "COM_LOW_BAT_ACT": 2.0,
    "BAT_CRIT_THR": 0.07,
    "MPC_THR_HOVER": AIRFRAME.model.hover_thrust,
    "NAV_RCL_ACT": 1.0,
    "NAV_DLL_ACT": 0.0,
    "RTL_RETURN_ALT": 30.0,
}


def mission(**changes: Any) -> Mission:
    """Two metres east of the take-off point, a minute there, inside a fence of 6 m."""
    fields: dict[str, Any] = {
        "name": "there",
        "takeoff": {"height_m": 1.5},
        "legs": [{"type": "hover", "position_m": [2.0, 0.0, 1.5], "duration_s": 60.0}],
        "limits": {"geofence": {"radius_m": 6.0}, "altitude_max_m": 5.0},
    }
    return Mission.model_validate({**fields, **changes})


def facts(parameters: dict[str, float] | None = None, **changes: Any) -> FactsSample:
    """A good link, a fast computer, and PX4 as it should be set, but for these changes."""
    told = FactsSample(
        time_s=100.0,
        parameters=tuple(NamedValue(name, value) for name, value in (PX4 | (parameters or {})).items()),
        home=PLACE,
        rates_hz=(NamedValue("ODOMETRY", 99.0), NamedValue("ATTITUDE_TARGET", 49.0)),
        losses=(NamedValue("ODOMETRY overrun", 0.0),),
        round_trip_s=0.5e-3,
        solve_ms=(0.1,) * 200,
    )
    return replace(told, **changes)


def health(**changes: Any) -> HealthSample:
    """Good GNSS, all valid."""
    told = HealthSample(100.0, position_ok=True, velocity_ok=True, attitude_ok=True, gnss_fix=3, gnss_satellites=12,
                        horizontal_accuracy_m=0.5)  # fmt: skip
    return replace(told, **changes)


def view(*, in_air: bool = False, battery: BatterySample | None = CHARGED, **changes: Any) -> VehicleView:
    """What such a vehicle says."""
    return VehicleView(
        vehicle=VehicleSample(100.0, FlightMode.HOLD, armed=in_air, in_air=in_air),
        battery=battery,
        health=health(**changes),
    )


def estimate(position: Any = PLACE, sigma: float = 0.02) -> StateEstimate:
    """Where it is, and how well that is known."""
    sigmas = np.full(3, sigma)
    return StateEstimate(100.0, np.array(position, dtype=float), ZERO, LEVEL, ZERO, ZERO, ZERO, sigmas, sigmas, sigmas)


def diagnosis(rejected: dict[str, float] | None = None, nis: dict[str, float] | None = None) -> Diagnosis:
    """An observer that is content."""
    shares = {"position": 0.0, "velocity": 0.0, "attitude": 0.0} | (rejected or {})
    errors = {"position": 0.7, "velocity": 1.1, "attitude": math.nan} | (nis or {})
    return Diagnosis(ZERO, ZERO, shares, errors, 0.0, -math.inf, 0.0, True, 0.0, 0)


def gathered(**changes: Any) -> Gathered:
    """All is well, but for these changes."""
    fields: dict[str, Any] = {
        "mission": mission(),
        "airframe": AIRFRAME,
        "engage": Engage.AUTO,
        "view": view(),
        "estimate": estimate(),
        "diagnosis": diagnosis(),
        "origin": PLACE,
        "ages_s": (0.004, 0.008, 0.012),
        "facts": facts(),
    }
    return Gathered(**{**fields, **changes})


def check(name: str, **changes: Any) -> PreflightCheck:
    """One check of what was gathered."""
    (found,) = [line for line in judge(gathered(**changes)) if line.name == name]
    assert found.why
    assert bool(found.remedy) == (found.verdict is not OK), found
    return found


def verdict(name: str, **changes: Any) -> Verdict:
    """What one check says."""
    return check(name, **changes).verdict


def parameter(name: str, value: float, **others: float) -> PreflightCheck:
    """The check of a parameter that has this value."""
    return check(name, facts=facts({name: value, **others}))
