import math
import struct

import numpy as np
import pytest
from pymavlink.dialects.v20 import development as dialect

from tests.sim_mavlink.bench import Bench, only
from uasfly.files import find_file, load_file
from uasfly.sim.faults import GnssDegraded
from uasfly.sim.mavlink.sensor_messages import ESC_STATUS_ID, pressure_of_altitude_hpa
from uasfly.sim.plant import Plant
from uasfly.sim.scenario import Scenario
from uasfly.sim.vehicle import SimulatedVehicle


def test_the_inertial_unit_is_told_in_frd() -> None:
    """At rest z shows -9.8: forward stays, left becomes right, up becomes down."""
    received = only(Bench().run(4.0), "HIGHRES_IMU")
    assert len(received) == pytest.approx(200, abs=3)
    m = received[-1]
    assert m.time_usec == 4000000
    assert (m.xacc, m.yacc, m.zacc) == pytest.approx((0.1, -0.2, -9.8))
    assert (m.xgyro, m.ygyro, m.zgyro) == pytest.approx((0.3, -0.4, -0.5))
    assert (m.xmag, m.ymag, m.zmag) == pytest.approx((0.2, -0.1, 0.4))
    assert (m.pressure_alt, m.temperature, m.fields_updated) == pytest.approx((489.666, 15.0, 7167))


def test_pressure_belongs_to_altitude_as_recorded() -> None:
    """The recording has 955.79 hPa at 489.666 m; both barometer messages say so."""
    assert pressure_of_altitude_hpa(489.666) == pytest.approx(955.79, abs=0.01)
    messages = Bench().run(4.0)
    assert only(messages, "HIGHRES_IMU")[-1].abs_pressure == pytest.approx(955.79, abs=0.01)
    scaled = only(messages, "SCALED_PRESSURE")
    assert len(scaled) == pytest.approx(4, abs=1)
    assert scaled[-1].press_abs == pytest.approx(955.79, abs=0.01)
    assert pressure_of_altitude_hpa(1e6) == 0.0


def test_gnss_reports_the_fix_eight_times_a_second() -> None:
    """Position, height above the sea, speed and course over ground, accuracies in millimetres."""
    received = only(Bench().run(4.0), "GPS_RAW_INT")
    assert len(received) == pytest.approx(32, abs=1)
    m = received[-1]
    assert (m.fix_type, m.satellites_visible, m.h_acc, m.v_acc) == (3, 10, 900, 1780)
    assert (m.lat, m.lon, m.alt, m.alt_ellipsoid) == (475000000, -82500000, 492400, 492400)
    assert m.vel == int(math.sqrt(0.1**2 + 0.2**2 + 0.3**2) * 100)
    assert m.cog == pytest.approx(math.degrees(math.atan2(0.1, 0.2)) * 100, abs=1)


def test_lost_gnss_leaves_an_empty_message_once_a_second() -> None:
    """As recorded: fix type 0, everything else unknown, at 1 Hz."""
    bench = Bench()
    bench.run(1.0)
    bench.vehicle.gnss_available = False
    received = only(bench.run(4.0), "GPS_RAW_INT")
    assert len(received) == pytest.approx(4, abs=1)
    m = received[-1]
    assert (m.fix_type, m.lat, m.satellites_visible, m.eph, m.vel) == (0, 0, 255, 65535, 65535)


def test_a_receiver_that_knows_nothing_still_reports() -> None:
    """Fault gnss_degraded: an accuracy beyond the field's millimetres is cut."""
    plant, scenario = load_file(find_file("plant", "f550"), Plant), load_file(find_file("scenario", "calm"), Scenario)
    vehicle = SimulatedVehicle(plant, scenario, 1)
    vehicle.inject(GnssDegraded(kind="gnss_degraded", accuracy_m=1e8, satellites=0))
    message = only(Bench(vehicle=vehicle).run(0.5), "GPS_RAW_INT")[-1]
    assert message.h_acc == 0xFFFFFFFF


def test_rotor_speeds_come_in_fours_when_they_are_asked_for() -> None:
    """Six rotors: two messages of one time, filled up with zeros; from a vehicle that does not tell them, none."""
    bench = Bench()
    bench.command(dialect.MAV_CMD_SET_MESSAGE_INTERVAL, ESC_STATUS_ID, 20000.0)
    assert not rotor_payloads(bench, 0.2)
    bench.vehicle.rotor_speeds = np.array((1000.0, 1001.0, 1002.0, 1003.0, 1004.0, 1005.0)) * 2.0 * math.pi / 60.0
    received = rotor_payloads(bench, 1.0)
    assert len(received) == pytest.approx(100, abs=4)
    (time_us, *first), (same_us, *second) = received[-2:]
    assert time_us == same_us
    assert first == [1000, 1001, 1002, 1003, *(0.0,) * 8, 0]
    assert second == [1004, 1005, 0, 0, *(0.0,) * 8, 4]


def rotor_payloads(bench: Bench, duration_s: float) -> list[tuple[float, ...]]:
    """Fields of ESC_STATUS in the order of the wire; pymavlink does not know the message."""
    found = []
    for _ in range(round(duration_s / bench.vehicle.step_s)):
        bench.vehicle.advance_to(bench.vehicle.time_s + bench.vehicle.step_s)
        for message in bench.endpoint.poll():
            if message.get_msgId() == ESC_STATUS_ID:
                payload = bytes(message.pack(dialect.MAVLink(None, 1, 1)))[10:-2]
                found.append(struct.unpack("<Q4i8fB", payload.ljust(57, b"\0")))
    return found
