"""The recorded flight flown again: the same commands and pauses, the same answers and modes."""

import math
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import development as dialect

from tests.sim_mavlink.bench import Bench
from tests.sim_mavlink.recording import Events, conformance_events
from uasfly.files import find_file, load_file
from uasfly.frames import swap_quaternion_enu_ned
from uasfly.sim.plant import Plant
from uasfly.sim.scenario import Scenario
from uasfly.sim.vehicle import SimulatedVehicle

BOOT_S = 4.1  # the recording begins that long after PX4's boot
TURN_S = 0.1
SETPOINTS = (
    ("stream level, then offboard", "setpoints stop for 6 s"),
    ("setpoints resume", "gps off for 12 s in hold"),
)
HOVER_THRUST = 0.4905
MODE_TIME_TOLERANCE_S = 2.0  # heartbeats come once a second; take-off and landing take their own time


class Replay:
    """Plays the events of a recording to a bench and notes what comes back, ten times a second."""

    def __init__(self, events: Events, bench: Bench) -> None:
        self.bench = bench
        self.events = events
        self.answers: list[tuple[int, int]] = []
        self.modes: list[tuple[float, int, int, bool]] = []
        self.heartbeats: list[tuple[int, int, int]] = []
        self.landed: list[int] = []
        self.accuracy_m: list[tuple[float, float]] = []
        self.time_s = 0.0

    def fly(self) -> None:
        """The whole recording."""
        streams = [(self.events.phase(first)[0], self.events.phase(last)[0]) for first, last in SETPOINTS]
        for event in self.events.lines:
            while self.time_s < event["t_s"]:
                self._turn(any(begin <= self.time_s < end for begin, end in streams))
            self._play(event)

    def _turn(self, with_setpoint: bool) -> None:
        vehicle = self.bench.vehicle
        self.time_s += TURN_S
        vehicle.advance_to(BOOT_S + self.time_s)
        if with_setpoint:
            self.bench.ask(self._level_at_three_metres())
        for message in self.bench.endpoint.poll():
            if message.get_type() == "HEARTBEAT":
                self._note_mode(message)
            elif message.get_type() == "EXTENDED_SYS_STATE":
                _note(self.landed, message.landed_state)
            elif message.get_type() == "ESTIMATOR_STATUS":
                self.accuracy_m.append((self.time_s, message.pos_horiz_accuracy))

    def _level_at_three_metres(self) -> Any:
        truth = self.bench.vehicle.truth()
        thrust = HOVER_THRUST + 0.08 * (3.0 - truth.position_in_world[2]) - 0.08 * truth.velocity_in_world[2]
        level = tuple(swap_quaternion_enu_ned(np.array((math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)))))
        return dialect.MAVLink_set_attitude_target_message(0, 6, 1, 7, level, 0, 0, 0, float(thrust))

    def _note_mode(self, heartbeat: Any) -> None:
        _note(self.heartbeats, (heartbeat.base_mode, heartbeat.custom_mode, heartbeat.system_status))
        mode = heartbeat.custom_mode >> 16 & 0xFF, heartbeat.custom_mode >> 24, bool(heartbeat.base_mode & 128)
        if not self.modes or self.modes[-1][1:] != mode:
            self.modes.append((self.time_s, *mode))

    def _play(self, event: dict[str, Any]) -> None:
        if event["event"] == "command":
            for answer in self.bench.command(event["command"], *event["params"], target=(6, 1)):
                if answer.get_type() == "COMMAND_ACK":
                    self.answers.append((answer.command, answer.result))
        elif event["event"] == "param_set":
            (value,) = self.bench.ask(
                dialect.MAVLink_param_set_message(6, 1, event["name"].encode(), event["value"], 9)
            )
            assert value.param_value == event["value"]


def _note(values: list[Any], value: Any) -> None:
    if not values or values[-1] != value:
        values.append(value)


@pytest.fixture(scope="module")
def replay() -> Replay:
    """The recorded flight, flown again by the simulated vehicle."""
    events = conformance_events()
    plant = load_file(find_file("plant", "px4_sih"), Plant)
    scenario = load_file(find_file("scenario", "calm"), Scenario)
    vehicle = SimulatedVehicle(plant, scenario, 1, start_yaw_rad=math.pi / 2)
    replay = Replay(events, Bench(6, client=(245, 191), vehicle=vehicle))
    vehicle.advance_to(BOOT_S)
    replay.fly()
    return replay


def test_commands_have_the_recorded_results(replay: Replay) -> None:
    """Requests, intervals, modes on the ground and in flight, arming, injected failures."""
    lines = replay.events.lines
    expected = [(event["command"], event["result"]) for event in lines if event["event"] == "ack"]
    # COMPONENT_INFORMATION (395): PX4 serves its metadata, this vehicle has none to serve
    requested = [event["params"][0] for event in lines if event["event"] == "command"]
    expected[requested.index(395)] = (512, dialect.MAV_RESULT_DENIED)
    assert replay.answers == expected


def test_modes_follow_each_other_as_recorded(replay: Replay) -> None:
    """Take-off, loss and return of the stream, loss of GNSS, landing: same order, about the same times."""
    modes = (event for event in replay.events.lines if event["event"] == "mode")
    recorded = [(event["t_s"], event["main"], event["sub"], event["armed"]) for event in modes]
    assert [mode[1:] for mode in replay.modes] == [mode[1:] for mode in recorded]
    for (ours_s, *mode), (theirs_s, *_) in zip(replay.modes, recorded, strict=True):
        assert ours_s == pytest.approx(theirs_s, abs=MODE_TIME_TOLERANCE_S), mode


def test_heartbeats_say_what_px4_said(replay: Replay) -> None:
    """base_mode, custom_mode and system_status (3 standby, 4 active, 5 failsafe, 0 cannot be armed) as recorded."""
    hold, takeoff, offboard, land, descend = 50593792, 33816576, 393216, 100925440, 335806464
    assert replay.heartbeats == [
        (29, hold, 3),
        (1, offboard, 0),
        (29, hold, 3),
        (157, hold, 4),
        (157, takeoff, 4),
        (157, hold, 4),
        (145, offboard, 4),
        (157, hold, 5),
        (145, offboard, 4),
        (157, hold, 4),
        (157, descend, 5),
        (29, hold, 0),
        (29, hold, 3),
        (29, land, 0),
    ]


def test_landed_states_follow_each_other_as_recorded(replay: Replay) -> None:
    """On the ground, taking off, in the air, on the ground."""
    assert replay.landed == [1, 3, 2, 1]


def test_accuracy_grows_while_gnss_is_off(replay: Replay) -> None:
    """ESTIMATOR_STATUS shows it in flight, as recorded: over a metre after five seconds."""
    begin = replay.events.phase("gps off for 12 s in hold")[0]
    before = [value for time_s, value in replay.accuracy_m if begin - 5.0 < time_s < begin]
    after = [value for time_s, value in replay.accuracy_m if begin + 4.5 < time_s < begin + 6.5]
    assert max(before) < 0.5
    assert max(after) > 1.0
