"""Failsafe: which mode PX4 flies instead of the intended one, and since when.

After PX4's failsafe state machine (main of August 2026): loss of the offboard stream acts by COM_OBL_RC_ACT; a mode
that needs a position and has none falls through return and land to descend; a battery that runs low acts by
COM_LOW_BAT_ACT after COM_FAIL_ACT_T in hold; what the pilot chooses afterwards has priority.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass

from uasfly.messages import FlightMode
from uasfly.sim.parameters import ParameterTable

WITHOUT_POSITION = frozenset({FlightMode.OFFBOARD, FlightMode.DESCEND})

_LOSS_ACTIONS = {3: FlightMode.RETURN, 4: FlightMode.LAND, 5: FlightMode.HOLD}
_NO_REMOTE_CONTROL = {1: FlightMode.HOLD, 2: FlightMode.RETURN, 3: FlightMode.LAND}  # NAV_RCL_ACT
_DISARM_ACTIONS = (6, 7)  # terminate and disarm


class BatteryLevel(enum.IntEnum):
    """PX4's battery warnings."""

    FULL = 0
    LOW = 1
    CRITICAL = 2
    EMERGENCY = 3


@dataclass(frozen=True, slots=True)
class Situation:
    """What the commander knows when it decides."""

    now_s: float
    setpoint_age_s: float
    position_ok: bool
    battery_remaining: float
    landed: bool


@dataclass(frozen=True, slots=True)
class Decision:
    """Mode to fly; whether that is a failsafe's choice; whether to switch the motors off."""

    mode: FlightMode
    failsafe: bool = False
    disarm: bool = False


class Failsafe:
    """Decides, and remembers what the pilot has overruled.

    Attributes:
        battery_level: present warning.
    """

    def __init__(self, parameters: ParameterTable) -> None:
        self._parameters = parameters
        self.battery_level = BatteryLevel.FULL
        self._battery_since_s = 0.0
        self._overruled = BatteryLevel.FULL

    def overrule(self) -> None:
        """The pilot has chosen a mode: the present battery warning acts no more."""
        self._overruled = self.battery_level

    def reset(self) -> None:
        """Forget what was overruled (on disarming)."""
        self._overruled = BatteryLevel.FULL

    def offboard_lost(self, situation: Situation) -> bool:
        """Whether the offboard stream is older than COM_OF_LOSS_T."""
        return situation.setpoint_age_s > self._parameters.value("COM_OF_LOSS_T")

    def can_run(self, mode: FlightMode, situation: Situation) -> bool:
        """Whether a mode has what it needs."""
        if mode is FlightMode.OFFBOARD:
            return not self.offboard_lost(situation)
        return mode in WITHOUT_POSITION or situation.position_ok

    def update_battery(self, situation: Situation) -> BatteryLevel | None:
        """The battery's level when it has just become worse, else None."""
        value, remaining = self._parameters.value, situation.battery_remaining
        if remaining < value("BAT_EMERGEN_THR"):
            level = BatteryLevel.EMERGENCY
        elif remaining < value("BAT_CRIT_THR"):
            level = BatteryLevel.CRITICAL
        else:
            level = BatteryLevel.LOW if remaining < value("BAT_LOW_THR") else BatteryLevel.FULL
        worse = level > self.battery_level
        if worse:
            self._battery_since_s = situation.now_s
        self.battery_level = level
        return level if worse else None

    def decide(self, intended: FlightMode, situation: Situation) -> Decision:
        """Mode to fly, for the mode that the pilot (or the companion) intends."""
        mode, failsafe = intended, False
        if intended is FlightMode.OFFBOARD and self.offboard_lost(situation):
            action = round(self._parameters.value("COM_OBL_RC_ACT"))
            if action in _DISARM_ACTIONS:
                return Decision(intended, failsafe=True, disarm=True)
            without_pilot = _NO_REMOTE_CONTROL.get(round(self._parameters.value("NAV_RCL_ACT")), FlightMode.RETURN)
            mode, failsafe = _LOSS_ACTIONS.get(action, without_pilot), True
        battery = self._battery_action()
        if battery is not None and intended is not FlightMode.LAND:
            waiting = situation.now_s - self._battery_since_s < self._parameters.value("COM_FAIL_ACT_T")
            mode, failsafe = (FlightMode.HOLD if waiting else battery), True
        if not self.can_run(mode, situation):
            mode, failsafe = FlightMode.DESCEND, True
        return Decision(mode, failsafe)

    def _battery_action(self) -> FlightMode | None:
        """PX4: 0 warning, 2 land, 3 return at critical and land at emergency."""
        if self.battery_level <= self._overruled or self.battery_level < BatteryLevel.CRITICAL:
            return None
        action = round(self._parameters.value("COM_LOW_BAT_ACT"))
        if action == 2 or (action == 3 and self.battery_level is BatteryLevel.EMERGENCY):
            return FlightMode.LAND
        return FlightMode.RETURN if action in {1, 3} else None
