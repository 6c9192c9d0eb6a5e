"""From the JSON that MAVSDK delivers to samples; everything here is pure, time comes with the messages."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

from pydantic_core import from_json  # five times as fast as json.loads

from uasfly.link.clock import ClockMap
from uasfly.link.inertial import NAME as INERTIAL
from uasfly.link.inertial import accelerometer_sample
from uasfly.link.motion import attitude_target_sample, battery_sample, odometry_sample
from uasfly.link.rotors import NAME as ROTORS
from uasfly.link.rotors import RotorAssembler
from uasfly.link.texts import TextAssembler
from uasfly.link.truth import GeographicTruth, simulated_truth
from uasfly.link.vehicle_state import HealthState, VehicleState
from uasfly.messages import Sample, TextSample

Handler = Callable[[Any, float], Sample | None]  # fields of a message (INERTIAL: or of several), arrival

# What decoding a message may raise whose fields are missing, of another type or out of all bounds.
MALFORMED = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)

MICRO = 1e-6
MILLI = 1e-3


class Decoder:
    """Turns messages of the autopilot into samples.

    Args:
        clock: maps the vehicle's time stamps to host time.

    Attributes:
        dropped: how many messages of each type could not be used (a field missing, not finite or malformed).
        state: the vehicle's mode, arming and landed state so far.
    """

    def __init__(self, clock: ClockMap) -> None:
        self.dropped: Counter[str] = Counter()
        self.state = VehicleState()
        self._clock = clock
        self._health = HealthState()
        self._texts = TextAssembler()
        self._geographic = GeographicTruth()
        self._battery_id = 255
        self._rotors = RotorAssembler(clock)
        self._handlers: dict[str, Handler] = {
            "ODOMETRY": self._odometry,
            "ATTITUDE_TARGET": self._attitude_target,
            INERTIAL: self._inertial,
            ROTORS: self._rotors.add,
            "HEARTBEAT": self.state.heartbeat,
            "CURRENT_MODE": lambda fields, _: self.state.current_mode(fields),
            "EXTENDED_SYS_STATE": lambda fields, _: self.state.landed_state(fields),
            "ESTIMATOR_STATUS": self._estimator,
            "GPS_RAW_INT": self._health.gnss,  # its time may be UTC: arrival time it is
            "BATTERY_STATUS": self._battery,
            "STATUSTEXT": self._text,
            "DEBUG_FLOAT_ARRAY": self._simulated_truth,
            "HIL_STATE_QUATERNION": self._geographic_truth,
            "GPS_GLOBAL_ORIGIN": self._origin,
        }

    @property
    def names(self) -> tuple[str, ...]:
        """Messages that this decoder understands."""
        return tuple(self._handlers)

    def decode(self, name: str, text: str, arrival_s: float) -> Sample | None:
        """One message.

        Args:
            name: of the message, one of `names`.
            text: its fields as JSON; of INERTIAL also a list of several (see `inertial.taken`).
            arrival_s: host time of its arrival.

        Returns:
            The sample, or None where the message makes none.
        """
        try:
            return self._handlers[name](from_json(text, allow_inf_nan=False), arrival_s)
        except MALFORMED:  # such a message must not end the flight
            self.dropped[name] += 1
            return None

    def overdue_texts(self, now_s: float) -> list[TextSample]:
        """Texts whose end has not come: see `TextAssembler.overdue`."""
        return [TextSample(now_s, severity, text) for severity, text in self._texts.overdue(now_s)]

    def _counted(self, name: str, sample: Sample | None) -> Sample | None:
        if sample is None:
            self.dropped[name] += 1
        return sample

    def _odometry(self, fields: dict[str, Any], arrival_s: float) -> Sample | None:
        time_s = self._clock.to_host(fields["time_usec"] * MICRO, arrival_s)
        return self._counted("ODOMETRY", odometry_sample(fields, time_s))

    def _attitude_target(self, fields: dict[str, Any], arrival_s: float) -> Sample | None:
        time_s = self._clock.to_host(fields["time_boot_ms"] * MILLI, arrival_s)
        return self._counted("ATTITUDE_TARGET", attitude_target_sample(fields, time_s))

    def _inertial(self, fields: dict[str, Any] | list[dict[str, Any]], arrival_s: float) -> Sample | None:
        readings = fields if isinstance(fields, list) else [fields]
        sample, unusable = accelerometer_sample(readings, self._clock, arrival_s)
        if unusable:
            self.dropped[INERTIAL] += unusable
        return sample

    def _battery(self, fields: dict[str, Any], arrival_s: float) -> Sample | None:
        self._battery_id = min(self._battery_id, fields["id"])  # of several batteries the first counts
        if fields["id"] != self._battery_id:
            return None
        return self._counted("BATTERY_STATUS", battery_sample(fields, arrival_s))

    def _estimator(self, fields: dict[str, Any], arrival_s: float) -> Sample | None:
        return self._health.estimator(fields, self._clock.to_host(fields["time_usec"] * MICRO, arrival_s))

    def _text(self, fields: dict[str, Any], arrival_s: float) -> Sample | None:
        complete = self._texts.add(fields, arrival_s)
        return None if complete is None else TextSample(arrival_s, *complete)

    def _simulated_truth(self, fields: dict[str, Any], arrival_s: float) -> Sample | None:
        return simulated_truth(fields, self._clock.to_host(fields["time_usec"] * MICRO, arrival_s))

    def _geographic_truth(self, fields: dict[str, Any], arrival_s: float) -> Sample | None:
        return self._geographic.sample(fields, self._clock.to_host(fields["time_usec"] * MICRO, arrival_s))

    def _origin(self, fields: dict[str, Any], arrival_s: float) -> Sample | None:
        del arrival_s
        self._geographic.set_origin(fields)
        return None
