"""A vehicle that says just enough MAVLink for the link's tests: a thread with pymavlink behind a wire.

Its clock is the host's monotonic clock plus `clock_ahead_s`, so that tests know what every mapped time must be.
"""

from __future__ import annotations

import os
import select
import struct
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

os.environ.setdefault("MAVLINK20", "1")

from pymavlink.dialects.v20 import common as mavlink

from tests.link.wires import Wire

__all__ = ["FakeVehicle", "mavlink"]

CUSTOM_HOLD = 4 << 16 | 3 << 24
PX4, ARDUPILOT = 12, 3
QUADROTOR, GROUND_STATION = 2, 6
COMMAND_SET_INTERVAL = 511
COMMAND_REQUEST_MESSAGE, HOME_POSITION = 512, 242


class FakeVehicle(threading.Thread):
    """Streams, answers and records until `stop` (or the end of a `with` block).

    Args:
        wire: connection to the link.
        system_id, component_id, autopilot, vehicle_type: who it is.
        clock_ahead_s: its clock minus the host's monotonic clock.

    Attributes:
        received: every message that came, in order.
        answers: MAV_RESULT by command; None swallows the command; a function is called with the message.
        parameters: values by name, whole numbers are 32-bit integers; `frozen_parameters` keep theirs.
        home_ned: answer to a request for HOME_POSITION; None keeps silent.
        rates_hz: streams; SET_MESSAGE_INTERVAL changes them.
        silent: it neither sends nor answers.
    """

    def __init__(
        self,
        wire: Wire,
        system_id: int = 1,
        autopilot: int = PX4,
        vehicle_type: int = QUADROTOR,
        clock_ahead_s: float = 500.0,
        component_id: int = 1,
    ) -> None:
        super().__init__(daemon=True)
        self.received: list[Any] = []
        self.answers: dict[int, int | Callable[[Any], None] | None] = {}
        self.parameters: dict[str, float | int] = {"MIS_TAKEOFF_ALT": 2.5}
        self.home_ned: tuple[float, float, float] | None = None
        self.frozen_parameters: set[str] = set()
        self.rates_hz = {"HEARTBEAT": 10.0, "ODOMETRY": 30.0, "ATTITUDE_TARGET": 10.0, "ESTIMATOR_STATUS": 1.0}
        self.clock_ahead_s = clock_ahead_s
        self.answers_timesync = True
        self.silent = False
        self.armed = False
        self.position_ned = (1.0, 2.0, -3.0)
        self._wire = wire
        self._autopilot, self._vehicle_type = autopilot, vehicle_type
        self._lock = threading.Lock()
        self._mavlink = mavlink.MAVLink(_Sink(self), srcSystem=system_id, srcComponent=component_id)
        self._mavlink.robust_parsing = True
        self._due_s = dict.fromkeys(self.rates_hz, 0.0)
        self._stopping = False

    def __enter__(self) -> FakeVehicle:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopping = True
        self.join()
        self._wire.close()

    def send(self, message: Any) -> None:
        """Send a message, from any thread."""
        with self._lock:
            self._mavlink.send(message)

    def write(self, data: bytes) -> None:
        """What pymavlink has packed goes out here."""
        if not self.silent:
            self._wire.write(data)

    def of_type(self, name: str) -> list[Any]:
        """Received messages of one type."""
        return [message for message in list(self.received) if message.get_type() == name]

    def commands(self, number: int) -> list[tuple[float, ...]]:
        """Parameters 1..3 of the received commands with this number."""
        received = [message for message in self.of_type("COMMAND_LONG") if message.command == number]
        return [(message.param1, message.param2, message.param3) for message in received]

    @property
    def time_s(self) -> float:
        """Its clock."""
        return time.monotonic() + self.clock_ahead_s

    def run(self) -> None:
        """Stream and answer until the end."""
        while not self._stopping:
            now_s = time.monotonic()
            for name, rate_hz in list(self.rates_hz.items()):
                if rate_hz > 0.0 and now_s >= self._due_s.get(name, 0.0):
                    self._due_s[name] = max(self._due_s.get(name, 0.0) + 1.0 / rate_hz, now_s)
                    self._stream(name)
            if select.select([self._wire], [], [], 0.002)[0]:
                self._read()

    def _read(self) -> None:
        try:
            data = self._wire.read()
        except OSError:  # the other end of a pseudo terminal is closed
            time.sleep(0.01)
            return
        for message in self._mavlink.parse_buffer(data) or []:
            if not self.silent:
                self.received.append(message)
                self._answer(message)

    def _stream(self, name: str) -> None:
        microseconds = int(self.time_s * 1e6)
        q = [1.0, 0.0, 0.0, 0.0]
        if name == "HEARTBEAT":
            base = 1 | (128 if self.armed else 0)
            self.send(mavlink.MAVLink_heartbeat_message(self._vehicle_type, self._autopilot, base, CUSTOM_HOLD, 3, 3))
        elif name == "ODOMETRY":
            zeros = [0.0] * 21
            velocity, rate = (0.1, 0.2, -0.3), (0.01, 0.02, 0.03)
            self.send(
                mavlink.MAVLink_odometry_message(
                    microseconds, 1, 1, *self.position_ned, q, *velocity, *rate, zeros, zeros, 5
                )
            )
        elif name == "ATTITUDE_TARGET":
            self.send(mavlink.MAVLink_attitude_target_message(microseconds // 1000, 0, q, 0.0, 0.0, 0.0, 0.4))
        elif name == "ESTIMATOR_STATUS":
            self.send(mavlink.MAVLink_estimator_status_message(microseconds, 895, *[0.1] * 6, 0.3, 0.2))
        elif name == "DEBUG_FLOAT_ARRAY":
            data = [1.0, 2.0, 3.0, 0.1, 0.2, 0.3, *q, -1.5, 0.5, 0.0, 8.0, 0.0, 0.0]
            padded = data + [0.0] * (58 - len(data))
            self.send(mavlink.MAVLink_debug_float_array_message(microseconds, b"truth", 0, padded))

    def _answer(self, message: Any) -> None:
        handler = self._handlers.get(message.get_type())
        if handler is not None:
            handler(self, message)

    def _command(self, message: Any) -> None:
        answer = self.answers.get(message.command, 0)
        if callable(answer):
            answer(message)
        elif answer is not None:
            if message.command == COMMAND_SET_INTERVAL and answer == 0:
                known = mavlink.mavlink_map.get(int(message.param1))
                self.rates_hz[known.msgname if known else str(message.param1)] = 1e6 / message.param2
            self.acknowledge(message, answer)
            if (message.command, message.param1) == (COMMAND_REQUEST_MESSAGE, HOME_POSITION) and self.home_ned:
                self.send(mavlink.MAVLink_home_position_message(0, 0, 0, *self.home_ned, [1.0, 0.0, 0.0, 0.0], 0, 0, 0))

    def acknowledge(self, message: Any, result: int) -> None:
        """Answer a command."""
        sender = (message.get_srcSystem(), message.get_srcComponent())
        self.send(mavlink.MAVLink_command_ack_message(message.command, result, 0, 0, *sender))

    def _time_request(self, message: Any) -> None:
        if message.tc1 == 0 and self.answers_timesync:
            self.send(mavlink.MAVLink_timesync_message(int(self.time_s * 1e9), message.ts1))

    def _parameter(self, message: Any) -> None:
        name = message.param_id
        if name in self.parameters:
            if name not in self.frozen_parameters:
                self.parameters[name] = message.param_value
            self._tell_parameter(name)

    def _parameter_read(self, message: Any) -> None:
        if message.param_id in self.parameters:
            self._tell_parameter(message.param_id)

    def _tell_parameter(self, name: str) -> None:
        value = self.parameters[name]
        if isinstance(value, int):  # as PX4: its bytes in the place of the float
            content, kind = struct.unpack("<f", struct.pack("<i", value))[0], 6
        else:
            content, kind = value, 9
        self.send(mavlink.MAVLink_param_value_message(name.encode(), content, kind, 1, 0))

    _handlers: Mapping[str, Callable[[FakeVehicle, Any], None]] = {
        "COMMAND_LONG": _command,
        "TIMESYNC": _time_request,
        "PARAM_SET": _parameter,
        "PARAM_REQUEST_READ": _parameter_read,
    }


class _Sink:
    """What pymavlink writes to."""

    def __init__(self, vehicle: FakeVehicle) -> None:
        self._vehicle = vehicle

    def write(self, data: bytes) -> None:
        self._vehicle.write(data)
