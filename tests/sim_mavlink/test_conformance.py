"""The server against what PX4 itself sent: message set, rates, field values, acknowledgements, modes."""

import math
from typing import Any

import pytest

from tests.sim_mavlink.bench import Bench, only, rates_hz
from tests.sim_mavlink.recording import Recording, conformance
from uasfly.files import find_file, load_file
from uasfly.sim.mavlink.streams import SILENT_IDS
from uasfly.sim.plant import Plant
from uasfly.sim.scenario import Scenario
from uasfly.sim.vehicle import SimulatedVehicle

IDLE = "default streams, idle"
SYSTEM = 6
# devices that the simulated vehicle does not have; their intervals can be set, as PX4 allows without data
LEFT_OUT = {"DISTANCE_SENSOR", "SERVO_OUTPUT_RAW", "GNSS_INTEGRITY", "OPEN_DRONE_ID_LOCATION", "OPEN_DRONE_ID_SYSTEM"}
NOT_IN_PYMAVLINK = {8, 290, 291, 300, 380, 395, 411, 514}

# Fields that must be the same in idle, and fields that must agree within a tolerance.
SAME: dict[str, tuple[str, ...]] = {
    "HEARTBEAT": ("type", "autopilot", "base_mode", "custom_mode", "system_status", "mavlink_version"),
    "ODOMETRY": ("frame_id", "child_frame_id", "estimator_type", "quality"),
    "ATTITUDE_TARGET": ("type_mask",),
    "SYS_STATUS": (
        "onboard_control_sensors_present",
        "onboard_control_sensors_enabled",
        "onboard_control_sensors_health",
        "current_battery",
        "battery_remaining",
        "onboard_control_sensors_health_extended",
    ),
    "EXTENDED_SYS_STATE": ("vtol_state", "landed_state"),
    "BATTERY_STATUS": (
        "id",
        "battery_function",
        "type",
        "temperature",
        "current_battery",
        "current_consumed",
        "energy_consumed",
        "battery_remaining",
        "time_remaining",
        "charge_state",
        "voltages_ext",
        "mode",
        "fault_bitmask",
    ),
    "ESTIMATOR_STATUS": ("flags",),
    "GPS_RAW_INT": ("fix_type", "eph", "epv", "satellites_visible", "h_acc", "v_acc", "vel_acc", "hdg_acc", "yaw"),
    "CURRENT_MODE": ("standard_mode", "custom_mode", "intended_custom_mode"),
    "MISSION_CURRENT": ("seq", "total", "mission_state", "mission_mode"),
    "POSITION_TARGET_LOCAL_NED": ("coordinate_frame", "type_mask", "afx", "afy", "afz", "yaw_rate"),
    "TIMESYNC": ("tc1",),
    "PING": ("target_system", "target_component"),
    "HIGHRES_IMU": ("temperature", "diff_pressure", "id"),
    "VFR_HUD": ("throttle",),
}
CLOSE: dict[str, dict[str, float]] = {
    "ATTITUDE": {"roll": 0.05, "pitch": 0.05, "rollspeed": 0.05, "pitchspeed": 0.05, "yawspeed": 0.05},
    "ATTITUDE_TARGET": {"thrust": 1e-4},
    "LOCAL_POSITION_NED": {"x": 1.0, "y": 1.0, "z": 1.0, "vx": 0.3, "vy": 0.3, "vz": 0.3},
    "GLOBAL_POSITION_INT": {"lat": 100.0, "lon": 100.0, "alt": 1000.0, "relative_alt": 500.0},
    "GPS_RAW_INT": {"lat": 100.0, "lon": 100.0, "alt": 3000.0, "alt_ellipsoid": 3000.0},
    "HOME_POSITION": {"latitude": 100.0, "longitude": 100.0, "altitude": 1000.0},
    "ALTITUDE": {"altitude_amsl": 1.0, "altitude_monotonic": 3.0, "altitude_relative": 0.5, "altitude_terrain": 0.5},
    "HIGHRES_IMU": {"xacc": 0.7, "yacc": 0.7, "zacc": 0.7, "abs_pressure": 0.3, "pressure_alt": 3.0},
    "SCALED_PRESSURE": {"press_abs": 0.3},
    "ESTIMATOR_STATUS": {"pos_horiz_accuracy": 0.3, "pos_vert_accuracy": 0.1},
    "SYS_STATUS": {"voltage_battery": 1500.0},
}


@pytest.fixture(scope="module")
def recording() -> Recording:
    """What PX4 sent until the end of the idle phase."""
    return conformance(until_s=13.0)


@pytest.fixture(scope="module")
def bench() -> Bench:
    """The simulated vehicle that stands for the recorded one, and its server."""
    plant = load_file(find_file("plant", "px4_sih"), Plant)
    scenario = load_file(find_file("scenario", "calm"), Scenario)
    return Bench(SYSTEM, client=(245, 191), vehicle=SimulatedVehicle(plant, scenario, 1, start_yaw_rad=math.pi / 2))


@pytest.fixture(scope="module")
def idle(bench: Bench) -> list[Any]:
    """What the server sends in eight seconds on the ground, after the boot."""
    bench.run(4.0)
    return bench.run(8.0)


def test_every_message_that_px4_streams_is_streamed_or_left_out_by_intent(
    recording: Recording, idle: list[Any]
) -> None:
    """The set of messages in idle is PX4's, but for devices that are not there and messages pymavlink cannot make."""
    readable = [message for message in recording.during(IDLE) if message.get_msgId() not in NOT_IN_PYMAVLINK]
    assert {message.get_type() for message in idle} == {message.get_type() for message in readable} - LEFT_OUT
    assert recording.unreadable <= NOT_IN_PYMAVLINK


def test_what_is_left_out_is_known(recording: Recording) -> None:
    """Intervals of the messages that are left out are accepted in silence."""
    numbers = {m.get_msgId() for _, m in recording.messages if m.get_type() in LEFT_OUT}
    assert numbers | (NOT_IN_PYMAVLINK - {300, 411}) <= set(SILENT_IDS)


def test_default_rates_are_px4s(recording: Recording, idle: list[Any]) -> None:
    """Every stream within 15 % of the recorded rate (or one message in eight seconds)."""
    begin, end = recording.events.phase(IDLE)
    expected = rates_hz(recording.during(IDLE), end - begin)
    for name, rate in rates_hz(idle, 8.0).items():
        assert rate == pytest.approx(expected[name], rel=0.15, abs=0.13), name


def test_ids_are_the_autopilots(recording: Recording, idle: list[Any]) -> None:
    """System and component id of every message."""
    ids = {(m.get_srcSystem(), m.get_srcComponent()) for m in idle}
    assert ids == {(m.get_srcSystem(), m.get_srcComponent()) for _, m in recording.messages} == {(SYSTEM, 1)}


def test_fields_are_filled_as_px4_fills_them(recording: Recording, idle: list[Any]) -> None:
    """Constants, flags and states are the same; measurements agree in unit, sign and size."""
    recorded = recording.during(IDLE)
    for name, fields in SAME.items():
        theirs, ours = only(recorded, name), only(idle, name)
        for field in fields:
            assert {repr(getattr(m, field)) for m in ours} == {repr(getattr(m, field)) for m in theirs}, (name, field)
    for name, tolerances in CLOSE.items():
        for field, tolerance in tolerances.items():
            expected = getattr(only(recorded, name)[-1], field)
            for m in only(idle, name):
                assert getattr(m, field) == pytest.approx(expected, abs=tolerance), (name, field)


def test_unknown_fields_are_unknown_in_both(recording: Recording, idle: list[Any]) -> None:
    """Where PX4 sends NaN, so does the server, and nowhere else."""
    for name in {m.get_type() for m in idle}:
        theirs, ours = only(recording.during(IDLE), name)[-1], only(idle, name)[-1]
        for field in theirs.get_fieldnames():
            pair = getattr(theirs, field), getattr(ours, field)
            if all(isinstance(value, float) for value in pair):
                assert math.isnan(pair[0]) == math.isnan(pair[1]), (name, field)


def test_covariances_stand_where_px4_puts_them(recording: Recording, idle: list[Any]) -> None:
    """The diagonal of ODOMETRY's covariances, and of what size."""
    theirs, ours = only(recording.during(IDLE), "ODOMETRY")[-1], only(idle, "ODOMETRY")[-1]
    for field in ("pose_covariance", "velocity_covariance"):
        for mine, its in zip(getattr(ours, field), getattr(theirs, field), strict=True):
            assert (mine == 0.0) == (its == 0.0)
            assert mine <= 30.0 * its
            assert its <= 100.0 * mine
