"""Commander: modes, arming and disarming, failsafe, and the texts that PX4 says with them.

Behaviour and wording follow PX4 (main of August 2026) and the recorded vehicle: any mode is taken while disarmed; in
flight a mode is refused that cannot run; offboard comes back by itself when the stream does; a finished take-off
becomes hold; after landing the vehicle disarms and returns to the mode that was asked for last. Position mode is hold
here: there is no remote control whose sticks it could follow.
"""

from __future__ import annotations

from uasfly.messages import FlightMode, TextSample
from uasfly.sim.failsafe import BatteryLevel, Decision, Failsafe, Situation
from uasfly.sim.parameters import ParameterTable

READY_S = 3.0  # after boot; PX4's simulator says "Ready for takeoff!" after 3.6 s

EMERGENCY, CRITICAL, WARNING, INFO = 0, 2, 4, 6

_NAMES = {
    FlightMode.HOLD: "Hold",
    FlightMode.TAKEOFF: "Takeoff",
    FlightMode.OFFBOARD: "Offboard",
    FlightMode.LAND: "Land",
    FlightMode.RETURN: "Return",
    FlightMode.POSITION: "Position",
    FlightMode.DESCEND: "Descend",
}
_CANNOT_ARM_IN = frozenset({FlightMode.LAND, FlightMode.RETURN, FlightMode.DESCEND})
_NOT_AFTER_DISARMING = _CANNOT_ARM_IN | {FlightMode.TAKEOFF}
_BATTERY_TEXTS = {
    BatteryLevel.LOW: (WARNING, "Low battery level, return advised"),
    BatteryLevel.CRITICAL: (CRITICAL, "Critical battery level, land now"),
    BatteryLevel.EMERGENCY: (EMERGENCY, "Emergency battery level, land immediately"),
}


class Commander:
    """State machine of one vehicle.

    Attributes:
        mode: mode that flies. intended: mode that was asked for.
        armed: motors turn. armed_at_s: since when. failsafe: whether `mode` is a failsafe's choice.
        refuse_arming, refuse_offboard: faults for tests and scenarios.
    """

    def __init__(self, parameters: ParameterTable) -> None:
        self._parameters = parameters
        self._failsafe = Failsafe(parameters)
        self.mode = self.intended = FlightMode.HOLD
        self._after_disarming = FlightMode.HOLD
        self.armed = False
        self.armed_at_s = 0.0
        self.failsafe = False
        self.refuse_arming = self.refuse_offboard = False
        self._has_flown = False
        self._was_landed = True
        self._landed_since_s = 0.0
        self._announced_ready = False
        self._texts: list[TextSample] = []

    def set_mode(self, mode: FlightMode, situation: Situation) -> tuple[bool, str]:
        """Ask for a mode; whether it is taken, and PX4's words when it is not."""
        if mode not in _NAMES:
            return False, self._say(situation, CRITICAL, "Unsupported main mode")
        refused = mode is FlightMode.OFFBOARD and self.refuse_offboard
        if refused or (self.armed and not self._failsafe.can_run(mode, situation)):
            return False, self._say(situation, CRITICAL, f"Switching to {_NAMES[mode]} is currently not available")
        if self.failsafe:
            self._failsafe.overrule()
        self.intended = mode
        if mode not in _NOT_AFTER_DISARMING:
            self._after_disarming = mode
        self._fly(Decision(mode))
        return True, ""

    def arm(self, situation: Situation) -> tuple[bool, str]:
        """Ask to arm; whether the motors start, and PX4's words when they do not."""
        if self.armed:
            return True, ""
        ready = situation.now_s >= READY_S and situation.position_ok and not self.refuse_arming
        ready &= situation.battery_remaining >= self._parameters.value("BAT_CRIT_THR")
        if not ready or self.intended in _CANNOT_ARM_IN or not self._failsafe.can_run(self.intended, situation):
            return False, self._say(situation, CRITICAL, "Arming denied: Resolve system health failures first")
        self.armed, self.armed_at_s, self._has_flown = True, situation.now_s, False
        self._landed_since_s = situation.now_s
        self._say(situation, INFO, "Armed by external command")
        return True, ""

    def disarm(self, situation: Situation, forced: bool = False) -> tuple[bool, str]:
        """Ask to disarm; in the air it takes `forced`."""
        if not self.armed:
            return True, ""
        if not situation.landed and not forced:
            return False, self._say(situation, CRITICAL, "Disarming denied: not landed")
        self._switch_off(situation, "external command")
        return True, ""

    def update(self, situation: Situation, takeoff_done: bool) -> None:
        """Look after everything that PX4 does by itself; call it some twenty times a second."""
        if not self._announced_ready and situation.now_s >= READY_S and situation.position_ok:
            self._announced_ready = True
            self._say(situation, INFO, "Ready for takeoff!")
        self._watch_ground(situation)
        worse = self._failsafe.update_battery(situation)
        if worse is not None:
            self._say(situation, *_BATTERY_TEXTS[worse])
        if not self.armed:
            return
        if self.intended is FlightMode.TAKEOFF and takeoff_done:
            self.intended = FlightMode.HOLD
        decision = self._failsafe.decide(self.intended, situation)
        if decision.disarm:
            self._switch_off(situation, "failsafe")
            return
        if decision.failsafe and not self.failsafe:
            self._say(situation, CRITICAL, "Failsafe activated")
        self._fly(decision)
        self._disarm_by_itself(situation)

    def take_texts(self) -> list[TextSample]:
        """Texts since the last call, oldest first."""
        texts, self._texts = self._texts, []
        return texts

    def say(self, now_s: float, severity: int, text: str) -> None:
        """Say a text of another part of the autopilot."""
        self._texts.append(TextSample(now_s, severity, text))

    def _fly(self, decision: Decision) -> None:
        self.mode, self.failsafe = decision.mode, decision.failsafe

    def _watch_ground(self, situation: Situation) -> None:
        if situation.landed != self._was_landed:
            self._landed_since_s = situation.now_s
            if self.armed:
                self._has_flown |= not situation.landed
                self._say(situation, INFO, "Landing detected" if situation.landed else "Takeoff detected")
        self._was_landed = situation.landed

    def _disarm_by_itself(self, situation: Situation) -> None:
        value = self._parameters.value
        on_ground = situation.now_s - self._landed_since_s
        if self._has_flown:
            limit, reason = value("COM_DISARM_LAND"), "landing"
        else:
            limit, reason = value("COM_DISARM_PRFLT"), "auto preflight disarming"
            on_ground = situation.now_s - self.armed_at_s - value("COM_SPOOLUP_TIME")
        if situation.landed and 0.0 < limit <= on_ground:
            self._switch_off(situation, reason)

    def _switch_off(self, situation: Situation, reason: str) -> None:
        self.armed = self._has_flown = False
        self.intended = self._after_disarming
        self._failsafe.reset()
        self._fly(Decision(self.intended))
        self._say(situation, INFO, f"Disarmed by {reason}")

    def _say(self, situation: Situation, severity: int, text: str) -> str:
        self.say(situation.now_s, severity, text)
        return text
