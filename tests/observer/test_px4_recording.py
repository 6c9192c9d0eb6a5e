"""PX4's own telemetry: the excitation flight of its SIH quad, in still air, with roll, pitch and thrust doublets."""

from __future__ import annotations

import numpy as np
import pytest

from tests.data import test_data
from tests.observer.airframes import f550
from uasfly.airframe import Airframe
from uasfly.frames import swap_enu_ned, swap_flu_frd, swap_quaternion_enu_ned
from uasfly.messages import Array, AttitudeTargetSample, FlightMode, OdometrySample, Sample, VehicleSample
from uasfly.observer import Observer


def sih_quad() -> Airframe:
    """The recording's true parameters; a dead time of 40 ms stands for the lag of its motors (50 ms)."""
    airframe = f550(force_density=0.5, velocity_wander_m_s=0.01)  # as in calm.yaml, which follows PX4's simulator
    parameters = {"k_thrust_m_s2": 20.0, "drag_1_s": (1.0, 1.0, 1.0), "command_delay_s": 0.04}
    return airframe.model_copy(update={"model": airframe.model.model_copy(update=parameters)})


def columns(data: dict[str, Array], names: tuple[str, ...]) -> Array:
    """Fields of a ULog topic as columns."""
    return np.stack([np.asarray(data[name], dtype=np.float64) for name in names], axis=1)


def samples_of_the_recording() -> list[Sample]:
    """Odometry at the estimator's rate, what its attitude controller was asked for, and the landed state, in order."""
    pyulog = pytest.importorskip("pyulog")
    log = pyulog.ULog(str(test_data("px4_recordings/excitation.ulg")))
    topics = {data.name: data.data for data in log.data_list if data.multi_id == 0}
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
