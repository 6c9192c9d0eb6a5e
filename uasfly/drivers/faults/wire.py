"""Listens on the wire between uasfly and the vehicle: a UDP relay that reads along and changes nothing.

What a stopped or killed program did can be told from here only.
"""

from __future__ import annotations

import contextlib
import math
import select
import socket
import threading
import time
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import development as dialect

from uasfly.drivers.faults.vehicle_clock import VehicleClock
from uasfly.frames import euler_from_quaternion, swap_quaternion_enu_ned
from uasfly.link.modes import flight_mode
from uasfly.link.truth import simulated_truth
from uasfly.messages import FlightMode, Setpoint, TruthSample
from uasfly.sim.mavlink.framing import FrameReader

MICRO, MILLI = 1e-6, 1e-3
AUTOPILOT = 1
BUFFER_BYTES = 65536
LISTENER = (245, 191)  # system and component of the one who asks for the truth
TRUTH_ID, TRUTH_INTERVAL_US, ASK_EVERY_S = 350, 20000, 1.0


class Wire(threading.Thread):
    """Relay on loopback; times are the host's monotonic clock.

    Attributes:
        program_port: where uasfly listens. vehicle_port: where the vehicle sends to.
        setpoints: (arrival [s], age [s] by the vehicle's clock, Setpoint).
        truths: of the simulated vehicle. modes: (arrival [s], mode) at each change.
        texts: (arrival [s], text) from uasfly to the ground station.
        offboard_s: when the vehicle was first heard in offboard, NaN before.
    """

    def __init__(self, program_port: int) -> None:
        super().__init__(name="wire", daemon=True)
        self.program_port = program_port
        self._to_program = _socket()
        self._to_vehicle = _socket()
        self._asking = _socket()  # what is asked for here is answered here, and sent to everybody
        self._asked_s = -math.inf
        self.vehicle_port = int(self._to_vehicle.getsockname()[1])
        self.setpoints: list[tuple[float, float, Setpoint]] = []
        self.truths: list[TruthSample] = []
        self.modes: list[tuple[float, FlightMode]] = []
        self.texts: list[tuple[float, str]] = []
        self.offboard_s = math.nan
        self._clock = VehicleClock()
        self._vehicle: Any = None
        self._ended = threading.Event()
        self._down, self._up = FrameReader(), FrameReader()

    def run(self) -> None:
        """Relay until `close`."""
        while not self._ended.is_set():
            readable, _, _ = select.select((self._to_vehicle, self._to_program), (), (), 0.1)
            for end in readable:
                self._relay(end)

    def close(self) -> None:
        """Stop and give the ports back."""
        self._ended.set()
        self.join(2.0)
        self._to_program.close()
        self._to_vehicle.close()
        self._asking.close()

    def left_offboard_s(self) -> float:
        """When the vehicle was in another mode again, NaN where it was not."""
        after = (time_s for time_s, mode in self.modes if time_s > self.offboard_s and mode is not FlightMode.OFFBOARD)
        return next(after, math.nan)

    def _ask_for_truth(self, now: float, vehicle: Any) -> None:
        """Again and again: a vehicle that restarts forgets it, and a bad link loses it."""
        if now - self._asked_s > ASK_EVERY_S:
            self._asked_s = now
            message = dialect.MAVLink_command_long_message(
                0, AUTOPILOT, dialect.MAV_CMD_SET_MESSAGE_INTERVAL, 0, TRUTH_ID, TRUTH_INTERVAL_US, 0, 0, 0, 0, 0
            )
            self._send(self._asking, bytes(message.pack(dialect.MAVLink(None, *LISTENER))), vehicle)

    def _relay(self, end: socket.socket) -> None:
        try:
            data, sender = end.recvfrom(BUFFER_BYTES)
        except OSError:  # the other end is gone: loopback tells it on the next read
            return
        now = time.monotonic()
        if end is self._to_vehicle:
            self._vehicle = sender
            self._ask_for_truth(now, sender)
            self._send(self._to_program, data, ("127.0.0.1", self.program_port))
            for message in self._up.messages(data):
                self._from_vehicle(now, message)
        elif self._vehicle is not None:
            self._send(self._to_vehicle, data, self._vehicle)
            for message in self._down.messages(data):
                self._from_program(now, message)

    @staticmethod
    def _send(end: socket.socket, data: bytes, to: Any) -> None:
        with contextlib.suppress(OSError):  # nobody there yet, or any more
            end.sendto(data, to)

    def _from_vehicle(self, now: float, message: Any) -> None:
        match message.get_type():
            case "DEBUG_FLOAT_ARRAY":
                self._clock.hear(now, message.time_usec * MICRO)
                truth = simulated_truth({"name": message.name, "data": list(message.data)}, now)
                if truth is not None:
                    self.truths.append(truth)
            case "HEARTBEAT" | "CURRENT_MODE":
                if message.get_srcComponent() == AUTOPILOT:
                    self._mode(now, flight_mode(message.custom_mode))

    def _mode(self, now: float, mode: FlightMode) -> None:
        if not self.modes or self.modes[-1][1] is not mode:
            self.modes.append((now, mode))
        if mode is FlightMode.OFFBOARD and math.isnan(self.offboard_s):
            self.offboard_s = now

    def _from_program(self, now: float, message: Any) -> None:
        match message.get_type():
            case "SET_ATTITUDE_TARGET":
                quaternion = swap_quaternion_enu_ned(np.array(message.q, dtype=np.float64))
                roll, pitch, yaw = euler_from_quaternion(quaternion)
                made_s = message.time_boot_ms * MILLI + self._clock.offset_s
                setpoint = Setpoint(made_s, roll, pitch, yaw, -message.body_yaw_rate, message.thrust)
                self.setpoints.append((now, now - made_s, setpoint))
            case "STATUSTEXT":
                self.texts.append((now, message.text))


def _socket() -> socket.socket:
    end = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    end.bind(("127.0.0.1", 0))
    return end
