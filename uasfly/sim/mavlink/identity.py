"""Who the simulated vehicle is on MAVLink, and what it says about itself when asked."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from pymavlink.dialects.v20 import development as dialect

from uasfly.sim.mavlink.framing import Message, UnlistedMessage

COMPONENT_AUTOPILOT = 1
# version that the recording was made with: 1.18.0, development build; clients choose features by it
PX4_VERSION = 0x01120040
CAPABILITIES = (
    dialect.MAV_PROTOCOL_CAPABILITY_MISSION_FLOAT
    | dialect.MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT
    | dialect.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    | dialect.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
    | dialect.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
    | dialect.MAV_PROTOCOL_CAPABILITY_FTP
    | dialect.MAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET
    | dialect.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
    | dialect.MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION
    | dialect.MAV_PROTOCOL_CAPABILITY_MAVLINK2
    | dialect.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
    | dialect.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY
)
UID = int.from_bytes(b"uasfly\0\0", "big")

PROTOCOL_VERSION_ID = 300
_PROTOCOL_VERSION_CRC_EXTRA = 217


@dataclass(frozen=True, slots=True)
class Sender:
    """Where a message came from."""

    system: int
    component: int


@dataclass(frozen=True, slots=True)
class Identity:
    """System and component id of the vehicle."""

    system: int = 1
    component: int = COMPONENT_AUTOPILOT

    def is_addressed(self, message: Message) -> bool:
        """Whether a message's target is this vehicle or everybody (0); a message without a target is for everybody."""
        system = getattr(message, "target_system", 0)
        component = getattr(message, "target_component", 0)
        return system in (0, self.system) and component in (0, self.component)

    def autopilot_version(self) -> Message:
        """AUTOPILOT_VERSION."""
        uid2 = [*UID.to_bytes(8, "big"), *(0,) * 9, self.system]
        return dialect.MAVLink_autopilot_version_message(
            CAPABILITIES, PX4_VERSION, PX4_VERSION, 0, 1, [0] * 8, [0] * 8, [0] * 8, 0, 0, UID + self.system, uid2
        )

    def protocol_version(self) -> Message:
        """PROTOCOL_VERSION: MAVLink 2, 1 understood."""
        payload = struct.pack("<3H16x", 200, 100, 203)
        return UnlistedMessage(PROTOCOL_VERSION_ID, "PROTOCOL_VERSION", _PROTOCOL_VERSION_CRC_EXTRA, payload)
