"""PX4's own telemetry: the excitation flight of its SIH quad, in still air, with roll, pitch and thrust doublets."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from tests.data import test_data
from tests.observer.airframes import f550
from uasfly.airframe import Airframe
from uasfly.frames import swap_enu_ned, swap_flu_frd, swap_quaternion_enu_ned
from uasfly.messages import (
    AccelerometerSample,
    Array,
    AttitudeTargetSample,
    FlightMode,
    OdometrySample,
    Sample,
    VehicleSample,
)
from uasfly.observer import Observer
from uasfly.observer import states as s
from uasfly.sim.scenario import Sensors

BIAS = np.array((0.1, -0.1, 0.0))  # m/s^2
EVERY = 5  # reading is told: PX4's 50 Hz of 250


def sih_quad(**noise: float) -> Airframe:
    """The recording's true parameters; a dead time of 40 ms stands for the lag of its motors (50 ms)."""
    # as in calm.yaml, which follows PX4's simulator
    airframe = f550(force_density=0.5, velocity_wander_m_s=0.01, **noise)
    parameters = {"k_thrust_m_s2": 20.0, "drag_1_s": (1.0, 1.0, 1.0), "command_delay_s": 0.04}
    return airframe.model_copy(update={"model": airframe.model.model_copy(update=parameters)})


def columns(data: dict[str, Array], names: tuple[str, ...]) -> Array:
    """Fields of a ULog topic as columns."""
    return np.stack([np.asarray(data[name], dtype=np.float64) for name in names], axis=1)


@lru_cache(maxsize=1)
def topics_of_the_recording() -> dict[str, dict[str, Array]]:
    """First instance of each topic."""
    pyulog = pytest.importorskip("pyulog")
    log = pyulog.ULog(str(test_data("px4_recordings/excitation.ulg")))
    return {data.name: data.data for data in log.data_list if data.multi_id == 0}


def readings_of_the_recording() -> tuple[Array, Array]:
    """Times (n,) [s] and specific forces (n, 3) [m/s^2], FLU, at 250 Hz."""
    combined = topics_of_the_recording()["sensor_combined"]
    readings = columns(combined, tuple(f"accelerometer_m_s2[{axis}]" for axis in range(3)))
    return combined["timestamp"] * 1e-6, readings * (1.0, -1.0, -1.0)


def samples_of_the_recording() -> list[Sample]:
    """Odometry at the estimator's rate, what its attitude controller was asked for, and the landed state, in order."""
    topics = topics_of_the_recording()
    local, attitude = topics["vehicle_local_position"], topics["vehicle_attitude"]
    gyro, target = topics["vehicle_angular_velocity"], topics["vehicle_attitude_setpoint"]
    attitude_s = attitude["timestamp_sample"] * 1e-6
    quaternions = columns(attitude, ("q[0]", "q[1]", "q[2]", "q[3]"))
    position, velocity = columns(local, ("x", "y", "z")), columns(local, ("vx", "vy", "vz"))
    rates, rates_s = columns(gyro, ("xyz[0]", "xyz[1]", "xyz[2]")), gyro["timestamp_sample"] * 1e-6
    local_s = local["timestamp_sample"] * 1e-6
    nearest = np.minimum(np.searchsorted(attitude_s, local_s - 1e-3), len(attitude_s) - 1)
    rate = np.stack([np.interp(local_s, rates_s, rates[:, axis]) for axis in range(3)], axis=1)
    samples: list[Sample] = []
    for k, time_s in enumerate(local_s.tolist()):
        samples.append(
            OdometrySample(
                time_s,
                swap_enu_ned(position[k]),
                swap_enu_ned(velocity[k]),
                swap_quaternion_enu_ned(quaternions[nearest[k]]),
                swap_flu_frd(rate[k]),
            )
        )
    level = np.array((1.0, 0.0, 0.0, 0.0))
    for time_us, thrust in zip(target["timestamp"].tolist(), target["thrust_body[2]"].tolist(), strict=True):
        samples.append(AttitudeTargetSample(time_us * 1e-6, level, -thrust))
    landed = topics["vehicle_land_detected"]
    for time_us, on_ground in zip(landed["timestamp"].tolist(), landed["landed"].tolist(), strict=True):
        samples.append(VehicleSample(time_us * 1e-6, FlightMode.HOLD, armed=True, in_air=not on_ground))
    return sorted(samples, key=lambda sample: sample.time_s)


def test_in_still_air_px4s_flight_needs_no_force() -> None:
    """Doublets in thrust and tilt, model right, no wind: the force stays small and nearly every sample is accepted."""
    samples, observer = samples_of_the_recording(), Observer(sih_quad())
    first_s, last_s = samples[0].time_s, samples[-1].time_s
    forces, count = [], 0
    for sample in samples:
        observer.add(sample)
        if isinstance(sample, OdometrySample):
            count += 1
            if first_s + 40.0 < sample.time_s < last_s - 25.0:  # in the air, after take-off and before landing
                estimate = observer.estimate(sample.time_s)
                assert estimate is not None
                forces.append(estimate.force_in_world)
    rms = np.sqrt(np.mean(np.square(forces), axis=0))
    assert np.all(rms[:2] < 0.04)
    assert rms[2] < 0.12
    assert sum(observer.counters.rejected.values()) < 0.02 * count
    assert observer.counters.late == observer.counters.dropped == observer.counters.non_finite == 0


def test_px4s_accelerometer_agrees_with_its_motion() -> None:
    """The same flight, with 0.1 m/s^2 of bias put in: it is found, innovations are as large as the filter says.

    Still air: the force stays small, at 40 % of the sigma that velocity and attitude alone leave.
    """
    times, readings = readings_of_the_recording()
    told = readings[::EVERY] + BIAS
    felt = [AccelerometerSample(time_s, one) for time_s, one in zip(times[::EVERY].tolist(), told, strict=True)]
    samples = sorted([*samples_of_the_recording(), *felt], key=lambda sample: sample.time_s)
    observer, alone = Observer(sih_quad(accelerometer_sigma_m_s2=0.05)), Observer(sih_quad())
    first_s, last_s = samples[0].time_s, samples[-1].time_s
    forces, innovations = [], []
    for sample in samples:
        observer.add(sample)
        if not first_s + 40.0 < sample.time_s < last_s - 25.0:
            continue
        if isinstance(sample, AccelerometerSample):
            innovations.append(observer.statistics[s.ACCELEROMETER_SENSOR][0])
        elif isinstance(sample, OdometrySample):
            estimate = observer.estimate(sample.time_s)
            assert estimate is not None
            forces.append(estimate.force_in_world)
            alone.add(sample)
            bias, sigma = observer.accelerometer_bias, estimate.force_sigma_m_s2[0]
    np.testing.assert_allclose(bias, BIAS[:2], atol=0.03)
    assert np.mean(innovations) == pytest.approx(2.0, rel=0.3)  # of two degrees of freedom
    assert np.all(np.sqrt(np.mean(np.square(forces), axis=0))[:2] < 0.07)
    assert sigma < 0.4 * np.sqrt(alone.covariance[9, 9])
    assert observer.counters.rejected[s.ACCELEROMETER_SENSOR] < 0.01 * len(innovations)


def test_the_simulated_accelerometer_is_as_noisy_as_px4s() -> None:
    """Standard deviation of a reading at rest, within a tenth, along each axis."""
    noise = readings_of_the_recording()[1][:1000].std(axis=0)
    simulated = Sensors(position="mocap", position_noise_m=0.01).accelerometer_noise_m_s2
    np.testing.assert_allclose(simulated, noise, rtol=0.1)
