"""Is there enough in the battery, as far as that can be known before the flight?"""

from __future__ import annotations

import math
from collections.abc import Iterator

from uasfly.flight.monitors.battery import LANDING_S
from uasfly.flight.preflight.gathered import Gathered, Subject
from uasfly.preflight_messages import PreflightCheck
from uasfly.trajectories.mission_trajectory import MissionTrajectory

TAKEOFF_S = 8.0  # arming, spooling up and settling, beside the climb
SHORT_ENDURANCE_MIN = 8.0  # multirotors that work hover longer on a full battery
LONG_ENDURANCE_MIN = 40.0  # hardly any multirotor with a battery hovers longer

_CHARGE = Subject("battery", "below the mission's threshold the flight ends as soon as it has begun")
_MISSION = Subject("endurance", "the charge has to last for take-off, mission and landing")


def battery_checks(gathered: Gathered, trajectory: MissionTrajectory | None) -> Iterator[PreflightCheck]:
    """All checks of this file; the trajectory is None where the mission cannot be flown from here."""
    yield _charge(gathered)
    if trajectory is not None:
        yield _for_mission(gathered, trajectory.duration_s)


def _charge(gathered: Gathered) -> PreflightCheck:
    battery, settings = gathered.view.battery, gathered.mission.monitors.battery
    voltage_v = gathered.view.voltage_v
    if battery is None or (voltage_v is None and not math.isfinite(battery.remaining)):
        return _CHARGE.warning("not told", "measure the battery; PX4 needs a power module that it is calibrated for")
    known = math.isfinite(battery.remaining)
    charge = f"{battery.remaining * 100.0:.0f} %" if known else "charge not told"
    value = charge if voltage_v is None else f"{charge}, {voltage_v:.1f} V"
    if settings.voltage_v is not None and voltage_v is not None and voltage_v < settings.voltage_v:
        return _CHARGE.stop(value, f"charge it: the mission ends below {settings.voltage_v:g} V")
    if known and battery.remaining < settings.remaining:
        return _CHARGE.stop(value, f"charge it: the mission ends below {settings.remaining * 100.0:.0f} %")
    if known and battery.remaining < settings.warn_remaining:
        return _CHARGE.warning(value, "charge it")
    if not known:
        return _CHARGE.warning(value, "set BAT1_N_CELLS, BAT1_V_CHARGED and BAT1_V_EMPTY, so that PX4 knows the charge")
    return _CHARGE.ok(value)


def _for_mission(gathered: Gathered, legs_s: float) -> PreflightCheck:
    """What a full battery would have to last; what this vehicle uses is not known before it flies."""
    battery, settings, mission = gathered.view.battery, gathered.mission.monitors.battery, gathered.mission
    limits = gathered.airframe.limits
    needed_s = legs_s + LANDING_S + mission.takeoff.height_m / limits.descent_m_s
    if not gathered.view.in_air:
        needed_s += TAKEOFF_S + mission.takeoff.height_m / limits.climb_m_s
    flight = f"{needed_s / 60.0:.1f} min of flight"
    if battery is None or not math.isfinite(battery.remaining):
        return _MISSION.warning(f"{flight}, charge not told", "see that the battery lasts for it")
    usable = battery.remaining - settings.remaining
    if usable <= 0.0:
        return _MISSION.stop(f"{flight}, nothing left above the mission's threshold", "charge it")
    endurance_min = needed_s / usable / 60.0
    value = f"{flight}: enough where a full battery flies {endurance_min:.1f} min (consumption is not known)"
    if endurance_min > LONG_ENDURANCE_MIN:
        return _MISSION.stop(value, "charge it, or split the mission")
    if endurance_min > SHORT_ENDURANCE_MIN:
        return _MISSION.warning(value, "compare with what the vehicle flies; charge it, or split the mission")
    return _MISSION.ok(value)
