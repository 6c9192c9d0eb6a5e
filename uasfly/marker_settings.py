"""The mission file's section `marker`: the bundle that a mission in the frame `marker` is flown by."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field

from uasfly.airframe import FileModel


class UntilSeen(FileModel):
    """What the vehicle does after the take-off until the bundle is known well enough to plan by."""

    action: Annotated[
        Literal["hold", "search"], Field(description="hold as it is, or search: turn in place where it is")
    ] = "hold"
    turn_rate_deg_s: Annotated[float, Field(gt=0.1, le=90.0, description="of the search, to the left")] = 15.0
    timeout_s: Annotated[float, Field(gt=0.0, le=3600.0, description="from being in offboard")] = 120.0
    then: Annotated[
        Literal["end", "return", "land", "hand_over"], Field(description="what follows when it was not seen")
    ] = "end"

    @property
    def turn_rate_rad_s(self) -> float:
        """Of the search [rad/s]."""
        return math.radians(self.turn_rate_deg_s)


class MarkerSettings(FileModel):
    """Which bundle, and what to do until it is seen; what is done when it is lost say the monitors."""

    bundle: Annotated[str, Field(min_length=1, description="a shipped name (four_36h11) or a bundle file")]
    until_seen: UntilSeen = UntilSeen()
