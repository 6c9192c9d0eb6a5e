"""What identification takes from a flight log: the estimates of the time in the air."""

from __future__ import annotations

from pathlib import Path

from uasfly.errors import FileError
from uasfly.messages import Phase, StateEstimate, Status, VehicleSample
from uasfly.record.reader import LogReader

_FLOWN = frozenset({Phase.ENGAGE, Phase.LEGS})  # take-off and landing are near the ground


def estimates_in_air(path: Path) -> list[StateEstimate]:
    """Estimates while the vehicle flew, between take-off and ending, in order.

    Raises:
        FileError: when the file is no flight log, or nothing flew in it.
    """
    reader = LogReader(path)
    reader.description()
    in_air = False
    estimates: list[StateEstimate] = []
    for logged in reader.messages(VehicleSample, Status):
        message = logged.message
        if isinstance(message, VehicleSample):
            in_air = message.in_air
        elif in_air and message.phase in _FLOWN and message.estimate is not None:
            estimates.append(message.estimate)
    if not estimates:
        raise FileError(str(path), ["expected a log of a flight, found no estimate of a vehicle in the air in it"])
    return estimates
