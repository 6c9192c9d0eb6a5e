"""Which messages the vehicle sends by itself on the onboard link, and how often: read from the recording of PX4.

PX4 streams further messages there that this vehicle leaves out: DISTANCE_SENSOR, ESC_INFO,
SERVO_OUTPUT_RAW, GNSS_INTEGRITY and OPEN_DRONE_ID_* (it has none of these devices), POSITION_TARGET_GLOBAL_INT (it does
not tell the targets of its own modes), ESTIMATOR_SENSOR_FUSION_STATUS, LINK_NODE_STATUS, TIME_ESTIMATE_TO_TARGET, EVENT
and CURRENT_EVENT_SEQUENCE (not in pymavlink's dialects; texts go out as STATUSTEXT, which PX4 sends to ground stations
only).
ESC_STATUS comes when it is asked for and the scenario says `sensors.rotor_speeds`.
As PX4 does for messages that it knows and has no data for, their intervals can be set and they stay silent.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

from pymavlink.dialects.v20 import development as dialect

from uasfly.messages import FlightMode
from uasfly.sim.mavlink import motion_messages as motion
from uasfly.sim.mavlink import status_messages as status
from uasfly.sim.mavlink.framing import Message
from uasfly.sim.mavlink.identity import PROTOCOL_VERSION_ID, Identity
from uasfly.sim.mavlink.scheduler import Stream
from uasfly.sim.mavlink.sensor_messages import ESC_STATUS_ID, Gnss, esc_status, highres_imu, scaled_pressure
from uasfly.sim.mavlink.vehicle_view import VehicleView

LOOP_HZ = 250.0  # attitude and sensors: PX4's control loop
ESTIMATOR_HZ = 100.0  # PX4's estimator
GNSS_HZ = 8.0
STATUS_HZ = 2.0  # PX4's commander says its state twice a second and whenever it changes
TRUTH_HZ = 100.0
ROTOR_HZ = 50.0
PROCESSOR_HZ = 5.0

# Further streams of PX4 (main of August 2026): an interval for them is accepted, and nothing comes.
# fmt: off
SILENT_IDS = (
    8, 25, 26, 36, 62, 65, 69, 76, 87, 93, 106, 112, 115, 116, 124, 129, 132, 137, 143, 149, 192, 225, 231, 235,
    246, 250, 251, 253, 254, 261, 263, 264, 265, 280, 281, 283, 284, 285, 286, 290, 292, 296, 330, 339, 340,
    360, 361, 371, 372, 375, 380, 395, 397, 435, 441, 514, 10001, 10002, 12900, 12901, 12904, 12918, 12920,
)
# fmt: on


class ModeChanges:
    """CURRENT_MODE, which PX4 sends when its state is published: twice a second and at once on a change."""

    def __init__(self) -> None:
        self._said: tuple[FlightMode, FlightMode] | None = None
        self._said_s = 0.0

    def __call__(self, view: VehicleView) -> Message | None:
        """Build the message; None where nothing is new."""
        modes = view.state.mode, view.intended_mode
        if modes == self._said and view.time_s - self._said_s < 1.0 / STATUS_HZ:
            return None
        self._said, self._said_s = modes, view.time_s
        return status.current_mode(view)


def streams(identity: Identity, now_s: Callable[[], float], unix_s: Callable[[], float]) -> list[Stream]:
    """The vehicle's streams.

    Args:
        identity: who the vehicle is.
        now_s: reads the vehicle's clock, which runs on between the steps of the simulation.
        unix_s: reads the time of day, for SYSTEM_TIME.
    """
    ping_numbers = itertools.count()

    def ping(_view: VehicleView) -> Message:
        return dialect.MAVLink_ping_message(motion.microseconds(now_s()), next(ping_numbers) & 0xFFFFFFFF, 0, 0)

    def timesync(_view: VehicleView) -> Message:
        return dialect.MAVLink_timesync_message(0, int(now_s() * 1e9))

    table: list[tuple[int, float, Callable[[VehicleView], Message | tuple[Message, ...] | None], float]] = [
        # message, default rate [Hz] (0: only when asked for), builder, highest rate [Hz]
        (dialect.MAVLINK_MSG_ID_TIMESYNC, 10.0, timesync, LOOP_HZ),
        (dialect.MAVLINK_MSG_ID_HIGHRES_IMU, 50.0, highres_imu, LOOP_HZ),
        (dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED, 30.0, motion.local_position, ESTIMATOR_HZ),
        (dialect.MAVLINK_MSG_ID_ATTITUDE, 100.0, motion.attitude, LOOP_HZ),
        (dialect.MAVLINK_MSG_ID_ALTITUDE, 10.0, motion.altitude, LOOP_HZ),
        (dialect.MAVLINK_MSG_ID_ODOMETRY, 30.0, motion.odometry, ESTIMATOR_HZ),
        (dialect.MAVLINK_MSG_ID_ATTITUDE_QUATERNION, 50.0, motion.attitude_quaternion, LOOP_HZ),
        (dialect.MAVLINK_MSG_ID_ATTITUDE_TARGET, 10.0, motion.AttitudeTargets(), LOOP_HZ),
        (dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, 50.0, motion.global_position, ESTIMATOR_HZ),
        (dialect.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED, 10.0, motion.position_target_local, LOOP_HZ),
        (dialect.MAVLINK_MSG_ID_VFR_HUD, 10.0, motion.vfr_hud, ESTIMATOR_HZ),
        (dialect.MAVLINK_MSG_ID_GPS_RAW_INT, GNSS_HZ, Gnss(), GNSS_HZ),
        (dialect.MAVLINK_MSG_ID_SYS_STATUS, 5.0, status.system_status, PROCESSOR_HZ),
        (dialect.MAVLINK_MSG_ID_EXTENDED_SYS_STATE, 5.0, status.extended_system_state, LOOP_HZ),
        (dialect.MAVLINK_MSG_ID_HEARTBEAT, 1.0, status.heartbeat, 1.0),
        (dialect.MAVLINK_MSG_ID_MISSION_CURRENT, 1.0, status.mission_current, LOOP_HZ),
        (dialect.MAVLINK_MSG_ID_ESTIMATOR_STATUS, 1.0, status.estimator_status, ESTIMATOR_HZ),
        (dialect.MAVLINK_MSG_ID_PING, 1.0, ping, LOOP_HZ),
        (dialect.MAVLINK_MSG_ID_SCALED_PRESSURE, 1.0, scaled_pressure, LOOP_HZ),
        (dialect.MAVLINK_MSG_ID_SYSTEM_TIME, 1.0, lambda view: status.system_time(view, unix_s()), LOOP_HZ),
        (dialect.MAVLINK_MSG_ID_BATTERY_STATUS, 0.5, status.battery_status, STATUS_HZ),
        (dialect.MAVLINK_MSG_ID_CURRENT_MODE, 0.5, ModeChanges(), LOOP_HZ),
        (dialect.MAVLINK_MSG_ID_HOME_POSITION, 0.5, motion.home_position, LOOP_HZ),
        (dialect.MAVLINK_MSG_ID_VIBRATION, 0.5, status.vibration, LOOP_HZ),
        (dialect.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN, 0.0, motion.global_origin, 1.0),
        (dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION, 0.0, lambda _: identity.autopilot_version(), 1.0),
        (PROTOCOL_VERSION_ID, 0.0, lambda _: identity.protocol_version(), 1.0),
        (ESC_STATUS_ID, 0.0, esc_status, ROTOR_HZ),
        (dialect.MAVLINK_MSG_ID_DEBUG_FLOAT_ARRAY, 0.0, motion.truth, TRUTH_HZ),
    ]
    return [Stream(*row) for row in table] + [Stream(number, 0.0, lambda _: None, 1.0) for number in SILENT_IDS]
