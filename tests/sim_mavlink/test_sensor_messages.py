import math

import pytest

from tests.sim_mavlink.bench import Bench, only
from uasfly.files import find_file, load_file
from uasfly.sim.faults import GnssDegraded
from uasfly.sim.mavlink.sensor_messages import pressure_of_altitude_hpa
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
