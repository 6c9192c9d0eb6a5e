"""All monitors of one mission."""

from __future__ import annotations

import math

from uasfly.airframe import Airframe
from uasfly.control.protocol import ControlResult
from uasfly.flight.monitors.battery import BatteryEnds, BatteryLow
from uasfly.flight.monitors.estimate import UncertainEstimate, not_finite
from uasfly.flight.monitors.gnss import GnssDegraded, GnssDrift, GnssJump, GnssLost
from uasfly.flight.monitors.marker import MarkerLost, MarkerMoved
from uasfly.flight.monitors.motion import FarFromReference, OutsideAltitudes, OutsideFence, Tilted, carried
from uasfly.flight.monitors.solver import Fallbacks
from uasfly.flight.monitors.watch import Watch
from uasfly.flight.monitors.watched import Watched
from uasfly.flight.monitors.wind import BeyondWindLimit, CannotHold, CannotReturn, WindTakesMuch
from uasfly.messages import Alarm
from uasfly.mission import Mission
from uasfly.monitor_settings import Monitor

LOOK_S = 0.1  # a finding has to last longer than that to count, but for a few that stay for half a second
SAME_TIME_S = 1e-6
_AT_ONCE = Monitor(action="hand_over", after_s=0.0)


class Monitors:
    """Looks at everything that the mission file's section `monitors` names, ten times a second.

    Attributes:
        alarms: of the last look, in the mission's order of monitors.
    """

    def __init__(self, mission: Mission, airframe: Airframe) -> None:
        """Take thresholds, limits and speeds."""
        s, limits = mission.monitors, mission.limits
        self.alarms: tuple[Alarm, ...] = ()
        self._looked_s = -math.inf
        self._fallbacks = fallbacks = Fallbacks(s.solver)
        told = Monitor(action="warn", after_s=s.wind.after_s, clear_s=5.0)
        self._watches: tuple[Watch, ...] = (
            Watch("estimate", _AT_ONCE, not_finite),
            Watch("estimate", s.estimate, UncertainEstimate(s.estimate)),
            Watch("gnss_lost", s.gnss_lost, GnssLost(), flying_only=False),
            Watch("gnss_degraded", s.gnss_degraded, GnssDegraded(s.gnss_degraded), flying_only=False),
            Watch("gnss_jump", s.gnss_jump, GnssJump(s.gnss_jump)),
            Watch("gnss_drift", s.gnss_drift, GnssDrift(s.gnss_drift)),
            Watch("geofence", s.geofence, OutsideFence(limits, s.geofence)),
            Watch("altitude", s.altitude, OutsideAltitudes(limits, s.altitude)),
            Watch("tracking", s.tracking, FarFromReference(s.tracking)),
            Watch("contact", s.contact, carried),
            Watch("tilt", s.tilt, Tilted(airframe, s.tilt)),
            Watch("battery", Monitor(action="warn", after_s=1.0), BatteryLow(s.battery), flying_only=False),
            Watch("battery", s.battery, BatteryEnds(s.battery, mission, airframe), flying_only=False),
            Watch("wind", told, BeyondWindLimit(mission, airframe)),
            Watch("wind", told, WindTakesMuch(s.wind)),
            Watch("wind", told, CannotReturn(s.wind)),
            Watch("wind", s.wind, CannotHold(s.wind)),
            Watch("solver", Monitor(action="warn", after_s=0.0), fallbacks.late),
            Watch("solver", s.solver, fallbacks.backup),
        )
        if mission.frame == "marker":
            found_late = s.marker_lost.model_copy(update={"after_s": 0.0})  # the finding has that age itself
            self._watches += (
                Watch("marker_lost", found_late, MarkerLost(s.marker_lost)),
                Watch("marker_moved", s.marker_moved, MarkerMoved(s.marker_moved), flying_only=False),
            )

    def due(self, time_s: float, control: ControlResult | None) -> bool:
        """Whether it is time to look again; tell each cycle what has flown in the last one."""
        self._fallbacks.count(time_s, control)
        return time_s - self._looked_s >= LOOK_S - SAME_TIME_S

    def look(self, watched: Watched) -> None:
        """Look at everything."""
        self._looked_s = watched.time_s
        alarms: list[Alarm] = []
        flying = watched.flying
        for watch in self._watches:
            text = watch.find(watched) if flying or not watch.flying_only else ""
            if text or watch.lasts:  # hardly ever
                alarm = watch.update(watched.time_s, text)
                if alarm is not None:
                    alarms.append(alarm)
        self.alarms = tuple(alarms)
