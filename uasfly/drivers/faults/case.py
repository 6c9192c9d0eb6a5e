"""One row of the fault table before it is flown: the fault, and what has to happen."""

from __future__ import annotations

import json
from dataclasses import dataclass
from enum import Enum
from typing import Any

BEGIN_S = 6.0  # after offboard: the glide onto the path is over
HOVER_S = 22.0
LIVE_HOVER_S = 14.0  # in real time every second counts
HEIGHT_M = 1.5


def _hover(duration_s: float) -> tuple[str, ...]:
    return (f"mission.legs=[{{type: hover, position_m: [0, 0, {HEIGHT_M}], duration_s: {duration_s}}}]",)


HOVER, LIVE_HOVER = _hover(HOVER_S), _hover(LIVE_HOVER_S)
TRACK = (
    f"mission.legs=[{{type: back_and_forth, start_m: [-3, 0, {HEIGHT_M}], end_m: [3, 0, {HEIGHT_M}], speed_m_s: 0.5, "
    "stop_s: 1, passes: 2}]",
)


class Act(Enum):
    """What happens to the running program, from outside or inside, instead of to the vehicle or the link."""

    FREEZE = "freeze"  # SIGSTOP, and SIGCONT after a while
    KILL = "kill"
    HANG = "hang"  # one control cycle does not come back for a while
    FAILING_SOLVER = "failing solver"
    CTRL_C = "Ctrl-C"
    CTRL_C_TWICE = "Ctrl-C twice"
    TERMINATE = "SIGTERM"
    HANG_UP = "SIGHUP"
    DISK_FULL = "disk full"
    FOLDER_GONE = "folder gone"


@dataclass(frozen=True, slots=True)
class FaultCase:
    """A fault and its expected result.

    Attributes:
        name: short, unique; `uasfly faults NAME` flies this one.
        fault: for people.
        expected: what has to happen, in this order and nothing else (words of `story.Story`).
        stray_m: how far the vehicle may stray from its path before the flight or uasfly's part in it ends.
        reaction_s: how soon the first of `expected` has to come; None where nothing has to.
        faults: of the vehicle or the link, as in a scenario file.
        act: what happens to the program; such cases are flown over MAVLink in real time, see `live`.
        act_s: how long a freeze or hang lasts.
        live: over MAVLink although nothing happens to the program.
        settings: `--set` texts beside the faults.
        scenario, airframe: as on the command line.
    """

    name: str
    fault: str
    expected: tuple[str, ...]
    stray_m: float
    reaction_s: float | None = None
    faults: tuple[dict[str, Any], ...] = ()
    act: Act | None = None
    act_s: float = 3.0
    live: bool = False
    settings: tuple[str, ...] = HOVER
    scenario: str = "gusty"
    airframe: str = "f550"

    @property
    def all_settings(self) -> list[str]:
        """`--set` texts of the flight, the faults among them."""
        settings = list(self.settings)
        if self.over_mavlink and self.settings is HOVER:
            settings = list(LIVE_HOVER)
        if self.faults:
            timed = [{"at_s": BEGIN_S, **fault} for fault in self.faults]
            settings.append(f"scenario.faults={json.dumps(timed)}")
        return settings

    @property
    def over_mavlink(self) -> bool:
        """Whether it is flown over MAVLink in real time."""
        return self.live or self.act is not None
