from __future__ import annotations

import hashlib
import math

import numpy as np
import pytest

from tests.sim.excitation import STILL, take_off
from tests.sim.plants import PLANTS, plant
from uasfly.errors import UasflyError
from uasfly.files import find_file, load_file
from uasfly.frames import euler_from_quaternion, quaternion_from_euler
from uasfly.messages import FlightMode
from uasfly.sim.faults import RotorSpeeds
from uasfly.sim.scenario import Scenario, Sensors
from uasfly.sim.vehicle import SimulatedVehicle
from uasfly.sim.wind.settings import ConstantWind, WindSettings

LEVEL = np.array((1.0, 0.0, 0.0, 0.0))
HOVER = 0.3436


def windy(speed_m_s: float) -> Scenario:
    """Constant wind towards the east."""
    wind = WindSettings(mean=ConstantWind(velocity_in_world_m_s=(speed_m_s, 0.0, 0.0)))
    return Scenario(name="windy", wind=wind, sensors=Sensors(position="mocap", position_noise_m=0.01))


def airborne(name: str = "f550", scenario: Scenario = STILL, seed: int = 1, settle_s: float = 3.0) -> SimulatedVehicle:
    """A vehicle in hold at 3 m."""
    vehicle = SimulatedVehicle(plant(name), scenario, seed)
    take_off(vehicle, 3.0, settle_s)
    vehicle.take_texts()
    return vehicle


def stream(vehicle: SimulatedVehicle, seconds: float, roll: float = 0.0, thrust: float = HOVER) -> None:
    """Level or rolled setpoints at 50 Hz."""
    for _ in range(round(seconds / 0.02)):
        vehicle.set_attitude_target(quaternion_from_euler(roll, 0.0, 0.0), thrust, None)
        vehicle.advance_to(vehicle.time_s + 0.02)


def words(vehicle: SimulatedVehicle) -> list[str]:
    """Texts since the last call."""
    return [text.text for text in vehicle.take_texts()]


@pytest.mark.parametrize("name", PLANTS)
def test_a_whole_flight(name: str) -> None:
    """Arm, take off, hold by itself, land, disarm by itself; in PX4's words and about PX4's time."""
    vehicle = SimulatedVehicle(plant(name, {"parameters.MIS_TAKEOFF_ALT": 3.0}), STILL, 1, (2.0, -1.0, 0.0), 1.2)
    assert vehicle.state().armed is False
    assert vehicle.arm() == (False, "Arming denied: Resolve system health failures first")
    vehicle.advance_to(4.0)
    assert vehicle.truth().position_in_world == pytest.approx([2.0, -1.0, 0.0], abs=1e-4)
    assert vehicle.arm() == (True, "")
    vehicle.advance_to(5.0)
    assert vehicle.set_mode(FlightMode.TAKEOFF) == (True, "")
    began = vehicle.time_s
    while vehicle.state().mode is FlightMode.TAKEOFF:
        vehicle.advance_to(vehicle.time_s + 0.1)
    assert vehicle.time_s - began == pytest.approx(6.0, abs=0.8)  # recording: 6.0 s
    vehicle.advance_to(vehicle.time_s + 10.0)
    truth = vehicle.truth()
    assert truth.position_in_world == pytest.approx([2.0, -1.0, 3.0], abs=0.15)
    assert euler_from_quaternion(truth.quaternion_body_to_world)[2] == pytest.approx(1.2, abs=0.05)
    assert vehicle.state().in_air
    assert vehicle.set_mode(FlightMode.LAND) == (True, "")
    began = vehicle.time_s
    while vehicle.state().armed:
        vehicle.advance_to(vehicle.time_s + 0.1)
        assert vehicle.time_s - began < 20.0
    assert vehicle.truth().position_in_world == pytest.approx([2.0, -1.0, 0.0], abs=0.2)
    assert not vehicle.state().in_air
    assert vehicle.state().mode is FlightMode.HOLD
    assert words(vehicle) == [
        "Arming denied: Resolve system health failures first",
        "Ready for takeoff!",
        "Armed by external command",
        "Using default takeoff altitude: 3.0 m",
        "Takeoff detected",
        "Landing detected",
        "Disarmed by landing",
    ]


def test_offboard_flies_what_it_is_told_and_falls_to_hold_and_comes_back() -> None:
    """The recording: refused without stream; taken with it; hold 1 s after it stops; back by itself when it resumes."""
    vehicle = airborne()
    assert vehicle.set_mode(FlightMode.OFFBOARD) == (False, "Switching to Offboard is currently not available")
    stream(vehicle, 0.1)
    assert vehicle.set_mode(FlightMode.OFFBOARD)[0]
    stream(vehicle, 0.6, roll=0.15)
    assert euler_from_quaternion(vehicle.truth().quaternion_body_to_world)[0] == pytest.approx(0.15, abs=0.01)
    assert vehicle.truth().velocity_in_world[1] < -0.3
    target = vehicle.attitude_target()
    assert target.thrust == HOVER
    assert euler_from_quaternion(target.quaternion_body_to_world) == pytest.approx((0.15, 0.0, 0.0))
    stopped = vehicle.time_s
    while vehicle.state().mode is FlightMode.OFFBOARD:
        vehicle.advance_to(vehicle.time_s + 0.004)
    assert vehicle.state().mode is FlightMode.HOLD
    assert vehicle.time_s - stopped == pytest.approx(1.0, abs=0.07)
    vehicle.advance_to(vehicle.time_s + 5.0)
    assert np.linalg.norm(vehicle.truth().velocity_in_world) < 0.1
    stream(vehicle, 0.1)
    assert vehicle.state().mode is FlightMode.OFFBOARD
    assert "Failsafe activated" in words(vehicle)


def test_take_off_by_offboard_thrust() -> None:
    """On the ground offboard arms with a stream and lifts off by thrust alone."""
    vehicle = SimulatedVehicle(plant("f550"), STILL, 1)
    vehicle.advance_to(4.0)
    assert vehicle.set_mode(FlightMode.OFFBOARD) == (True, "")
    assert not vehicle.arm()[0]
    stream(vehicle, 0.1, thrust=0.05)
    assert vehicle.arm()[0]
    stream(vehicle, 1.0, thrust=0.05)
    assert not vehicle.state().in_air
    stream(vehicle, 1.5, thrust=0.4)
    assert vehicle.state().in_air
    assert vehicle.truth().position_in_world[2] > 0.5


def test_a_setpoint_that_is_no_number_is_refused() -> None:
    """NaN, infinities and a quaternion without length raise; thrust is clipped as PX4's mixer does."""
    vehicle = SimulatedVehicle(plant("f550"), STILL, 1)
    for attitude, thrust, rate in (
        (np.array((math.nan, 0.0, 0.0, 0.0)), 0.3, 0.0),
        (np.zeros(4), 0.3, 0.0),
        (LEVEL, math.inf, 0.0),
        (LEVEL, 0.3, math.nan),
    ):
        with pytest.raises(ValueError, match="expected a finite attitude target"):
            vehicle.set_attitude_target(attitude, thrust, rate)
    vehicle.advance_to(4.0)
    assert vehicle.set_mode(FlightMode.OFFBOARD)[0]
    vehicle.set_attitude_target(3.0 * LEVEL, 1.7, None)
    assert vehicle.attitude_target().thrust == 1.0
    assert vehicle.attitude_target().quaternion_body_to_world.tolist() == LEVEL.tolist()


def fingerprint(seed: int, read_often: bool) -> str:
    """Hash of what a windy flight gives, with offboard in the middle."""
    scenario = load_file(find_file("scenario", "gusty"), Scenario)
    vehicle = SimulatedVehicle(plant("f550"), scenario, seed)
    digest = hashlib.sha256()
    take_off(vehicle, 3.0, 1.0)
    stream(vehicle, 0.1)
    assert vehicle.set_mode(FlightMode.OFFBOARD)[0]
    for step in range(100):
        vehicle.set_attitude_target(quaternion_from_euler(0.05 * math.sin(0.1 * step), 0.0, 0.0), HOVER, 0.1)
        vehicle.advance_to(vehicle.time_s + 0.02)
        if read_often:
            vehicle.odometry()
            vehicle.truth()
            vehicle.inertial()
            vehicle.gnss()
            vehicle.health()
        sample, truth = vehicle.odometry(), vehicle.truth()
        for values in (
            sample.position_in_world,
            sample.velocity_in_world,
            sample.quaternion_body_to_world,
            sample.angular_rate_in_body,
            truth.position_in_world,
            truth.force_in_world,
            truth.wind_in_world,
        ):
            digest.update(values.tobytes())
    return digest.hexdigest()


def test_the_same_seed_gives_the_same_bits_however_often_it_is_read() -> None:
    """Seed and commands decide every bit; reading samples changes none; another seed is another flight."""
    first = fingerprint(5, read_often=False)
    assert fingerprint(5, read_often=True) == first
    assert fingerprint(6, read_often=False) != first


def test_time_advances_in_whole_steps() -> None:
    """Time never passes what was asked, and never goes back."""
    vehicle = SimulatedVehicle(plant("px4_sih"), STILL, 1)
    vehicle.advance_to(0.0199)
    assert vehicle.time_s == pytest.approx(0.016)
    vehicle.advance_to(0.01)
    assert vehicle.time_s == pytest.approx(0.016)
    for _ in range(1000):
        vehicle.advance_to(vehicle.time_s + vehicle.step_s)
    assert vehicle.time_s == pytest.approx(4.016)


def test_hold_keeps_its_place_in_wind() -> None:
    """The f550's own hold stands 5 m/s of wind with a tilt that balances it, and truth tells force and wind."""
    vehicle = airborne(scenario=windy(5.0), settle_s=12.0)
    start = vehicle.truth().position_in_world
    vehicle.advance_to(vehicle.time_s + 10.0)
    truth = vehicle.truth()
    assert np.linalg.norm(truth.position_in_world - start) < 0.2
    assert truth.wind_in_world.tolist() == [5.0, 0.0, 0.0]
    assert truth.force_in_world[0] == pytest.approx(0.24 * 5.0 + 0.0155 * 25.0, rel=0.1)
    tilt = euler_from_quaternion(truth.quaternion_body_to_world)[1]
    assert math.tan(-tilt) * 9.81 == pytest.approx(truth.force_in_world[0], rel=0.15)


def test_losing_gnss_in_hold_ends_on_the_ground() -> None:
    """The recording: hold goes on for 5 s, then descend, landing and disarming; health tells all the while."""
    vehicle = airborne()
    assert vehicle.health().position_ok
    vehicle.set_gnss(False)
    assert (vehicle.health().gnss_fix, vehicle.health().gnss_satellites) == (0, 0)
    lost = vehicle.time_s
    while vehicle.state().mode is FlightMode.HOLD:
        vehicle.advance_to(vehicle.time_s + 0.1)
    assert vehicle.state().mode is FlightMode.DESCEND
    assert vehicle.time_s - lost == pytest.approx(5.1, abs=0.3)
    assert not vehicle.health().position_ok
    assert vehicle.health().attitude_ok
    while vehicle.state().armed:
        vehicle.advance_to(vehicle.time_s + 0.1)
        assert vehicle.time_s - lost < 25.0
    assert words(vehicle) == ["Failsafe activated", "Landing detected", "Disarmed by landing"]
    vehicle.set_gnss(True)
    vehicle.advance_to(vehicle.time_s + 6.0)
    assert vehicle.health().position_ok
    assert vehicle.odometry().reset_counter == 1


def test_offboard_outlives_gnss() -> None:
    """Attitude setpoints go on without a position."""
    vehicle = airborne()
    stream(vehicle, 0.1)
    assert vehicle.set_mode(FlightMode.OFFBOARD)[0]
    vehicle.set_gnss(False)
    stream(vehicle, 7.0)
    assert vehicle.state().mode is FlightMode.OFFBOARD
    assert not vehicle.health().position_ok


def test_an_empty_battery_brings_it_down() -> None:
    """At 4 % hold lasts COM_FAIL_ACT_T, then it lands; the voltage has sagged."""
    vehicle = airborne()
    fresh = vehicle.battery()
    assert fresh.remaining > 0.95
    assert fresh.voltage_v == pytest.approx(16.4, abs=0.3)
    vehicle.set_battery_charge(0.04)
    vehicle.advance_to(vehicle.time_s + 6.0)
    assert vehicle.state().mode is FlightMode.LAND
    assert vehicle.battery().voltage_v < 14.0
    assert "Emergency battery level, land immediately" in words(vehicle)


def test_less_voltage_needs_more_thrust_command() -> None:
    """Half empty the same height takes a higher thrust command."""
    commands = []
    for charge in (1.0, 0.3):
        vehicle = airborne(settle_s=1.0)
        vehicle.set_battery_charge(charge)
        vehicle.advance_to(vehicle.time_s + 8.0)
        commands.append(vehicle.attitude_target().thrust)
    assert commands[1] > 1.1 * commands[0]


def test_a_weak_motor_is_survived() -> None:
    """With one of six motors at 70 % hold goes on."""
    vehicle = airborne()
    vehicle.set_motor_effectiveness(2, 0.7)
    vehicle.advance_to(vehicle.time_s + 8.0)
    assert vehicle.state().mode is FlightMode.HOLD
    assert vehicle.truth().position_in_world == pytest.approx([0.0, 0.0, 3.0], abs=0.3)


def test_faults_refuse_and_shift() -> None:
    """Arming and offboard can be made to refuse; positions can be shifted."""
    vehicle = SimulatedVehicle(plant("f550"), STILL, 1)
    vehicle.advance_to(4.0)
    vehicle.refuse(arming=True, offboard=True)
    assert not vehicle.arm()[0]
    assert not vehicle.set_mode(FlightMode.OFFBOARD)[0]
    vehicle.refuse(arming=False, offboard=False)
    assert vehicle.arm()[0]
    vehicle.set_gnss_offset((8.0, 0.0, 0.0))
    vehicle.advance_to(4.1)
    assert vehicle.odometry().position_in_world[0] == pytest.approx(8.0, abs=0.1)


def test_rotor_speeds_are_told_where_the_scenario_says_so() -> None:
    """In whole rpm, noisy, about hover's; nil on the ground. Faults silence them, freeze them, or have one stand."""
    told = STILL.sensors.model_copy(update={"rotor_speeds": True})
    vehicle = SimulatedVehicle(plant("f550"), STILL.model_copy(update={"sensors": told}), 1)
    sample = vehicle.rotors()
    assert sample is not None
    assert sample.speeds_rad_s.tolist() == [0.0] * 6
    take_off(vehicle, 3.0, 1.0)
    rows = []
    for _ in range(50):
        vehicle.advance_to(vehicle.time_s + 0.02)
        sample = vehicle.rotors()
        assert sample is not None
        rows.append(sample.speeds_rad_s)
    rpm = np.array(rows) * 30.0 / math.pi
    np.testing.assert_allclose(rpm, np.round(rpm), atol=1e-9)
    assert np.mean(rows) == pytest.approx(509.5, rel=0.01)
    assert 0.5 < np.std(np.diff(rows, axis=0)) < 5.0
    for says in ("nothing", "zero", "frozen"):
        vehicle.inject(RotorSpeeds(kind="rotor_speeds", says=says))
        before = vehicle.rotors()
        vehicle.advance_to(vehicle.time_s + 0.02)
        after = vehicle.rotors()
        assert (before is None) is (says == "nothing")
        if before is not None and after is not None:
            assert bool(before.speeds_rad_s[0] == 0.0) is (says == "zero")
            assert (before.speeds_rad_s.tolist() == after.speeds_rad_s.tolist()) is (says == "frozen")
    assert SimulatedVehicle(plant("f550"), STILL, 1).rotors() is None


def test_changed_parameters_act_in_flight() -> None:
    """A parameter set while flying is used from then on."""
    vehicle = airborne()
    vehicle.parameters["COM_OBL_RC_ACT"] = (int, 4)
    vehicle.parameters["MPC_LAND_SPEED"] = (float, 0.4)
    stream(vehicle, 0.1)
    assert vehicle.set_mode(FlightMode.OFFBOARD)[0]
    vehicle.advance_to(vehicle.time_s + 2.5)
    assert vehicle.state().mode is FlightMode.LAND
    vehicle.advance_to(vehicle.time_s + 1.0)
    assert vehicle.truth().velocity_in_world[2] == pytest.approx(-0.4, abs=0.15)


def test_senseless_parameters_break_nothing() -> None:
    """Whatever a ground station writes into the gains, the simulation goes on with finite numbers."""
    rng = np.random.default_rng(11)
    vehicle = airborne(settle_s=0.5)
    names = [name for name, (kind, _) in vehicle.parameters.items() if kind is float]
    modes = (FlightMode.HOLD, FlightMode.RETURN, FlightMode.LAND, FlightMode.TAKEOFF)
    for _ in range(40):
        for name in rng.choice(names, 5):
            vehicle.parameters.set(str(name), float(rng.normal() * 10.0 ** rng.uniform(-3, 8)))
        vehicle.set_mode(modes[rng.choice(len(modes))])
        vehicle.advance_to(vehicle.time_s + 0.5)
        assert np.isfinite(vehicle.odometry().position_in_world).all()
        assert np.isfinite(vehicle.truth().quaternion_body_to_world).all()


@pytest.mark.parametrize(
    ("changes", "said"),
    [({"inertia_kg_m2": [1e-8, 1e-8, 1e-8]}, "f550"), ({"drag.linear_n_s_m": [1e8, 1e8, 1e8]}, "has run away")],
)
def test_a_plant_that_no_step_can_follow_ends_with_an_error(changes: dict[str, object], said: str) -> None:
    """Instead of a state of NaN, and whatever fails at it first."""
    vehicle = SimulatedVehicle(plant("f550", changes), windy(5.0), 1)
    with pytest.raises(UasflyError, match=said):
        take_off(vehicle, 3.0, 1.0)
