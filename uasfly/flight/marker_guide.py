"""Where a mission that hangs on a marker lies: waits for the marker, places the mission, and follows its refinement."""

from __future__ import annotations

import math
from typing import Protocol

from uasfly.flight.course import Course
from uasfly.flight.marker_frame import level_frame, lies_flat
from uasfly.marker_settings import MarkerSettings
from uasfly.messages import Alarm, Array
from uasfly.observer.sightings import MarkerEstimate
from uasfly.trajectories.placement import Placement

FRESH_S = 1.0  # an older sighting is not what a mission is planned by, or moved by
SEEN_S = 0.5  # the search comes to rest where there is a sighting that is younger
STEADY_S = 0.5  # it must be known for so long
SIGMA_M = 0.1  # as well as this,
HEADING_SIGMA_RAD = math.radians(2.0)  # and this
MOVED_M = 0.05  # a smaller difference to the filter leaves the mission where it hangs
TURNED_RAD = math.radians(1.0)
MONITOR = "marker_moved"


class Markers(Protocol):
    """What is asked of the observer."""

    def marker(self, time_s: float, marker_id: int | None = None) -> MarkerEstimate | None:
        """A marker as the filter has it."""
        ...

    def trust(self, marker_id: int, trusted: bool) -> None:
        """Whether its sightings are used."""
        ...

    def forget(self, marker_id: int) -> None:
        """Have the next sighting be the first."""
        ...


class MarkerGuide:
    """Follows one marker for one mission.

    Args:
        settings: of the mission.
        marker_id: the bundle's number in the sightings; without it the first marker that the filter knows.
        yaw_rate_rad_s: highest of the airframe.

    Attributes:
        marker: as the filter has it in this cycle, None while it is not there.
        announcements: new texts with their MAVLink severity, cleared by the reader.
    """

    def __init__(self, settings: MarkerSettings, marker_id: int | None, yaw_rate_rad_s: float) -> None:
        self.marker: MarkerEstimate | None = None
        self.announcements: list[tuple[int, str]] = []
        self._until_seen = settings.until_seen
        self._rate_rad_s = min(settings.until_seen.turn_rate_rad_s, yaw_rate_rad_s)
        self._id = marker_id
        self._time_s = -math.inf
        self._known_since_s: float | None = None
        self._waiting_since_s: float | None = None
        self._flat = False
        self._distrusted = False

    def look(self, time_s: float, markers: Markers) -> None:
        """Take the marker of this cycle."""
        self.marker, self._time_s = markers.marker(time_s, self._id), time_s
        if not self._well_known():
            self._known_since_s = None
        elif self._known_since_s is None:
            self._known_since_s = time_s

    @property
    def age_s(self) -> float:
        """Age of the last sighting that was accepted; NaN where there is none."""
        return math.nan if self.marker is None else self._time_s - self.marker.seen_s

    def judge(self, markers: Markers, alarms: tuple[Alarm, ...], begun: bool) -> None:
        """A marker that was moved: before the mission begins it is taken anew, afterwards it is no guide any more."""
        moved = any(alarm.monitor == MONITOR for alarm in alarms)
        if self.marker is None:
            return
        anew = moved and not begun
        if anew:
            markers.forget(self.marker.marker_id)
        if self._distrusted is not (moved and begun):
            self._distrusted = moved and begun
            markers.trust(self.marker.marker_id, not self._distrusted)
        if anew:
            self.marker = None

    def place(self, course: Course) -> None:
        """Hang the course on the marker; call it in each cycle in which it may fly soon, or flies."""
        if not course.begun:
            if not self._steady:
                if course.placement is not None:
                    course.place(None)
            elif course.placement is None:
                self._hang(course)
            return
        placed = course.placement
        assert placed is not None
        if not self._well_known():
            return
        found = self._found(placed.heading_rad)
        way = math.dist(found.origin.tolist(), placed.origin.tolist())
        turn = abs(found.heading_rad - placed.heading_rad)
        if (way > MOVED_M or turn > TURNED_RAD) and course.reanchor(self._time_s, found):
            text = f"the marker is {way * 100.0:.0f} cm and {math.degrees(turn):.1f} deg from where it was taken to be"
            self.announcements.append((5, f"{text}: gliding over"))

    def wait(self, course: Course) -> str:
        """While the legs fly but have nowhere to go: hold or search, and begin when it is known; "" or why no more."""
        now_s, until_seen = self._time_s, self._until_seen
        if self._waiting_since_s is None:
            self._waiting_since_s = now_s
            doing = f"turning at {math.degrees(self._rate_rad_s):.0f} deg/s" if self._searches else "holding"
            self.announcements.append((5, f"waiting for the marker: {doing}"))
        if self._steady and course.at_rest(now_s):
            course.begin(now_s)
            return ""
        if now_s - self._waiting_since_s > until_seen.timeout_s:
            return f"the marker was not {self._lacking()} within {until_seen.timeout_s:.0f} s"
        if self._searches:
            course.search(now_s, 0.0 if self.age_s < SEEN_S else self._rate_rad_s)
        return ""

    def stop_waiting(self) -> None:
        """Nobody flies by the marker now: waiting begins anew."""
        self._waiting_since_s = None

    @property
    def _searches(self) -> bool:
        return self._until_seen.action == "search"

    @property
    def _steady(self) -> bool:
        return self._known_since_s is not None and self._time_s - self._known_since_s >= STEADY_S

    def _well_known(self) -> bool:
        """Whether it has been seen just now, and well enough to fly by; False where a number is none."""
        marker = self.marker
        if marker is None or self._distrusted:
            return False
        known = marker.position_sigma_m < SIGMA_M and marker.heading_sigma_rad < HEADING_SIGMA_RAD
        return known and self._time_s - marker.seen_s < FRESH_S

    def _lacking(self) -> str:
        marker = self.marker
        if marker is None or not self.age_s < FRESH_S:
            return "seen"
        sigmas = f"{marker.position_sigma_m:.2f} m and {math.degrees(marker.heading_sigma_rad):.1f} deg"
        return f"known well enough ({sigmas})"

    def _hang(self, course: Course) -> None:
        marker = self.marker
        assert marker is not None
        self._flat = lies_flat(marker.quaternion_marker_to_world)
        course.place(self._found(0.0))
        how = "lies flat" if self._flat else "stands"
        self.announcements.append((5, f"the marker is known: it {how}"))

    def _found(self, near_rad: float) -> Placement:
        marker = self.marker
        assert marker is not None
        position: Array = marker.position_in_world
        return level_frame(position, marker.quaternion_marker_to_world, self._flat, near_rad)
