"""What a flight leaves to choose: who engages, and how it ends."""

from __future__ import annotations

from enum import Enum

from uasfly.messages import FlightMode, RequestKind


class Engage(Enum):
    """Who arms, takes off and switches to offboard: uasfly, or the pilot with the remote control."""

    AUTO = "auto"
    PILOT = "pilot"


class EndingAction(Enum):
    """How a mission ends."""

    LAND = "land"
    HOLD = "hold"
    RETURN = "return"


ENDING_REQUESTS = {
    EndingAction.LAND: RequestKind.LAND,
    EndingAction.HOLD: RequestKind.HOLD,
    EndingAction.RETURN: RequestKind.RETURN,
}
_BEFORE_ENDING = frozenset({FlightMode.TAKEOFF, FlightMode.OFFBOARD, FlightMode.HOLD, FlightMode.DESCEND})
ENDING_MODES = {
    EndingAction.LAND: _BEFORE_ENDING | {FlightMode.LAND},
    EndingAction.HOLD: _BEFORE_ENDING,
    EndingAction.RETURN: _BEFORE_ENDING | {FlightMode.RETURN, FlightMode.LAND},
}
