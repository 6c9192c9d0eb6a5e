"""SET_ATTITUDE_TARGET as PX4 reads it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from uasfly.frames import swap_quaternion_enu_ned
from uasfly.messages import TextSample
from uasfly.sim.mavlink.framing import Message
from uasfly.sim.mavlink.identity import Sender
from uasfly.sim.mavlink.vehicle_view import VehicleView

# ATTITUDE_TARGET_TYPEMASK
_YAW_RATE_IGNORED = 4
_THRUST_IS_A_VECTOR, _THRUST_IGNORED, _ATTITUDE_IGNORED = 32, 64, 128
_NOT_FLYABLE = _THRUST_IS_A_VECTOR | _THRUST_IGNORED | _ATTITUDE_IGNORED
COMPLAINT_INTERVAL_S = 1.0
_SEVERITY_ERROR = 3


class Setpoints:
    """Hands attitude setpoints to the vehicle.

    Mask 7 is attitude and thrust; with bit 4 clear (3 or 0) `body_yaw_rate` is a feed-forward. Rate setpoints without
    an attitude, and thrust as a vector, are not simulated. PX4 would take a NaN as it is and fall; here such a setpoint
    is refused and a status text says so, since it is a fault of the sender.

    Attributes:
        accepted, refused: setpoints so far.
    """

    def __init__(self, view: VehicleView, say: Callable[[TextSample], None]) -> None:
        self._view = view
        self._say = say
        self._complained_s = -math.inf
        self.accepted = 0
        self.refused = 0

    def handlers(self) -> dict[str, Callable[[Message, Sender], list[Message]]]:
        """What to call for which message."""
        return {"SET_ATTITUDE_TARGET": self._attitude_target}

    def _attitude_target(self, message: Message, _sender: Sender) -> list[Message]:
        mask = message.type_mask
        if mask & _NOT_FLYABLE:
            return self._refuse(f"type mask {mask}, use 7 or 3")
        norm = math.sqrt(sum(part * part for part in message.q))
        yaw_rate = 0.0 if mask & _YAW_RATE_IGNORED else message.body_yaw_rate
        if not (math.isfinite(norm) and norm > 0.0 and math.isfinite(message.thrust) and math.isfinite(yaw_rate)):
            return self._refuse("not finite or zero quaternion")
        attitude = swap_quaternion_enu_ned(np.array(message.q) / norm)
        # FRD turns clockwise about down, FLU counter-clockwise about up
        feed_forward = None if mask & _YAW_RATE_IGNORED else -yaw_rate
        self._view.vehicle.set_attitude_target(attitude, message.thrust, feed_forward)
        self._view.last_setpoint_s = self._view.time_s
        self.accepted += 1
        return []

    def _refuse(self, reason: str) -> list[Message]:
        self.refused += 1
        now = self._view.time_s
        if now - self._complained_s >= COMPLAINT_INTERVAL_S:
            self._complained_s = now
            self._say(TextSample(now, _SEVERITY_ERROR, f"Setpoint refused: {reason}"))
        return []
