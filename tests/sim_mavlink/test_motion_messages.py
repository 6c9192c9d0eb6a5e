import math

import numpy as np
import pytest
from pymavlink.dialects.v20 import development as dialect

from tests.sim_mavlink.bench import Bench, Message, only
from tests.sim_mavlink.fakes import YAW_RAD
from uasfly.frames import quaternion_from_euler
from uasfly.messages import FlightMode
from uasfly.sim.mavlink.motion_messages import microseconds, milliseconds

EARTH_RADIUS_M = 6371000.0
REQUEST = 512
IDS = {
    "ATTITUDE": 30,
    "ATTITUDE_QUATERNION": 31,
    "LOCAL_POSITION_NED": 32,
    "GLOBAL_POSITION_INT": 33,
    "GPS_GLOBAL_ORIGIN": 49,
    "VFR_HUD": 74,
    "ATTITUDE_TARGET": 83,
    "POSITION_TARGET_LOCAL_NED": 85,
    "ALTITUDE": 141,
    "HOME_POSITION": 242,
    "ODOMETRY": 331,
    "DEBUG_FLOAT_ARRAY": 350,
}


def _message(bench: Bench, name: str) -> Message:
    message, ack = bench.command(REQUEST, IDS[name])
    assert message.get_type() == name
    assert ack.result == 0
    return message


@pytest.fixture
def bench() -> Bench:
    """An endpoint whose vehicle stands at ENU (1, 2, 3), 0.5 s after boot."""
    bench = Bench()
    bench.run(0.5)
    return bench


def test_odometry_is_ned_in_pose_and_velocity(bench: Bench) -> None:
    """ENU (1, 2, 3) is NED (2, 1, -3); the velocity is in NED too, as child_frame_id says; times are microseconds."""
    m = _message(bench, "ODOMETRY")
    assert (m.time_usec, m.frame_id, m.child_frame_id, m.reset_counter) == (500000, 1, 1, 3)
    assert (m.x, m.y, m.z) == pytest.approx((2.0, 1.0, -3.0))
    assert (m.vx, m.vy, m.vz) == pytest.approx((0.2, 0.1, -0.3))
    assert (m.rollspeed, m.pitchspeed, m.yawspeed) == pytest.approx((0.01, -0.02, -0.03))
    assert m.estimator_type == 8
    variance = m.pose_covariance
    assert variance[0] + variance[6] == pytest.approx(0.3**2)
    assert [i for i, value in enumerate(variance) if value] == [0, 6, 11, 15, 18, 20]


def test_attitude_messages_agree_with_each_other(bench: Bench) -> None:
    """Yaw 0.3 in ENU is pi/2 - 0.3 in NED, in the angles as in the quaternion."""
    bench.vehicle.quaternion = quaternion_from_euler(0.1, 0.2, YAW_RAD)
    bench.endpoint.view.refresh()
    m = _message(bench, "ATTITUDE")
    assert (m.time_boot_ms, m.roll, m.pitch, m.yaw) == pytest.approx((500, 0.1, -0.2, math.pi / 2 - YAW_RAD))
    q = _message(bench, "ATTITUDE_QUATERNION")
    expected = quaternion_from_euler(0.1, -0.2, math.pi / 2 - YAW_RAD)
    np.testing.assert_allclose((q.q1, q.q2, q.q3, q.q4), expected, atol=1e-6)
    odometry = _message(bench, "ODOMETRY")
    np.testing.assert_allclose(odometry.q, expected, atol=1e-6)


def test_local_position_repeats_the_odometry(bench: Bench) -> None:
    """LOCAL_POSITION_NED is the same motion in milliseconds."""
    m = _message(bench, "LOCAL_POSITION_NED")
    assert (m.time_boot_ms, m.x, m.y, m.z) == pytest.approx((500, 2.0, 1.0, -3.0))
    assert (m.vx, m.vy, m.vz) == pytest.approx((0.2, 0.1, -0.3))


def test_global_position_lies_off_the_origin_as_the_local_one_does(bench: Bench) -> None:
    """Degrees times 1e7 on PX4's sphere, heights in millimetres, relative to where the vehicle was armed."""
    m, origin = _message(bench, "GLOBAL_POSITION_INT"), _message(bench, "GPS_GLOBAL_ORIGIN")
    north = math.radians((m.lat - origin.latitude) * 1e-7) * EARTH_RADIUS_M
    shrink = math.cos(math.radians(origin.latitude * 1e-7))
    east = math.radians((m.lon - origin.longitude) * 1e-7) * EARTH_RADIUS_M * shrink
    assert (north, east) == pytest.approx((2.0, 1.0), abs=0.02)
    assert m.alt - origin.altitude == pytest.approx(3000, abs=1)
    assert m.relative_alt == 0
    assert (m.vx, m.vy, m.vz) == (20, 10, -30)
    assert m.hdg == pytest.approx(9000 - math.degrees(YAW_RAD) * 100, abs=1)


def test_home_moves_to_where_the_vehicle_is_armed(bench: Bench) -> None:
    """Home is set at boot and again by arming; relative heights follow it."""
    assert _message(bench, "HOME_POSITION").z == pytest.approx(-3.0)
    bench.vehicle.position = np.array((4.0, 5.0, 1.0))
    bench.run(0.1)
    assert _message(bench, "HOME_POSITION").z == pytest.approx(-3.0)
    assert _message(bench, "GLOBAL_POSITION_INT").relative_alt == -2000
    bench.command(400, 1)
    home = _message(bench, "HOME_POSITION")
    assert (home.x, home.y, home.z) == pytest.approx((5.0, 4.0, -1.0))
    assert home.time_usec == 600000
    assert _message(bench, "ALTITUDE").altitude_relative == pytest.approx(0.0)


def test_attitude_target_tells_the_thrust_while_armed(bench: Bench) -> None:
    """A disarmed vehicle shows PX4's idle thrust."""
    assert _message(bench, "ATTITUDE_TARGET").thrust == pytest.approx(0.001)
    bench.command(400, 1)
    m = _message(bench, "ATTITUDE_TARGET")
    assert (m.type_mask, m.thrust) == pytest.approx((0, 0.4))
    np.testing.assert_allclose(m.q, quaternion_from_euler(0.0, 0.0, math.pi / 2 - YAW_RAD), atol=1e-6)


def test_attitude_target_in_offboard_is_the_last_setpoint(bench: Bench) -> None:
    """Stamped with its time; where none comes it is silent, for good when disarmed, for half a second when armed."""
    bench.vehicle.mode = FlightMode.OFFBOARD
    assert not only(bench.run(1.0), "ATTITUDE_TARGET")
    bench.ask(dialect.MAVLink_set_attitude_target_message(0, 1, 1, 7, [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0, 0.5))
    (m,) = only(bench.run(1.0), "ATTITUDE_TARGET")
    assert m.time_boot_ms == 1500
    bench.vehicle.armed = True
    bench.ask(dialect.MAVLink_set_attitude_target_message(0, 1, 1, 7, [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0, 0.5))
    assert len(only(bench.run(0.5), "ATTITUDE_TARGET")) == 1
    late = only(bench.run(0.5), "ATTITUDE_TARGET")
    assert len(late) == pytest.approx(5, abs=1)
    assert {m.time_boot_ms for m in late} == {2500}


def test_vfr_hud_has_no_airspeed(bench: Bench) -> None:
    """There is no airspeed sensor; ground speed, climb, heading and throttle are told."""
    m = _message(bench, "VFR_HUD")
    assert math.isnan(m.airspeed)
    assert (m.groundspeed, m.climb, m.throttle) == pytest.approx((math.hypot(0.1, 0.2), 0.3, 0))
    assert m.heading == int(90.0 - math.degrees(YAW_RAD))


def test_position_target_is_told_before_take_off_only(bench: Bench) -> None:
    """Disarmed: no target, full acceleration downwards, as recorded; armed: nothing."""
    m = _message(bench, "POSITION_TARGET_LOCAL_NED")
    assert (m.type_mask, m.afz, m.coordinate_frame) == (63, 100.0, 1)
    assert math.isnan(m.x)
    bench.vehicle.armed = True
    assert only(bench.run(1.0), "POSITION_TARGET_LOCAL_NED") == []


def test_truth_is_off_until_it_is_asked_for(bench: Bench) -> None:
    """DEBUG_FLOAT_ARRAY "truth": position, velocity, attitude, force and wind in ENU and FLU, at most 100 Hz."""
    assert only(bench.run(1.0), "DEBUG_FLOAT_ARRAY") == []
    assert bench.result(511, IDS["DEBUG_FLOAT_ARRAY"], 4000.0) == 0
    received = only(bench.run(1.0), "DEBUG_FLOAT_ARRAY")
    assert len(received) == pytest.approx(100, abs=1)
    m = received[-1]
    assert (m.name, m.time_usec) == ("truth", 2500000)
    expected = [1.5, 2.5, 3.5, 0.1, 0.2, 0.3, *bench.vehicle.quaternion, 0.7, 0.8, 0.9, 5.0, 6.0, -1.0]
    np.testing.assert_allclose(m.data[:16], expected, rtol=1e-6, atol=1e-7)
    assert not any(m.data[16:])


def test_values_beyond_a_field_are_cut_instead_of_raising(bench: Bench) -> None:
    """A vehicle that falls out of the sky still reports."""
    bench.vehicle.velocity = np.array((1e4, -1e4, -1e5))
    bench.run(1.0)
    m = _message(bench, "GLOBAL_POSITION_INT")
    assert (m.vx, m.vy, m.vz) == (-32768, 32767, 32767)


@pytest.mark.parametrize("part", ["position", "quaternion"])
def test_an_estimate_that_is_not_finite_ends_no_simulation(bench: Bench, part: str) -> None:
    """Fault odometry_nan: ODOMETRY carries the NaN, messages of whole numbers cannot and are left out."""
    setattr(bench.vehicle, part, np.full(3 if part == "position" else 4, math.nan))
    names = {message.get_type() for message in bench.run(1.0)}
    assert {"ODOMETRY", "ATTITUDE", "LOCAL_POSITION_NED", "HEARTBEAT"} <= names
    assert ("GLOBAL_POSITION_INT" in names) == (part == "quaternion")
    assert ("VFR_HUD" in names) == (part == "position")


def test_a_heading_that_is_not_known_has_its_own_number(bench: Bench) -> None:
    """65535 in GLOBAL_POSITION_INT."""
    bench.vehicle.quaternion = np.full(4, math.nan)
    bench.run(0.5)
    assert _message(bench, "GLOBAL_POSITION_INT").hdg == 65535


def test_a_vehicle_far_away_or_before_its_start_still_reports(bench: Bench) -> None:
    """Fields of whole numbers are cut: positions of a GNSS that has run away, a clock that was set back."""
    bench.vehicle.position = np.array((1e9, -1e9, 1e9))
    assert "GLOBAL_POSITION_INT" in {message.get_type() for message in bench.run(0.5)}
    assert (milliseconds(-4.0), microseconds(-4.0)) == (0, 0)
