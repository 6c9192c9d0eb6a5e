"""Where the flight is to be: the point to hold at, the mission from there, its pace, and taking it up again."""

from __future__ import annotations

import math

import numpy as np

from uasfly.airframe import Limits
from uasfly.frames import euler_from_quaternion, wrap_angle
from uasfly.message_class import message
from uasfly.messages import Action, Array, ReferenceHorizon, StateEstimate
from uasfly.mission import Mission
from uasfly.trajectories.crossfade import Crossfade
from uasfly.trajectories.feasibility import check_placed
from uasfly.trajectories.glide import Glide, glide_time_s
from uasfly.trajectories.hold import HoldTrajectory
from uasfly.trajectories.mission_trajectory import MissionTrajectory
from uasfly.trajectories.pacing import Pacing
from uasfly.trajectories.placement import Placement
from uasfly.trajectories.search import SearchTurn
from uasfly.trajectories.trajectory import TrajectoryError

HOLD_RADIUS_M = 0.2  # while the vehicle engages, the point to hold at follows it beyond this distance
HOLD_YAW_RAD = math.radians(10.0)  # and beyond this turn
PLAN_AFTER_S = 0.2  # held for so long, the mission is planned from there
TOO_FAR_M = 100.0  # from where the mission was left: nobody meant to take it up here
FADE_AHEAD_S = np.linspace(0.0, 5.0, 6)  # where the distance to a frame that lies elsewhere is looked at


@message
class Progress:
    """How far a mission has come.

    Attributes:
        leg: index of the one that the reference flies, -1 in transitions and outside.
        share: 0..1 of the mission's duration.
        pace: rate of the mission's time.
    """

    leg: int
    share: float
    pace: float


NOT_BEGUN = Progress(-1, 0.0, 0.0)


class Course:
    """References of one flight.

    Args:
        mission: what is flown.
        limits: of the airframe.

    Attributes:
        origin: (3,) m, world: what geofence and altitudes count from, once it is known; the mission's own origin
            except in the frame of a marker.
        problem: why the mission cannot be flown from here, "" while it can.
    """

    def __init__(self, mission: Mission, limits: Limits) -> None:
        self._mission = mission
        self._limits = limits
        self.origin: Array | None = None
        self.problem = ""
        self._marker_placement: Placement | None = None
        self._hold: HoldTrajectory | None = None
        self._search: SearchTurn | None = None  # instead of the hold, over the pacing's time
        self._hold_since_s = 0.0
        self._planned: MissionTrajectory | None = None  # starts where the vehicle holds while it engages
        self._trajectory: MissionTrajectory | None = None  # the planned one, once the legs have begun
        self._pacing = Pacing(0.0, 0.0, 0.0)
        self._frozen = False
        self._glide: Glide | None = None
        self._fade: Crossfade | None = None
        self._action = Action.NOTHING
        self._turned_back_s: float | None = None  # mission time at which the way back began

    @property
    def begun(self) -> bool:
        """Whether the legs have begun, be they held or frozen."""
        return self._trajectory is not None

    @property
    def placement(self) -> Placement | None:
        """Where the mission's frame lies; None while that is not known."""
        if self._mission.frame == "marker":
            return self._marker_placement
        return None if self.origin is None else Placement(self.origin)

    def drop(self) -> None:
        """Forget the mission's progress: it will begin anew."""
        self._hold = self._planned = self._trajectory = self._glide = None
        self._search = self._fade = self._marker_placement = None
        self._frozen, self._action, self._turned_back_s = False, Action.NOTHING, None

    def engage(self, time_s: float, estimate: StateEstimate) -> None:
        """Keep the point to hold at where the vehicle is, and the mission planned from there."""
        if self._hold is None or _strayed(self._hold, estimate):
            self.hold_here(time_s, estimate)
        held = time_s - self._hold_since_s >= PLAN_AFTER_S
        if not self.begun and self._planned is None and held and self.placement is not None:
            self._plan()  # some tens of milliseconds of work, done while PX4 still flies the vehicle by itself

    def hold_here(self, time_s: float, estimate: StateEstimate) -> None:
        """Hold where the vehicle is now."""
        _, _, yaw = euler_from_quaternion(estimate.quaternion_body_to_world)
        self._hold, self._hold_since_s = HoldTrajectory(estimate.position_in_world, yaw), time_s
        self._planned = self._search = None

    def place(self, placement: Placement | None) -> None:
        """Hang the mission, which has not begun, on a marker; None where it is not known well enough any more."""
        self._marker_placement, self._planned = placement, None

    def stay(self, time_s: float, estimate: StateEstimate) -> None:
        """The mission is over: stay here."""
        self._trajectory = None
        self.hold_here(time_s, estimate)

    def start(self, time_s: float, estimate: StateEstimate) -> None:
        """Begin the mission, gliding from where the vehicle is; hold here while nobody knows where its frame lies."""
        if self.placement is None:
            self.hold_here(time_s, estimate)
            return
        if self._hold is None or _strayed(self._hold, estimate):
            self.hold_here(time_s, estimate)
        if self._planned is None:
            self._plan()
        self._trajectory, self._frozen = self._planned, False
        self._pacing = Pacing(time_s, 0.0, 1.0)
        self._glide_in(time_s, estimate)

    def search(self, time_s: float, rate_rad_s: float) -> None:
        """While the mission has not begun: turn in place at a rate, or come to rest with a rate of 0."""
        if self._search is None:
            if rate_rad_s == 0.0 or self._hold is None:
                return
            self._search = SearchTurn(self._hold.position_in_world, self._hold.yaw_rad, rate_rad_s)
            self._pacing = Pacing(time_s, 0.0, 0.0)
        self._pacing.change(time_s, 1.0 if rate_rad_s else 0.0)

    def at_rest(self, time_s: float) -> bool:
        """Whether the search does not turn."""
        return self._search is None or (self._pacing.target == 0.0 and self._pacing.pace(time_s) == 0.0)

    def begin(self, time_s: float) -> None:
        """Begin the mission from the point that is held at, at rest: the reference goes on from where it is."""
        assert self._hold is not None
        if self._search is not None:
            yaw = self._search.yaw_at(self._pacing.mission_time_s(time_s))
            self._hold, self._search = HoldTrajectory(self._hold.position_in_world, yaw), None
        self._plan()
        self._trajectory, self._frozen, self._glide = self._planned, False, None
        self._pacing = Pacing(time_s, 0.0, 1.0)

    def reanchor(self, time_s: float, placement: Placement) -> bool:
        """Hang the mission, which has begun, elsewhere, without a step; False where it has to wait for the last time.

        The heading must be the one of the equal headings that is nearest to the present one.
        """
        assert self._trajectory is not None
        if self._fade is not None and time_s < self._fade.end_s:
            return False
        old, new = self._trajectory, self._trajectory.reanchored(placement)
        if not self._frozen:
            here, there = (self._pacing.onto(way, time_s + FADE_AHEAD_S) for way in (old, new))
            ways = here.position_in_world - there.position_in_world
            way = ways[int(np.argmax(np.linalg.norm(ways, axis=1)))]
            turn = float(here.yaw_rad[0] - there.yaw_rad[0])
            self._fade = Crossfade(old, time_s, glide_time_s(way, turn, self._mission.transition, self._limits))
        self._trajectory, self._marker_placement = new, placement
        return True

    def freeze(self, time_s: float) -> None:
        """Nobody follows the reference from `time_s` on: the mission's time stands."""
        if not self._frozen and self._trajectory is not None:
            self._pacing = Pacing(time_s, self._clipped(self._pacing.mission_time_s(time_s)), 0.0)
            self._frozen, self._glide, self._fade, self._turned_back_s = True, None, None, None

    def take_up(self, time_s: float, estimate: StateEstimate) -> None:
        """Go on with a frozen mission: back to where it was left, straight and from rest to rest, then on."""
        assert self._trajectory is not None
        self._frozen = False
        self._glide_in(time_s, estimate)
        assert self._glide is not None
        if float(np.linalg.norm(self._glide.offset_m)) > TOO_FAR_M:
            self.problem = f"more than {TOO_FAR_M:.0f} m away from where the mission was left"

    def act(self, time_s: float, action: Action, slow_pace: float, back_off_m: float) -> None:
        """Let the pace follow what the monitors want; call it each cycle while the legs fly."""
        if self._trajectory is None or self._frozen:
            return
        if action is not Action.BACK_OFF:
            self._turned_back_s = None
        match action:
            case Action.HOLD:
                pace = 0.0
            case Action.SLOW_DOWN:
                pace = slow_pace
            case Action.BACK_OFF:
                pace = -slow_pace if self._way_back_left(time_s, back_off_m) else 0.0
            case _:
                pace = 1.0
        if self._glide is not None:
            if time_s >= self._glide.start_s + self._glide.duration_s:
                self._glide = None  # it has faded out
            elif self._pacing.target == 0.0 and pace > 0.0:
                return  # on the way back to where the mission was left
        self._pacing.change(time_s, pace)

    def at(self, times_s: Array) -> ReferenceHorizon:
        """Reference at absolute times (n,) [s, host], in the world frame."""
        if self._trajectory is not None:
            reference = self._pacing.onto(self._trajectory, times_s)
            if self._fade is not None and float(times_s[0]) < self._fade.end_s:
                reference = self._fade.between(self._pacing.onto(self._fade.old, times_s), reference)
            return reference if self._glide is None else self._glide.onto(reference)
        if self._search is not None:
            return self._pacing.onto(self._search, times_s)
        assert self._hold is not None
        return self._hold.sample(times_s)

    def place_at(self, time_s: float) -> Array:
        """Where the reference is at one time: (3,) m, world."""
        if self._trajectory is None:
            assert self._hold is not None
            return self._hold.position_in_world
        mission_s = self._mission_s(time_s)
        place = self._trajectory.position_at(mission_s)
        if self._fade is not None and time_s < self._fade.end_s:
            place = self._fade.place(time_s, self._fade.old.position_at(mission_s), place)
        if self._glide is None:
            return np.array(place)
        return np.array([p + offset for p, offset in zip(place, self._glide.offset_at(time_s), strict=True)])

    def done(self, time_s: float) -> bool:
        """Whether the reference has come to its end."""
        return self._trajectory is not None and self._mission_s(time_s) >= self._trajectory.duration_s

    def progress(self, time_s: float) -> Progress:
        """How far the mission has come."""
        trajectory = self._trajectory
        if trajectory is None:
            return NOT_BEGUN
        mission_s, pace = self._pacing.at(time_s)
        leg = trajectory.leg_at(mission_s) if trajectory.in_leg(mission_s) else -1
        return Progress(leg, min(1.0, max(0.0, mission_s / trajectory.duration_s)), pace)

    def _mission_s(self, time_s: float) -> float:
        return self._pacing.mission_time_s(time_s)

    def _clipped(self, mission_s: float) -> float:
        assert self._trajectory is not None
        return min(max(mission_s, 0.0), self._trajectory.duration_s)

    def _plan(self) -> None:
        assert self._hold is not None
        assert self.origin is not None
        try:
            planned = MissionTrajectory(
                self._mission,
                self._limits,
                start_position=self._hold.position_in_world,
                start_yaw=self._hold.yaw_rad,
                placement=self.placement,
            )
        except TrajectoryError as error:
            self.problem = f"the mission cannot be flown from here: {error}"
            return
        if self._mission.frame == "marker":  # nobody could check it before
            findings = check_placed(self._mission, planned, self.origin)
            if findings:
                self.problem = f"the mission cannot be flown from here: {findings[0].field}: {findings[0].text}"
                return
        self._planned = planned

    def _glide_in(self, time_s: float, estimate: StateEstimate) -> None:
        """Fade out what lies between the vehicle and the reference."""
        self._glide = None
        if self._trajectory is None:
            return
        now = self.at(np.array([time_s]))
        _, _, yaw = euler_from_quaternion(estimate.quaternion_body_to_world)
        offset = estimate.position_in_world - now.position_in_world[0]
        turn = wrap_angle(yaw - float(now.yaw_rad[0]))
        self._glide = Glide(offset, turn, time_s, glide_time_s(offset, turn, self._mission.transition, self._limits))

    def _way_back_left(self, time_s: float, back_off_m: float) -> bool:
        """Whether there is still way to go back."""
        assert self._trajectory is not None
        now_s = self._mission_s(time_s)
        if self._turned_back_s is None:
            self._turned_back_s = now_s
        if now_s <= 0.0:
            return False
        here, there = self._trajectory.sample(np.array([now_s, self._turned_back_s])).position_in_world
        return float(np.linalg.norm(here - there)) < back_off_m


def _strayed(hold: HoldTrajectory, estimate: StateEstimate) -> bool:
    way = estimate.position_in_world - hold.position_in_world
    _, _, yaw = euler_from_quaternion(estimate.quaternion_body_to_world)
    return float(way @ way) > HOLD_RADIUS_M**2 or abs(wrap_angle(yaw - hold.yaw_rad)) > HOLD_YAW_RAD
