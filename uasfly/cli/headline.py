"""What is going on, in a word, a colour and a sentence."""

from __future__ import annotations

from dataclasses import dataclass

from uasfly.messages import Action, FlightMode, Phase, Status

GOING, CAREFUL, LEAVING, PILOT, NEUTRAL = "green", "yellow", "red", "blue", "white"
SILENT_S = 0.5  # without telemetry for so long nothing is sent
_FLOWN = frozenset({Phase.TAKEOFF, Phase.ENGAGE, Phase.LEGS, Phase.ENDING})

_ACTIONS = {
    Action.SLOW_DOWN: ("SLOWED", CAREFUL),
    Action.HOLD: ("HOLDING", CAREFUL),
    Action.BACK_OFF: ("BACKING OFF", CAREFUL),
    Action.END: ("ENDING", LEAVING),
    Action.RETURN: ("RETURNING", LEAVING),
    Action.LAND: ("LANDING", LEAVING),
    Action.HAND_OVER: ("HANDING OVER", LEAVING),
}
_ENDINGS = {FlightMode.LAND: "LANDING", FlightMode.DESCEND: "LANDING", FlightMode.RETURN: "RETURNING"}


@dataclass(frozen=True, slots=True)
class Headline:
    """One word in capitals, its colour by state, and why."""

    word: str
    colour: str
    text: str


def headline(status: Status) -> Headline:
    """Green: as planned. Yellow: slowed, held, backing off. Red: leaving the mission. Blue: the pilot has it."""
    if status.phase in _FLOWN and status.telemetry_age_s > SILENT_S:
        return Headline("NO TELEMETRY", LEAVING, "nothing is heard from the vehicle, nothing is sent")
    match status.phase:
        case Phase.CONNECT:
            return Headline("CONNECTING", NEUTRAL, "waiting for the vehicle's telemetry")
        case Phase.PREFLIGHT:
            return Headline("PREFLIGHT", NEUTRAL, "checking that the vehicle is ready to fly")
        case Phase.TAKEOFF:
            return Headline("TAKE-OFF", GOING, "the vehicle takes off by itself")
        case Phase.ENGAGE if status.pilot_flies:
            return Headline("PILOT HAS IT", PILOT, "the switch to offboard gives the vehicle to uasfly")
        case Phase.ENGAGE:
            return Headline("ENGAGING", GOING, "asking the vehicle for offboard")
        case Phase.LEGS:
            return _legs(status)
        case Phase.ENDING:
            word = _ENDINGS.get(status.mode, "ENDING")
            return Headline(word, LEAVING if status.reason else GOING, status.reason or "the mission has been flown")
        case Phase.DONE:
            return Headline("DONE", GOING, "the mission has been completed")
        case Phase.ABORTED:
            return Headline("ABORTED", LEAVING, status.reason)


def _legs(status: Status) -> Headline:
    if status.waits_for and status.action not in _ACTIONS:
        return Headline("WAITING", CAREFUL, f"for {status.waits_for}")
    if status.action not in _ACTIONS:
        return Headline("FLYING", GOING, "as planned" if not status.alarms else "as planned, with a warning")
    word, colour = _ACTIONS[status.action]
    why = [alarm.text for alarm in status.alarms if alarm.action is status.action]
    return Headline(word, colour, why[0] if why else "")
