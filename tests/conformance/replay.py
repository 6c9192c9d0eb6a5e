"""The recorded flight flown again: the same requests, commands and setpoints at the same times since boot."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from pymavlink.dialects.v20 import development as dialect

from tests.conformance.recording import Event, Message, Received, Recording
from tests.sim_mavlink.bench import Bench
from uasfly.files import find_file, load_file
from uasfly.frames import euler_from_quaternion, wrap_angle
from uasfly.sim.mavlink.framing import FrameReader
from uasfly.sim.mavlink.modes import custom_mode
from uasfly.sim.plant import Plant
from uasfly.sim.scenario import Scenario
from uasfly.sim.vehicle import SimulatedVehicle

SYSTEM = 6
CLIENT = (245, 191)
SETPOINT_PERIOD_S = 0.02
LEVEL, STOP, RESUME, HOLD = (
    "stream level, then offboard",
    "setpoints stop for 6 s",
    "setpoints resume",
    "gps off for 12 s in hold",
)
RAMP_WITH_RATE = "yaw ramp back, mask 3 with body_yaw_rate"
RAMP_RAD_S = 0.5  # the phase's name
_TURNING_RAD = 1e-3  # between two setpoints of a ramp there are ten times as much
_IDLE = "default streams, idle"


@dataclass(frozen=True)
class Setpoint:
    """A SET_ATTITUDE_TARGET; `yaw_rate_rad_s` is None with mask 7, in FRD with mask 3."""

    time_s: float
    quaternion: tuple[float, ...]
    thrust: float
    yaw_rate_rad_s: float | None

    def message(self) -> Message:
        """As it is sent."""
        mask = 7 if self.yaw_rate_rad_s is None else 3
        rate = self.yaw_rate_rad_s or 0.0
        return dialect.MAVLink_set_attitude_target_message(
            round(self.time_s * 1e3), SYSTEM, 1, mask, self.quaternion, 0, 0, rate, self.thrust
        )


@dataclass(frozen=True)
class ModeChange:
    """Custom mode and arming from a time on."""

    time_s: float
    custom_mode: int
    armed: bool


@dataclass
class Flight:
    """What the simulated vehicle sent, on its clock.

    Attributes:
        received: all telemetry. modes: each change, as the vehicle itself knows it.
        acknowledgements: command and result. parameters: answers to reads and writes.
    """

    received: list[Received] = field(default_factory=list)
    modes: list[ModeChange] = field(default_factory=list)
    acknowledgements: list[Message] = field(default_factory=list)
    parameters: list[Message] = field(default_factory=list)

    def during(self, interval: tuple[float, float]) -> list[Received]:
        """What came in an interval."""
        begin, end = interval
        return [one for one in self.received if begin <= one.time_s < end]


def fly(recording: Recording) -> Flight:
    """The whole recording, flown by the simulated vehicle."""
    plant = load_file(find_file("plant", "px4_sih"), Plant)
    scenario = load_file(find_file("scenario", "calm"), Scenario)
    vehicle = SimulatedVehicle(plant, scenario, 1, start_yaw_rad=math.pi / 2)
    bench = Bench(SYSTEM, client=CLIENT, vehicle=vehicle)
    flight = Flight()
    idle_s, idle_end_s = recording.phase(_IDLE)
    timeline: list[Event | Setpoint] = [*recording.events, *setpoints(recording)]
    for entry in sorted(timeline, key=lambda entry: entry.time_s):
        while vehicle.time_s + vehicle.step_s <= entry.time_s:
            vehicle.advance_to(vehicle.time_s + vehicle.step_s)
            messages = bench.endpoint.poll()
            if idle_s <= vehicle.time_s < idle_end_s:
                messages = bench.wired(messages)
            flight.received += [Received(vehicle.time_s, m.get_msgId(), m) for m in messages]
            _note_mode(flight, bench)
        if isinstance(entry, Setpoint):
            bench.ask(entry.message())
        else:
            _play(entry, bench, flight)
    return flight


def setpoints(recording: Recording) -> list[Setpoint]:
    """What PX4 was told in offboard: its ATTITUDE_TARGET carries each setpoint and when it came.

    Before offboard they are not to be seen: the first one stands for them.
    """
    asked = [event.time_s for event in recording.of_kind("ack") if event.values["command"] == 176]
    begin = next(time_s for time_s in asked if time_s > recording.phase(LEVEL)[0])
    stop, resume = recording.phase(STOP)[0], recording.phase(RESUME)[0]
    left = next(time_s for time_s in asked if time_s > resume)
    echoes: dict[float, Message] = {}
    for one in recording.received:
        if one.number == dialect.MAVLINK_MSG_ID_ATTITUDE_TARGET:
            echoes.setdefault(one.message.time_boot_ms * 1e-3, one.message)
    told = [(time_s, m) for time_s, m in echoes.items() if begin <= time_s <= stop or resume <= time_s < left - 0.01]
    first_s, first = told[0]
    early = np.arange(recording.phase(LEVEL)[0], first_s - 0.5 * SETPOINT_PERIOD_S, SETPOINT_PERIOD_S)
    ramp_s, ramp_end_s = recording.phase(RAMP_WITH_RATE)
    result = [Setpoint(float(time_s), tuple(first.q), first.thrust, None) for time_s in early]
    for (time_s, message), (_, following) in zip(told, [*told[1:], told[-1]], strict=True):
        turn = wrap_angle(_yaw(following) - _yaw(message))
        # each phase begins with a setpoint, which may be stamped a little earlier than the phase
        ramping = ramp_s - 0.5 * SETPOINT_PERIOD_S <= time_s < ramp_end_s and abs(turn) > _TURNING_RAD
        rate = math.copysign(RAMP_RAD_S, turn) if ramping else None
        result.append(Setpoint(time_s, tuple(message.q), message.thrust, rate))
    return result


def _yaw(message: Message) -> float:
    return float(euler_from_quaternion(np.array(message.q))[2])


def _note_mode(flight: Flight, bench: Bench) -> None:
    state = bench.endpoint.view.state
    mode = custom_mode(state.mode), state.armed
    if not flight.modes or (flight.modes[-1].custom_mode, flight.modes[-1].armed) != mode:
        flight.modes.append(ModeChange(bench.vehicle.time_s, *mode))


def _play(event: Event, bench: Bench, flight: Flight) -> None:
    """Ask what was asked; answers that are not telemetry are kept apart."""
    request = _request(event)
    for frame in bench.frames(request) if request else ():
        number = int.from_bytes(frame[7:10], "little")
        answer = next(FrameReader().messages(frame), None)  # None: pymavlink knows no PROTOCOL_VERSION
        name = answer.get_type() if answer else ""
        if name == "COMMAND_ACK":
            flight.acknowledgements.append(answer)
        elif name.startswith("PARAM_"):
            flight.parameters.append(answer)
        else:
            flight.received.append(Received(bench.vehicle.time_s, number, answer))


def _request(event: Event) -> Message | None:
    """The message that an event stands for; None where it is no request."""
    values = event.values
    if event.kind == "command":
        return dialect.MAVLink_command_long_message(SYSTEM, 1, values["command"], 0, *values["params"])
    if event.kind == "param_read":
        return dialect.MAVLink_param_request_read_message(SYSTEM, 1, values["name"].encode(), -1)
    if event.kind == "param_set":
        return dialect.MAVLink_param_set_message(SYSTEM, 1, values["name"].encode(), values["value"], 9)
    return None
