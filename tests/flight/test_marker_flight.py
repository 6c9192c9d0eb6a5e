"""Missions that hang on a marker, flown by the simulated vehicle with the filter and sightings made from the truth."""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from tests.flight.test_marker_frame import page
from uasfly.drivers.plan import build_pilot, load_plan
from uasfly.flight.choices import Engage
from uasfly.flight.pilot import Pilot
from uasfly.frames import (
    quaternion_from_rotation_vector,
    quaternion_inverse,
    quaternion_product,
    rotation_matrix,
)
from uasfly.link.in_process import InProcessLink
from uasfly.messages import Array, MarkerSample, Phase, TruthSample
from uasfly.sim.vehicle import SimulatedVehicle

PERIOD_S = 0.02
EVERY = 2  # cycles between two frames
LATENCY_S = 0.07
FIELD_OF_VIEW_RAD = math.radians(35.0)  # to each side
FARTHEST_M = 9.0
SIGMA_M, SIGMA_RAD = 0.01, math.radians(1.0)
COVARIANCE = np.diag((SIGMA_M**2,) * 3 + (SIGMA_RAD**2,) * 3)
BEHIND = np.array((-5.5, 1.5, 1.6)), page(-0.2, 0.05)  # place and page: the vehicle looks east
AHEAD = np.array((5.5, 1.0, 1.6)), page(math.pi - 0.1, 0.0)


@dataclass
class Board:
    """A board that is seen by a camera that looks ahead."""

    position: Array
    quaternion: Array
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(4))

    def seen(self, truth: TruthSample) -> MarkerSample | None:
        """The sighting from where the vehicle truly is."""
        inverse = quaternion_inverse(truth.quaternion_body_to_world)
        way = rotation_matrix(truth.quaternion_body_to_world).T @ (self.position - truth.position_in_world)
        if abs(math.atan2(way[1], way[0])) > FIELD_OF_VIEW_RAD or np.linalg.norm(way) > FARTHEST_M:
            return None
        turn = quaternion_from_rotation_vector(SIGMA_RAD * self.rng.standard_normal(3))
        quaternion = quaternion_product(quaternion_product(inverse, self.quaternion), turn)
        return MarkerSample(truth.time_s, 0, way + SIGMA_M * self.rng.standard_normal(3), quaternion, COVARIANCE)


@dataclass
class Told:
    """What a flight leaves behind."""

    pilot: Pilot
    truths: list[TruthSample] = field(default_factory=list)
    texts: list[tuple[float, str]] = field(default_factory=list)

    def when(self, text: str) -> float:
        """Time of the first announcement that holds this text."""
        return next(time_s for time_s, said in self.texts if text in said)


def fly(board: Board, settings: list[str], each: Callable[[float], None] = lambda _t: None) -> Told:
    """The shipped stand-off with other settings, by the backup PIDs (the solver is slow and not what is looked at)."""
    plan = load_plan("marker_standoff", "f550", controller="pid", scenario="calm", seed=2, settings=settings)
    assert plan.plant is not None
    assert plan.scenario is not None
    vehicle = SimulatedVehicle(plan.plant, plan.scenario, plan.seed)
    link = InProcessLink(vehicle, 0.005, 0.005, 0.002, np.random.default_rng(7))
    told = Told(build_pilot(plan, Engage.AUTO, None, late_counts=False))
    frames: list[tuple[float, int, MarkerSample]] = []
    for cycle in range(1, 7000):
        now_s = cycle * PERIOD_S
        link.advance_to(now_s)
        each(now_s)
        truth = link.truth()
        if cycle % EVERY == 0 and (sample := board.seen(truth)) is not None:
            heapq.heappush(frames, (now_s + LATENCY_S, cycle, sample))
        arrived = []
        while frames and frames[0][0] <= now_s:
            arrived.append(heapq.heappop(frames)[2])
        result = told.pilot.step(now_s, (*link.poll(), *arrived))
        if result.setpoint is not None:
            link.send(result.setpoint)
        for request in result.requests:
            link.request(request)
        told.texts += [(now_s, text) for _, text in result.status.announcements]
        if result.status.phase is Phase.LEGS:
            told.truths.append(truth)
        elif told.truths:
            break
    return told


def standoff(place: Array, quaternion: Array) -> Array:
    """(3,) m: where the mission wants to be."""
    out = rotation_matrix(quaternion)[:, 2]
    heading = math.atan2(out[1], out[0])
    return np.asarray(place + np.array((4.2 * math.cos(heading), 4.2 * math.sin(heading), 0.2)))


def test_it_searches_finds_and_flies_off_a_board_that_was_in_its_back() -> None:
    """To 4.2 m in front of it and 0.2 m above, facing it; truly, not by its own estimate."""
    told = fly(Board(*BEHIND), ["mission.legs[0].duration_s=8"])
    assert told.pilot.sequencer.reason == ""
    assert told.pilot.sequencer.phase is Phase.ENDING
    assert told.when("turning at 15 deg/s") < told.when("the marker is known: it stands")
    last = [truth for truth in told.truths if truth.time_s > told.truths[-1].time_s - 5.0]
    errors = np.array([truth.position_in_world - standoff(*BEHIND) for truth in last])
    assert np.sqrt((errors**2).sum(axis=1).mean()) < 0.1
    way = BEHIND[0] - last[-1].position_in_world
    nose = rotation_matrix(last[-1].quaternion_body_to_world)[:, 0]
    assert nose @ way / np.linalg.norm(way) > math.cos(math.radians(5.0))


def test_a_board_that_is_moved_in_flight_is_noticed_within_two_seconds_and_not_flown_after() -> None:
    """Half a metre to the side, at the stand-off: told, held as lost, ended; the vehicle stays where it was."""
    board, moved_s = Board(*AHEAD), 25.0

    def each(now_s: float) -> None:
        board.position = AHEAD[0] + (0.0, 0.5 if now_s > moved_s else 0.0, 0.0)

    told = fly(board, ["mission.monitors.longest_hold_s=4", "mission.legs[0].duration_s=60"], each)
    assert 0.0 < told.when("from where it was: it is not followed") - moved_s < 2.0
    assert "held for 4 s: the marker has not been seen" in told.pilot.sequencer.reason
    after = [truth for truth in told.truths if truth.time_s > moved_s]
    assert after[-1].time_s > moved_s + 8.0
    errors = np.linalg.norm([truth.position_in_world - standoff(*AHEAD) for truth in after], axis=1)
    assert errors.max() < 0.15
