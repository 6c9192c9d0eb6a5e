"""Missions that hang on a marker, with a scripted vehicle and an observer that knows what a test tells it."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from tests.flight.test_marker_frame import page
from tests.flight.test_pilot import AIRBORNE, GROUND, PERIOD_S, FakeObserver, Flight
from uasfly.flight.choices import Engage
from uasfly.messages import Action, FlightMode, Phase, RequestKind
from uasfly.mission import Mission
from uasfly.observer.sightings import Contradiction, MarkerEstimate

BOARD = GROUND + np.array((6.0, 0.0, 1.8))
FACING = math.pi - 1e-3  # west, towards the take-off
STANDOFF = BOARD + np.array((-4.2, 0.0, 0.2))
MOVED = Contradiction(1.0, 0.5, 0.0)


def mission(**changes: Any) -> Mission:
    """To the stand-off, and then 5 s there."""
    fields: dict[str, Any] = {
        "name": "off the board",
        "frame": "marker",
        "marker": {"bundle": "four_36h11", "until_seen": {"timeout_s": 20.0}},
        "takeoff": {"height_m": 1.5},
        "legs": [{"type": "hover", "position_m": [4.2, 0.0, 0.2], "duration_s": 20.0}],
        "yaw": {"rule": "facing", "point_m": [0.0, 0.0]},
        "limits": {"geofence": {"radius_m": 6.0}, "altitude_max_m": 5.0},
    }
    return Mission.model_validate({**fields, **changes})


class Spotter(FakeObserver):
    """An observer with a marker."""

    def __init__(self) -> None:
        super().__init__()
        self.seen = False
        self.seen_s = -math.inf
        self.place = BOARD.copy()
        self.facing_rad = FACING
        self.sigma_m = 0.01
        self.contradiction = Contradiction()
        self.trusted: list[tuple[int, bool]] = []
        self.forgotten: list[int] = []
        self.field_of_view_rad = math.inf

    def marker(self, time_s: float, marker_id: int | None = None) -> MarkerEstimate | None:
        """Where it is, if it has ever been seen."""
        way = self.place - self.position
        off = (math.atan2(way[1], way[0]) - self.yaw_rad + math.pi) % (2.0 * math.pi) - math.pi
        if self.seen and abs(off) < self.field_of_view_rad:
            self.seen_s = time_s
        if not math.isfinite(self.seen_s):
            return None
        quaternion = page(self.facing_rad, 0.1)
        return MarkerEstimate(7, self.place.copy(), quaternion, self.sigma_m, 0.005, self.seen_s, self.contradiction)

    def trust(self, marker_id: int, trusted: bool) -> None:
        """Remember."""
        self.trusted.append((marker_id, trusted))

    def forget(self, marker_id: int) -> None:
        """Remember, and do so."""
        self.forgotten.append(marker_id)
        self.seen_s, self.contradiction = -math.inf, Contradiction()


@dataclass
class _Point:
    position: np.ndarray
    velocity: np.ndarray
    yaw: float


class MarkerFlight(Flight):
    """A flight whose vehicle follows position and yaw exactly."""

    def __init__(self, flown: Mission | None = None, engage: Engage = Engage.AUTO, **spotted: Any) -> None:
        self.spotter = Spotter()
        super().__init__(flown or mission(), engage, self.spotter)
        for name, value in spotted.items():
            setattr(self.spotter, name, value)

    def step(self) -> Any:
        """One cycle; the nose follows too."""
        result = super().step()
        if self.follows and self.phase is Phase.LEGS and self.controller.references:
            self.spotter.yaw_rad = float(self.controller.references[-1].yaw_rad[0])
        return result

    def trace(self, since: int = 0) -> list[_Point]:
        """First points of the references."""
        return [
            _Point(r.position_in_world[0], r.velocity_in_world[0], float(r.yaw_rad[0]))
            for r in self.controller.references[since:]
        ]


def assert_smooth(points: list[_Point], speed: float = 1.0, yaw_rate: float = 1.6, acceleration: float = 1.5) -> None:
    """No step in position, velocity and yaw from one cycle to the next."""
    for before, after in itertools.pairwise(points):
        assert np.linalg.norm(after.position - before.position) < speed * PERIOD_S
        assert np.linalg.norm(after.velocity - before.velocity) < acceleration * PERIOD_S
        assert abs(after.yaw - before.yaw) < yaw_rate * PERIOD_S


def test_a_marker_in_sight_is_flown_to_without_waiting() -> None:
    """Known before offboard, planned while PX4 still holds, and then 4.2 m off and 0.2 m up, facing it."""
    flight = MarkerFlight(seen=True)
    flight.until(Phase.LEGS)
    assert not any("waiting" in text for text in flight.texts)
    assert any("the marker is known: it stands" in text for text in flight.texts)
    assert flight.steps[-1].status.marker_age_s == 0.0
    flight.until(Phase.ENDING)
    np.testing.assert_allclose(flight.spotter.position, STANDOFF, atol=0.01)
    assert math.cos(flight.spotter.yaw_rad) == pytest.approx(1.0, abs=1e-4)
    assert_smooth(flight.trace())


def test_until_it_is_seen_it_holds_in_offboard_and_then_flies() -> None:
    """The reference stays where the vehicle is and goes on from there, without a step, when the marker is known."""
    flight = MarkerFlight()
    flight.until(Phase.LEGS)
    flight.run(5.0)
    assert any("waiting for the marker: holding" in text for text in flight.texts)
    status = flight.steps[-1].status
    assert (status.leg, status.leg_started, math.isnan(status.marker_age_s)) == (-1, False, True)
    assert status.waits_for == "the marker"
    np.testing.assert_allclose(flight.spotter.position, GROUND + AIRBORNE)
    flight.spotter.seen = True
    flight.run(0.4)
    np.testing.assert_allclose(flight.spotter.position, GROUND + AIRBORNE)  # not long enough yet
    flight.run(0.3)
    assert flight.pilot.course.begun
    assert flight.steps[-1].status.waits_for == ""
    flight.until(Phase.ENDING)
    np.testing.assert_allclose(flight.spotter.position, STANDOFF, atol=0.01)
    assert_smooth(flight.trace())


@pytest.mark.parametrize("sigma_m", [0.5, math.nan])
def test_a_marker_that_is_hardly_known_is_not_flown_by(sigma_m: float) -> None:
    """What is known of it is told when the patience is over."""
    flight = MarkerFlight(seen=True, sigma_m=sigma_m)
    flight.until(Phase.ABORTED)
    assert "the marker was not known well enough" in flight.pilot.sequencer.reason


@pytest.mark.parametrize(("then", "asked"), [("end", RequestKind.HOLD), ("land", RequestKind.LAND)])
def test_a_marker_that_never_comes_ends_the_mission_as_the_file_says(then: str, asked: RequestKind) -> None:
    """After the time-out, from being in offboard; the mission's ending is a hold here."""
    block = {"bundle": "four_36h11", "until_seen": {"timeout_s": 6.0, "then": then}}
    flight = MarkerFlight(mission(marker=block, ending={"action": "hold"}))
    flight.until(Phase.LEGS)
    begun = len(flight.steps)
    flight.until(Phase.ABORTED)
    assert 6.0 < (len(flight.steps) - begun) * PERIOD_S < 9.0
    assert "the marker was not seen within 6 s" in flight.pilot.sequencer.reason
    assert flight.asked[-1] is asked


def test_a_time_out_can_hand_over() -> None:
    """At once, with the request that the vehicle hold."""
    block = {"bundle": "four_36h11", "until_seen": {"timeout_s": 2.0, "then": "hand_over"}}
    flight = MarkerFlight(mission(marker=block))
    flight.until(Phase.ABORTED)
    assert flight.pilot.sequencer.hand_over


def test_a_search_turns_in_place_until_it_is_seen_and_comes_to_rest() -> None:
    """Smoothly to its rate and back, no faster; the mission goes on from the heading where it came to rest."""
    block = {"bundle": "four_36h11", "until_seen": {"action": "search", "turn_rate_deg_s": 30.0, "timeout_s": 60.0}}
    flight = MarkerFlight(mission(marker=block), seen=True, field_of_view_rad=0.6, yaw_rad=1.5)
    flight.until(Phase.LEGS)
    assert not flight.pilot.course.begun
    first = len(flight.controller.references)
    for _ in range(3000):
        flight.step()
        if flight.pilot.course.begun:
            break
    turning = flight.trace(first)
    rates = np.diff([point.yaw for point in turning]) / PERIOD_S
    assert math.degrees(rates.max()) == pytest.approx(30.0, abs=0.1)
    assert rates.min() > -1e-9
    assert np.abs(np.diff(rates)).max() < math.radians(30.0) * PERIOD_S * 1.2
    assert math.degrees(turning[-1].yaw) - 360.0 == pytest.approx(0.0, abs=35.0)
    np.testing.assert_allclose([point.position for point in turning], np.tile(GROUND + AIRBORNE, (len(turning), 1)))
    flight.until(Phase.ENDING)
    np.testing.assert_allclose(flight.spotter.position, STANDOFF, atol=0.01)
    assert_smooth(flight.trace(first))


def test_a_search_that_is_taken_over_and_given_back_waits_anew() -> None:
    """The pilot flies it elsewhere; it searches on from there, with all of its time."""
    block = {"bundle": "four_36h11", "until_seen": {"action": "search", "timeout_s": 10.0}}
    flight = MarkerFlight(mission(marker=block))
    flight.until(Phase.LEGS)
    flight.run(8.0)
    flight.mode = FlightMode.POSITION
    flight.run(4.0)
    engaging = flight.phase
    assert engaging is Phase.ENGAGE
    flight.spotter.position = flight.spotter.position + np.array((1.0, 0.0, 0.0))
    flight.run(1.0)
    flight.mode = FlightMode.OFFBOARD
    flight.run(8.0)
    assert flight.phase is Phase.LEGS
    np.testing.assert_allclose(flight.spotter.position, GROUND + AIRBORNE + (1.0, 0.0, 0.0), atol=1e-6)
    flight.spotter.seen = True
    flight.until(Phase.ENDING)
    np.testing.assert_allclose(flight.spotter.position, STANDOFF, atol=0.01)


def test_a_refined_marker_moves_the_mission_without_a_step() -> None:
    """Across the seam of its heading, in flight round a circle; a small change is left alone."""
    legs = [{"type": "circle", "center_m": [4.2, 0.0], "radius_m": 1.0, "height_m": 0.2, "speed_m_s": 0.5, "turns": 2}]
    flight = MarkerFlight(mission(legs=legs), seen=True)
    flight.until(Phase.LEGS)
    flight.run(12.0)
    flight.spotter.place = BOARD + np.array((0.0, 0.03, 0.0))
    flight.run(0.1)
    assert not any("gliding over" in text for text in flight.texts)
    flight.spotter.place = BOARD + np.array((0.3, 0.2, -0.1))
    flight.spotter.facing_rad = -math.pi + 0.1
    flight.run(8.0)
    assert sum("gliding over" in text for text in flight.texts) == 1
    turned = flight.spotter.facing_rad
    flight.until(Phase.ENDING)
    center = flight.spotter.place + 4.2 * np.array((math.cos(turned), math.sin(turned), 0.0)) + (0.0, 0.0, 0.2)
    way = flight.spotter.position - center
    assert np.hypot(*way[:2]) == pytest.approx(1.0, abs=1e-3)
    assert way[2] == pytest.approx(0.0, abs=1e-6)
    assert_smooth(flight.trace(), acceleration=3.0)


def test_status_and_reference_agree_while_it_is_moved() -> None:
    """The scalar path of the status is the horizon's first point."""
    flight = MarkerFlight(seen=True)
    flight.until(Phase.LEGS)
    flight.run(3.0)
    flight.spotter.place = BOARD + np.array((0.3, 0.2, -0.1))
    for _ in range(200):
        status = flight.step().status
        reference = flight.controller.references[-1].position_in_world[0]
        np.testing.assert_allclose(status.reference_position_in_world, reference, atol=1e-9)


def test_a_lost_marker_holds_the_mission_until_it_is_back() -> None:
    """After 5 s; what was seen before it was lost stays in use, and it is told."""
    flight = MarkerFlight(seen=True)
    flight.until(Phase.LEGS)
    flight.run(3.0)
    flight.spotter.seen = False
    flight.run(4.8)
    undisturbed = flight.steps[-1].status
    assert undisturbed.action is Action.NOTHING
    flight.run(2.2)
    assert flight.steps[-1].status.action is Action.HOLD
    assert any("the marker has not been seen for 5 s: holding" in text for text in flight.texts)
    assert flight.steps[-1].status.marker_age_s == pytest.approx(7.0, abs=0.1)
    flight.spotter.seen = True
    flight.until(Phase.ENDING)
    assert any("marker lost: over" in text for text in flight.texts)
    np.testing.assert_allclose(flight.spotter.position, STANDOFF, atol=0.01)


def test_a_marker_that_stays_lost_ends_the_mission_or_is_flown_without() -> None:
    """Held for so long, it ends; with the action warn it flies on by GNSS and model to its end."""
    ended = MarkerFlight(mission(monitors={"longest_hold_s": 5.0}), seen=True)
    told = MarkerFlight(mission(monitors={"marker_lost": {"action": "warn"}}), seen=True)
    for flight in (ended, told):
        flight.until(Phase.LEGS)
        flight.run(3.0)
        flight.spotter.seen = False
        flight.until(Phase.ENDING)
    assert "held for 5 s: the marker has not been seen" in ended.pilot.sequencer.reason
    assert told.pilot.sequencer.reason == ""
    np.testing.assert_allclose(told.spotter.position, STANDOFF, atol=0.01)


def test_a_marker_that_was_moved_is_not_flown_after() -> None:
    """Noticed within two seconds, told, not trusted any more; back where it was it is trusted again."""
    flight = MarkerFlight(seen=True)
    flight.until(Phase.LEGS)
    flight.run(10.0)
    there = flight.spotter.position.copy()
    flight.spotter.contradiction = MOVED
    flight.run(1.0)
    assert flight.spotter.trusted == [(7, False)]
    assert any("the marker is seen 0.50 m and 0 deg from where it was: it is not followed" in t for t in flight.texts)
    flight.spotter.place = BOARD + np.array((0.0, 0.5, 0.0))  # even if the filter fell for it
    flight.spotter.contradiction = Contradiction(0.0, 0.2, 0.0)  # and its gate has opened
    flight.run(4.0)
    np.testing.assert_allclose(flight.spotter.position, there, atol=0.01)
    flight.spotter.place, flight.spotter.contradiction = BOARD.copy(), Contradiction(0.0, 0.02, 0.0)
    flight.run(3.0)
    assert flight.spotter.trusted == [(7, False), (7, True)]
    assert flight.phase is Phase.LEGS
    assert flight.spotter.forgotten == []


def test_a_board_that_is_carried_about_before_the_flight_is_taken_anew() -> None:
    """On the ground nothing hangs on it: the next sighting is the first."""
    flight = MarkerFlight(seen=True, contradiction=MOVED)
    flight.until(Phase.LEGS)
    assert flight.spotter.forgotten
    assert flight.spotter.trusted == []
    flight.until(Phase.ENDING)
    np.testing.assert_allclose(flight.spotter.position, STANDOFF, atol=0.01)


def test_a_marker_outside_of_the_fence_is_not_flown_to() -> None:
    """Nobody could check that before it was seen; the fence is around the take-off."""
    flight = MarkerFlight(seen=True, place=BOARD + np.array((9.0, 0.0, 0.0)))
    flight.until(Phase.ABORTED)
    assert "cannot be flown from here: limits.geofence.radius_m" in flight.pilot.sequencer.reason
    low = MarkerFlight(seen=True, place=BOARD - np.array((0.0, 0.0, 1.8)))
    low.until(Phase.ABORTED)
    assert "limits.altitude_min_m" in low.pilot.sequencer.reason


def test_a_silence_while_it_waits_is_survived() -> None:
    """It holds where it is found again, and flies when the marker comes."""
    block = {"bundle": "four_36h11", "until_seen": {"action": "search", "timeout_s": 30.0}}
    flight = MarkerFlight(mission(marker=block))
    flight.until(Phase.LEGS)
    flight.run(3.0)
    flight.silent = True
    flight.run(1.0)
    flight.silent = False
    flight.run(1.0)
    assert flight.phase is Phase.LEGS
    flight.spotter.seen = True
    flight.until(Phase.ENDING)
    np.testing.assert_allclose(flight.spotter.position, STANDOFF, atol=0.01)


def test_missions_without_a_marker_have_no_age_of_one() -> None:
    """And nobody asks the observer, who here could not answer."""
    flight = Flight()
    flight.until(Phase.LEGS)
    assert math.isnan(flight.steps[-1].status.marker_age_s)
