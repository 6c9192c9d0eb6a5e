from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from tests.observer.airframes import F550_NOISE, f550
from tests.observer.recorded import flying_observer, recording
from uasfly.airframe import GRAVITY_M_S2
from uasfly.frames import quaternion_from_euler, rotation_matrix
from uasfly.messages import (
    Array,
    AttitudeTargetSample,
    BatterySample,
    FlightMode,
    OdometrySample,
    Sample,
    Setpoint,
    StateEstimate,
    TextSample,
    VehicleSample,
)
from uasfly.observer import Observer
from uasfly.observer.step import INITIAL_FORCE_SIGMA

ZERO, LEVEL = np.zeros(3), np.array((1.0, 0.0, 0.0, 0.0))


def odometry(
    time_s: float, velocity: Array = ZERO, position: Array = ZERO, quaternion: Array = LEVEL
) -> OdometrySample:
    """A noiseless sample."""
    return OdometrySample(time_s, position, velocity, quaternion, ZERO)


def in_air(time_s: float = 0.0, flying: bool = True) -> VehicleSample:
    """The landed state."""
    return VehicleSample(time_s, FlightMode.OFFBOARD, armed=True, in_air=flying)


def setpoint(time_s: float, thrust: float) -> Setpoint:
    """A level setpoint."""
    return Setpoint(time_s, 0.0, 0.0, 0.0, 0.0, thrust)


def estimated(observer: Observer, time_s: float) -> StateEstimate:
    """The estimate, which must be there."""
    estimate = observer.estimate(time_s)
    assert estimate is not None
    return estimate


def hover(observer: Observer, start_s: float, end_s: float) -> None:
    """Samples of standing still at 100 Hz within [start_s, end_s)."""
    for k in range(round(start_s * 100), round(end_s * 100)):
        observer.add(odometry(k * 0.01))


def test_there_is_no_estimate_before_the_first_odometry() -> None:
    """Neither estimate nor covariance."""
    observer = Observer(f550())
    observer.add(in_air())
    assert observer.estimate(1.0) is None
    assert observer.moment is None
    with pytest.raises(LookupError, match="first odometry"):
        _ = observer.covariance


def test_the_first_complete_odometry_starts_the_filter() -> None:
    """With its values and the configured sigmas; one with a hole in it does not."""
    observer = Observer(f550())
    velocity, quaternion = np.array((1.0, 2.0, 3.0)), quaternion_from_euler(0.1, 0.2, 0.3)
    observer.add(OdometrySample(4.0, ZERO, velocity, quaternion, np.array((0.0, np.nan, 0.0))))
    assert observer.estimate(4.0) is None
    observer.add(OdometrySample(5.0, np.array((7.0, 8.0, 9.0)), velocity, quaternion, ZERO))
    estimate = estimated(observer, 5.0)
    np.testing.assert_allclose(estimate.position_in_world, (7.0, 8.0, 9.0))
    np.testing.assert_allclose(estimate.velocity_in_world, velocity)
    np.testing.assert_allclose(estimate.quaternion_body_to_world, quaternion)
    np.testing.assert_allclose(estimate.position_sigma_m, F550_NOISE.position_sigma_m)
    np.testing.assert_allclose(estimate.force_sigma_m_s2, INITIAL_FORCE_SIGMA)


def test_the_estimate_is_extrapolated_to_the_time_asked_for() -> None:
    """20 ms of motion, turn and acceleration after the last sample."""
    observer = Observer(f550())
    observer.add(in_air())
    observer.sent(setpoint(-1.0, 2.0 * GRAVITY_M_S2 / 28.54209), in_offboard=True)  # climbs with 1 g
    velocity, rate = np.array((2.0, 0.0, 0.0)), np.array((0.0, 0.0, 1.0))
    observer.add(OdometrySample(0.0, ZERO, velocity, LEVEL, rate))
    estimate = estimated(observer, 0.02)
    assert estimate.position_in_world[0] == pytest.approx(0.04, abs=2e-4)
    assert estimate.velocity_in_world[0] == pytest.approx(2.0 * np.exp(-0.26057 * 0.02))
    assert estimate.velocity_in_world[2] == pytest.approx(GRAVITY_M_S2 * 0.02, rel=1e-6)
    np.testing.assert_allclose(estimate.quaternion_body_to_world, quaternion_from_euler(0.0, 0.0, 0.02), atol=1e-12)
    np.testing.assert_array_equal(estimate.angular_rate_in_body, rate)
    assert estimate.time_s == 0.02


def test_a_command_moves_the_model_after_its_delay() -> None:
    """Twice the weight, sent at 0 s with 30 ms of dead time: at 50 ms it has pushed for 20 ms."""
    observer = Observer(f550())
    observer.add(in_air(-1.0))
    observer.add(odometry(0.0))
    observer.sent(setpoint(0.0, 2.0 * GRAVITY_M_S2 / 28.54209), in_offboard=True)
    assert estimated(observer, 0.03).velocity_in_world[2] == pytest.approx(0.0, abs=1e-12)
    assert estimated(observer, 0.05).velocity_in_world[2] == pytest.approx(0.02 * GRAVITY_M_S2, rel=1e-9)


def test_asking_does_not_change_the_filter() -> None:
    """An estimate between two samples leaves the next one bit for bit."""
    asked, unasked = flying_observer(2.0), flying_observer(2.0)
    for sample in recording(2.0).odometry:
        asked.add(sample)
        unasked.add(sample)
        asked.estimate(sample.time_s + 0.005)
    assert asked.moment is not None
    assert unasked.moment is not None
    np.testing.assert_array_equal(asked.moment.packed, unasked.moment.packed)


def test_an_estimate_in_the_past_comes_from_the_past() -> None:
    """A time before the newest sample is answered from the moment before it."""
    observer = Observer(f550())
    for k in range(20):
        observer.add(odometry(0.01 * k, velocity=np.array((1.0, 0.0, 0.0)), position=np.array((0.01 * k, 0.0, 0.0))))
    assert estimated(observer, 0.105).position_in_world[0] == pytest.approx(0.105, abs=0.002)


def test_on_the_ground_there_is_no_force() -> None:
    """Without thrust the vehicle does not fall, the force stays zero with its prior sigma, the velocity is fused."""
    observer = Observer(f550())
    observer.add(in_air(flying=False))
    observer.sent(setpoint(0.0, 0.0), in_offboard=True)
    for k in range(200):
        observer.add(odometry(0.01 * k, velocity=np.array((0.02, 0.0, 0.0))))
    estimate = estimated(observer, 2.0)
    assert np.all(estimate.force_in_world == 0.0)
    np.testing.assert_allclose(estimate.force_sigma_m_s2, INITIAL_FORCE_SIGMA)
    assert estimate.velocity_in_world[0] == pytest.approx(0.02, abs=0.005)
    assert abs(estimate.velocity_in_world[2]) < 1e-6
    assert observer.counters.rejected == dict.fromkeys(observer.counters.rejected, 0)


def test_the_force_is_learnt_after_take_off_and_forgotten_after_landing() -> None:
    """Held up by 0.5 m/s^2 less thrust than weight: the wind lifts."""
    observer = Observer(f550())
    observer.add(in_air(0.0, flying=False))
    observer.sent(setpoint(-1.0, (GRAVITY_M_S2 - 0.5) / 28.54209), in_offboard=True)
    hover(observer, 0.0, 1.0)
    observer.add(in_air(1.0))
    hover(observer, 1.0, 4.0)
    flying = estimated(observer, 4.0)
    assert flying.force_in_world[2] == pytest.approx(0.5, abs=0.01)
    assert flying.force_sigma_m_s2[2] < 0.5
    observer.add(in_air(4.0, flying=False))
    hover(observer, 4.0, 4.1)
    landed = estimated(observer, 4.1)
    assert np.all(landed.force_in_world == 0.0)
    np.testing.assert_allclose(landed.force_sigma_m_s2, INITIAL_FORCE_SIGMA)


def test_an_older_landed_state_does_not_undo_a_newer_one() -> None:
    """Heartbeats may come out of order."""
    observer = Observer(f550())
    observer.add(in_air(2.0))
    observer.add(in_air(1.0, flying=False))
    observer.sent(setpoint(-1.0, (GRAVITY_M_S2 - 0.5) / 28.54209), in_offboard=True)
    hover(observer, 2.0, 5.0)
    assert estimated(observer, 5.0).force_in_world[2] == pytest.approx(0.5, abs=0.01)


def test_before_take_over_px4s_own_commands_drive_the_model() -> None:
    """The force is known when offboard begins: with attitude targets first, then our own setpoints, nothing moves."""
    observer, thrust = Observer(f550()), (GRAVITY_M_S2 - 0.5) / 28.54209
    observer.add(in_air())
    for k in range(60):
        if k % 10 == 0:
            observer.add(AttitudeTargetSample(0.1 * k, LEVEL, thrust))
        observer.sent(setpoint(0.1 * k, 0.9), in_offboard=False)  # what we would command is not obeyed yet
        hover(observer, 0.1 * k, 0.1 * (k + 1))
    before = estimated(observer, 6.0).force_in_world[2]
    assert before == pytest.approx(0.5, abs=0.01)
    for k in range(60, 80):
        observer.sent(setpoint(0.1 * k, thrust), in_offboard=True)
        observer.add(AttitudeTargetSample(0.1 * k, LEVEL, 0.9))  # nonsense: in offboard it is only our own echo
        hover(observer, 0.1 * k, 0.1 * (k + 1))
        assert estimated(observer, 0.1 * (k + 1)).force_in_world[2] == pytest.approx(before, abs=0.01)


def test_a_lower_k_thrust_explains_a_sagging_battery() -> None:
    """10 % less thrust per command, told to the observer: no force is needed to explain the higher command."""
    forces = []
    for told in (True, False):
        observer = Observer(f550())
        observer.add(in_air())
        if told:
            observer.set_k_thrust(0.9 * 28.54209)
        observer.sent(setpoint(-1.0, GRAVITY_M_S2 / (0.9 * 28.54209)), in_offboard=True)
        hover(observer, 0.0, 3.0)
        forces.append(estimated(observer, 3.0).force_in_world[2])
    assert forces[0] == pytest.approx(0.0, abs=0.01)
    assert forces[1] == pytest.approx(-GRAVITY_M_S2 / 9.0, abs=0.02)


def test_corrected_thrust_goes_into_the_force_and_nothing_else_moves() -> None:
    """10 % less, hovering against wind: the force follows at once, along the thrust, and stays; so does all else."""
    tilted, observers, k_thrust = quaternion_from_euler(0.1, -0.2, 0.7), [], 28.54209
    along = rotation_matrix(tilted)[:, 2]
    for corrected in (False, True):
        observer = Observer(f550())
        observers.append(observer)
        observer.add(in_air())
        observer.sent(setpoint(-1.0, 0.37), in_offboard=True)
        for k in range(250):
            if corrected and k == 200:
                before = estimated(observer, 1.99)
                observer.correct_thrust(0.9)
                observer.set_k_thrust(0.9 * k_thrust)
                after = estimated(observer, 1.99)
            if k == 210:
                observer.sent(setpoint(2.1, 0.37), in_offboard=True)
            if k not in (190, 200):
                observer.add(odometry(0.01 * k, quaternion=tilted))
            if k in (202, 205):  # late ones, from before the correction and after it
                observer.add(odometry(1.9 if k == 202 else 2.0, quaternion=tilted))
    shift = 0.1 * 0.37 * k_thrust * along
    assert after.force_in_world - before.force_in_world == pytest.approx(shift, abs=1e-4)
    plain, corrected_ = (estimated(observer, 2.52) for observer in observers)
    for name in ("position_in_world", "velocity_in_world", "quaternion_body_to_world"):
        assert getattr(corrected_, name) == pytest.approx(getattr(plain, name), abs=1e-6)
        assert getattr(after, name) == pytest.approx(getattr(before, name), abs=1e-12)
    assert corrected_.force_in_world - plain.force_in_world == pytest.approx(shift, abs=1e-3)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -1.0, 0.0])
def test_a_k_thrust_that_cannot_be_is_refused(bad: float) -> None:
    """And counted."""
    observer = Observer(f550())
    observer.set_k_thrust(bad)
    assert observer.counters.non_finite == 1


def test_what_is_not_finite_stays_outside_and_is_counted() -> None:
    """Setpoints, attitude targets, landed states, odometry: the filter goes on with finite numbers."""
    observer = flying_observer(2.0)
    flight = recording(2.0)
    for k, sample in enumerate(flight.odometry):
        observer.add(sample)
        if k == 100:
            observer.sent(setpoint(np.nan, 0.3), in_offboard=True)
            observer.sent(setpoint(1.0, np.nan), in_offboard=True)
            observer.add(AttitudeTargetSample(-5.0, LEVEL, np.inf))
            observer.add(VehicleSample(np.nan, FlightMode.LAND, armed=True, in_air=False))
            observer.add(dataclasses.replace(sample, time_s=np.nan))
            observer.add(dataclasses.replace(sample, time_s=1.003, position_in_world=np.full(3, np.nan)))
            observer.add(dataclasses.replace(flight.sightings[0], covariance=np.full((6, 6), np.nan)))
    assert observer.counters.non_finite == 7
    estimate = estimated(observer, flight.duration_s)
    assert all(np.all(np.isfinite(getattr(estimate, field.name))) for field in dataclasses.fields(estimate))
    np.testing.assert_allclose(estimate.position_in_world, flight.position[-1], atol=0.03)
    assert observer.estimate(np.nan) is None


def test_samples_that_say_nothing_of_the_state_are_ignored() -> None:
    """Battery, texts."""
    observer = Observer(f550())
    observer.add(odometry(0.0))
    before = observer.moment
    observer.add(BatterySample(0.0, 15.0, 0.9))
    observer.add(TextSample(0.0, 6, "hello"))
    assert observer.moment is before


def test_statistics_tell_the_last_innovation_of_each_sensor() -> None:
    """Normalised innovation squared and its degrees of freedom."""
    flight, observer = recording(2.0), flying_observer(2.0)
    samples: list[Sample] = [*flight.odometry, *flight.sightings[-2:]]
    for sample in samples:
        observer.add(sample)
    assert {name: dof for name, (_, dof) in observer.statistics.items()} == {
        "attitude": 3,
        "position": 3,
        "velocity": 3,
        "marker": 6,
    }
    assert all(0.0 < value < 30.0 for value, _ in observer.statistics.values())


def test_silence_of_five_seconds_without_a_question_gives_no_estimate() -> None:
    """Nobody predicts a process that was asleep."""
    observer = Observer(f550())
    observer.add(odometry(0.0))
    assert observer.estimate(4.0) is not None
    observer = Observer(f550())
    observer.add(odometry(0.0))
    assert observer.estimate(60.0) is None
