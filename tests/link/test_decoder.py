"""Messages of the vehicle as samples: frames, missing values, states that several messages make up, PX4's recording."""

from __future__ import annotations

import json
import math
import struct
from collections import Counter
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.data import test_data
from tests.link.fake_vehicle import mavlink
from uasfly.frames import quaternion_from_euler, rotation_matrix
from uasfly.link.clock import ClockMap
from uasfly.link.decoder import Decoder
from uasfly.link.motion import odometry_sample
from uasfly.messages import (
    AttitudeTargetSample,
    BatterySample,
    FlightMode,
    HealthSample,
    OdometrySample,
    Sample,
    TextSample,
    TruthSample,
    VehicleSample,
)

ENU_TO_NED = np.array(((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, -1.0)))
FRD_TO_FLU = np.diag((1.0, -1.0, -1.0))


def odometry(**changed: Any) -> dict[str, Any]:
    """ODOMETRY as mavlink_direct delivers it."""
    fields: dict[str, Any] = {"time_usec": 12_500_000, "frame_id": 1, "child_frame_id": 1, "reset_counter": 3}
    fields.update({"x": 1.0, "y": 2.0, "z": -3.0, "q": [1.0, 0.0, 0.0, 0.0], "vx": 0.1, "vy": 0.2, "vz": 0.3})
    fields.update({"rollspeed": 0.01, "pitchspeed": 0.02, "yawspeed": 0.03})
    return fields | changed


def heartbeat(main: int, sub: int = 0, armed: bool = False) -> str:
    """HEARTBEAT of an autopilot."""
    return json.dumps({"custom_mode": main << 16 | sub << 24, "base_mode": 129 if armed else 1, "autopilot": 12})


def battery(**changed: Any) -> str:
    """BATTERY_STATUS that knows nothing but what is given."""
    fields: dict[str, Any] = {"id": 0, "voltages": [65535] * 10, "voltages_ext": [0] * 4, "battery_remaining": -1}
    return json.dumps(fields | changed)


def make() -> Decoder:
    """A decoder that is not synchronised: samples carry arrival times."""
    return Decoder(ClockMap())


@settings(deadline=None)
@given(
    attitude=st.tuples(st.floats(-1.2, 1.2), st.floats(-1.2, 1.2), st.floats(-3.1, 3.1)),
    velocity=st.tuples(*[st.floats(-20.0, 20.0)] * 3),
)
def test_odometry_is_turned_into_enu_and_flu(
    attitude: tuple[float, float, float], velocity: tuple[float, float, float]
) -> None:
    """Against matrices: positions by T, attitudes by T R S; one velocity whether it is sent in NED or in body axes."""
    quaternion = quaternion_from_euler(*attitude)  # of FRD in NED
    to_ned = rotation_matrix(quaternion)
    in_body = to_ned.T @ np.array(velocity)
    names = ("vx", "vy", "vz")
    world = odometry_sample(odometry(q=quaternion.tolist(), **dict(zip(names, velocity, strict=True))), 1.0)
    body = odometry_sample(
        odometry(q=quaternion.tolist(), child_frame_id=12, **dict(zip(names, in_body.tolist(), strict=True))), 1.0
    )
    assert world is not None
    assert body is not None
    np.testing.assert_allclose(world.position_in_world, (2.0, 1.0, 3.0))
    np.testing.assert_allclose(world.velocity_in_world, ENU_TO_NED @ velocity, atol=1e-12)
    np.testing.assert_allclose(body.velocity_in_world, ENU_TO_NED @ velocity, atol=1e-9)
    np.testing.assert_allclose(world.angular_rate_in_body, (0.01, -0.02, -0.03))
    rotation = rotation_matrix(world.quaternion_body_to_world)
    np.testing.assert_allclose(rotation, ENU_TO_NED @ to_ned @ FRD_TO_FLU, atol=1e-12)


@pytest.mark.parametrize("field", ["x", "vy", "yawspeed"])
def test_a_missing_number_drops_the_odometry_and_is_counted(field: str) -> None:
    """NaN and Inf arrive as null."""
    decoder = make()
    assert decoder.decode("ODOMETRY", json.dumps(odometry(**{field: None})), 1.0) is None
    assert decoder.decode("ODOMETRY", json.dumps(odometry()), 1.0) is not None
    assert decoder.dropped == {"ODOMETRY": 1}


@pytest.mark.parametrize("q", [[1.0, 0.0, None, 0.0], [0.0, 0.0, 0.0, 0.0], [2.0, 0.0, 0.0, 0.0]])
def test_an_impossible_attitude_is_dropped(q: list[float | None]) -> None:
    """Missing numbers and norms that are not 1, in every message that carries one."""
    decoder = make()
    assert decoder.decode("ODOMETRY", json.dumps(odometry(q=q)), 1.0) is None
    target = json.dumps({"time_boot_ms": 1, "q": q, "thrust": 0.5})
    assert decoder.decode("ATTITUDE_TARGET", target, 1.0) is None
    assert decoder.dropped == {"ODOMETRY": 1, "ATTITUDE_TARGET": 1}


def test_positions_in_another_frame_are_dropped() -> None:
    """LOCAL_FRD (20) has an unknown heading: no world position can be made of it."""
    assert odometry_sample(odometry(frame_id=20), 1.0) is None


@pytest.mark.parametrize("text", ["{", "{}", "[]", "null", '{"id": "x"}'])
def test_malformed_messages_are_counted_and_end_nothing(text: str) -> None:
    """Whatever arrives, no exception leaves the decoder."""
    decoder = make()
    names = [name for name in decoder.names if name != "STATUSTEXT"]
    for name in names:
        assert decoder.decode(name, text, 1.0) is None
    assert sum(decoder.dropped.values()) == len(names)


def test_samples_carry_mapped_times() -> None:
    """ODOMETRY in microseconds, ATTITUDE_TARGET in milliseconds, the rest by arrival."""
    clock = ClockMap()
    clock.exchange(1000.0, 10.0, 1000.0)
    decoder = Decoder(clock)
    sample = decoder.decode("ODOMETRY", json.dumps(odometry()), 1002.51)
    assert isinstance(sample, OdometrySample)
    assert sample.time_s == pytest.approx(1002.5)
    target = decoder.decode("ATTITUDE_TARGET", '{"time_boot_ms":12400,"q":[1,0,0,0],"thrust":0.4}', 1002.51)
    assert isinstance(target, AttitudeTargetSample)
    assert target.time_s == pytest.approx(1002.4)
    assert target.thrust == 0.4
    state = decoder.decode("HEARTBEAT", heartbeat(4, 3), 1002.6)
    assert state == VehicleSample(1002.6, FlightMode.HOLD, False, False)


def test_mode_arming_and_landed_state_make_one_picture() -> None:
    """Changes are told at once, repetitions are not; the time stays the last heartbeat's."""
    decoder = make()
    assert decoder.decode("EXTENDED_SYS_STATE", '{"landed_state":2}', 1.0) is None  # no heartbeat yet
    assert decoder.decode("HEARTBEAT", heartbeat(4, 3, armed=True), 2.0) == VehicleSample(
        2.0, FlightMode.HOLD, True, True
    )
    assert decoder.decode("EXTENDED_SYS_STATE", '{"landed_state":4}', 2.1) is None
    assert decoder.decode("EXTENDED_SYS_STATE", '{"landed_state":0}', 2.2) is None  # undefined
    mode = json.dumps({"custom_mode": 6 << 16})
    assert decoder.decode("CURRENT_MODE", mode, 2.3) == VehicleSample(2.0, FlightMode.OFFBOARD, True, True)
    assert decoder.decode("CURRENT_MODE", mode, 2.4) is None
    landed = decoder.decode("EXTENDED_SYS_STATE", '{"landed_state":1}', 2.5)
    assert landed == VehicleSample(2.0, FlightMode.OFFBOARD, True, False)


@pytest.mark.parametrize(
    ("flags", "position", "velocity", "attitude"),
    [
        (1023, True, True, True),
        (895, True, True, True),
        (869, False, False, True),
        (101, False, False, True),
        (0, False, False, False),
    ],
)
def test_px4s_estimator_flags(flags: int, position: bool, velocity: bool, attitude: bool) -> None:
    """As recorded: at rest (1023), in flight (895), four seconds after the loss of GNSS (869, then 101)."""
    fields = {"time_usec": 1, "flags": flags, "pos_horiz_accuracy": 0.29}
    health = make().decode("ESTIMATOR_STATUS", json.dumps(fields), 1.0)
    assert isinstance(health, HealthSample)
    assert (health.position_ok, health.velocity_ok, health.attitude_ok) == (position, velocity, attitude)
    assert health.horizontal_accuracy_m == 0.29


def test_a_lost_fix_is_told_at_once() -> None:
    """GPS_RAW_INT makes a sample when the fix changes, once the estimator is heard; 255 satellites means unknown."""
    decoder = make()
    assert decoder.decode("GPS_RAW_INT", '{"fix_type":3,"satellites_visible":10}', 1.0) is None
    decoder.decode("ESTIMATOR_STATUS", '{"time_usec":1,"flags":895,"pos_horiz_accuracy":null}', 1.1)
    assert decoder.decode("GPS_RAW_INT", '{"fix_type":3,"satellites_visible":9}', 1.2) is None
    lost = decoder.decode("GPS_RAW_INT", '{"fix_type":0,"satellites_visible":255}', 1.3)
    assert isinstance(lost, HealthSample)
    assert (lost.gnss_fix, lost.gnss_satellites) == (0, 0)
    assert math.isnan(lost.horizontal_accuracy_m)


def test_battery_voltage_is_the_sum_of_its_cells() -> None:
    """Whole voltage in the first cell, single cells, more than ten cells, unknown charge, no voltage at all."""
    decoder = make()
    whole = decoder.decode("BATTERY_STATUS", battery(voltages=[16173] + [65535] * 9, battery_remaining=99), 1.0)
    assert isinstance(whole, BatterySample)
    assert whole.time_s == 1.0
    assert (whole.voltage_v, whole.remaining) == pytest.approx((16.173, 0.99))
    cells = decoder.decode("BATTERY_STATUS", battery(voltages=[4000] * 10, voltages_ext=[4100, 4100, 0, 0]), 1.0)
    assert isinstance(cells, BatterySample)
    assert cells.voltage_v == pytest.approx(48.2)
    assert math.isnan(cells.remaining)
    assert decoder.decode("BATTERY_STATUS", battery(id=1, voltages=[12000] + [65535] * 9), 1.0) is None
    assert decoder.dropped == {}
    assert decoder.decode("BATTERY_STATUS", battery(), 1.0) is None
    assert decoder.dropped == {"BATTERY_STATUS": 1}


def test_geographic_truth_is_relative_to_the_estimators_origin() -> None:
    """A point 100 m north and 50 m east of the origin, 3 m above it, flying north-east and down."""
    decoder = make()
    state = {
        "time_usec": 1,
        "attitude_quaternion": [1.0, 0.0, 0.0, 0.0],
        "vx": 100,
        "vy": 200,
        "vz": 50,
        "alt": 491_000,
    }
    state |= {"lat": 473_977_420 + 8993, "lon": 85_455_940 + 6643}
    assert decoder.decode("HIL_STATE_QUATERNION", json.dumps(state), 1.0) is None
    decoder.decode("GPS_GLOBAL_ORIGIN", '{"latitude":473977420,"longitude":85455940,"altitude":488000}', 1.0)
    truth = decoder.decode("HIL_STATE_QUATERNION", json.dumps(state), 1.0)
    assert isinstance(truth, TruthSample)
    np.testing.assert_allclose(truth.position_in_world, (50.0, 100.0, 3.0), atol=0.02)
    np.testing.assert_allclose(truth.velocity_in_world, (2.0, 1.0, -0.5))
    assert np.isnan(truth.force_in_world).all()
    assert np.isnan(truth.wind_in_world).all()


def test_other_debug_arrays_are_no_truth() -> None:
    """Nor are they counted as losses; a truth that is not finite is not passed on."""
    decoder = make()
    data = [0.0] * 58
    data[6] = 1.0
    other = {"time_usec": 1, "name": "flow", "data": data}
    assert decoder.decode("DEBUG_FLOAT_ARRAY", json.dumps(other), 1.0) is None
    truth = decoder.decode("DEBUG_FLOAT_ARRAY", json.dumps(other | {"name": "truth"}), 1.0)
    assert isinstance(truth, TruthSample)
    broken = [None, *data[1:]]
    assert decoder.decode("DEBUG_FLOAT_ARRAY", json.dumps(other | {"name": "truth", "data": broken}), 1.0) is None
    assert decoder.dropped == {}


def status_text(text: str, identity: int = 0, sequence: int = 0) -> str:
    """STATUSTEXT of severity 4."""
    return json.dumps({"severity": 4, "text": text, "id": identity, "chunk_seq": sequence})


def test_text_chunks_are_joined() -> None:
    """Interleaved, with a lost chunk, and a text of exactly 50 characters that PX4 does not end."""
    decoder = make()
    full = "x" * 50
    assert decoder.decode("STATUSTEXT", status_text("alone\t"), 1.0) == TextSample(1.0, 4, "alone")
    assert decoder.decode("STATUSTEXT", status_text(full, 1, 0), 2.0) is None
    assert decoder.decode("STATUSTEXT", status_text(full, 2, 0), 2.0) is None
    assert decoder.decode("STATUSTEXT", status_text("end", 1, 1), 2.1) == TextSample(2.1, 4, full + "end")
    assert decoder.decode("STATUSTEXT", status_text("tail", 3, 2), 2.2) == TextSample(2.2, 4, "......tail")
    assert decoder.overdue_texts(2.4) == []
    assert decoder.overdue_texts(2.6) == [TextSample(2.6, 4, full)]
    assert decoder.overdue_texts(9.0) == []


def recorded_samples(seconds: float) -> tuple[Decoder, list[Sample]]:
    """The beginning of PX4's recording through pymavlink, JSON and the decoder; arrivals by the recording's clock."""
    decoder = make()
    reader = mavlink.MAVLink(None)
    by_id = {message.id: name for name, message in _mavlink_classes() if name in decoder.names}
    log = test_data("px4_recordings/conformance.tlog").read_bytes()
    start_us = struct.unpack_from(">Q", log)[0]
    samples: list[Sample] = []
    offset = 0
    while offset < len(log):
        arrival_s = (struct.unpack_from(">Q", log, offset)[0] - start_us) * 1e-6
        end = offset + 8 + 12 + log[offset + 9]
        name = by_id.get(int.from_bytes(log[offset + 15 : offset + 18], "little"))
        if arrival_s > seconds:
            break
        if name is not None:
            fields = reader.decode(bytearray(log[offset + 8 : end])).to_dict()
            sample = decoder.decode(name, json.dumps(_without_nan(fields)), arrival_s)
            samples += [] if sample is None else [sample]
        offset = end
    return decoder, samples


def _mavlink_classes() -> list[tuple[str, Any]]:
    return [(message.msgname, message) for message in mavlink.mavlink_map.values()]


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_without_nan(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def test_px4s_own_recording_decodes_without_a_loss() -> None:
    """Take-off to 3 m in the recording: every message makes a sample, modes and heights are those that were flown."""
    decoder, samples = recorded_samples(37.0)
    counts = Counter(type(sample).__name__ for sample in samples)
    assert counts["OdometrySample"] > 1000
    assert counts["BatterySample"] > 10
    assert set(decoder.dropped) <= {"ATTITUDE_TARGET"}  # PX4 sends a zero quaternion before its first setpoint
    modes = [sample.mode for sample in samples if isinstance(sample, VehicleSample)]
    flown = [mode for mode, before in zip(modes, [None, *modes], strict=False) if mode is not before]
    assert flown == [FlightMode.HOLD, FlightMode.OFFBOARD, FlightMode.HOLD, FlightMode.TAKEOFF, FlightMode.HOLD]
    last = [sample for sample in samples if isinstance(sample, OdometrySample)][-1]
    assert last.position_in_world[2] == pytest.approx(3.0, abs=0.25)
    assert abs(last.position_in_world[:2]).max() < 0.5
    assert rotation_matrix(last.quaternion_body_to_world)[2, 2] > 0.99
    state = [sample for sample in samples if isinstance(sample, VehicleSample)][-1]
    assert (state.armed, state.in_air) == (True, True)
    health = [sample for sample in samples if isinstance(sample, HealthSample)][-1]
    assert (health.position_ok, health.gnss_fix) == (True, 3)


@pytest.mark.parametrize("huge", ["1e400", "1" + "0" * 400, "-1e400"])
@pytest.mark.parametrize("field", ["x", "vx", "rollspeed", "time_usec"])
def test_a_number_beyond_all_bounds_is_dropped(field: str, huge: str) -> None:
    """JSON can say what no float holds: such a message is counted, and nothing else happens."""
    decoder = make()
    text = json.dumps(odometry(**{field: "HERE"})).replace('"HERE"', huge)
    sample = decoder.decode("ODOMETRY", text, 1.0)
    assert sample is None or (field == "time_usec" and sample.time_s == 1.0)
    assert decoder.dropped["ODOMETRY"] == (sample is None)


@pytest.mark.parametrize("sequence", [256, 10**9, -1])
def test_a_chunk_that_no_text_has_is_dropped(sequence: int) -> None:
    """The missing ones before it are not made up: that would take all memory."""
    decoder = make()
    assert decoder.decode("STATUSTEXT", status_text("x" * 50, 7, sequence), 1.0) is None
    assert decoder.dropped["STATUSTEXT"] == 1
    assert decoder.overdue_texts(9.0) == []


def test_a_text_without_end_is_given_out_at_its_longest() -> None:
    """A vehicle that never ends its text must not fill the memory."""
    decoder = make()
    samples = [decoder.decode("STATUSTEXT", status_text("x" * 50, 7, n % 256), 1.0) for n in range(600)]
    assert sum(sample is not None for sample in samples) == 2


def test_a_text_cannot_reach_the_terminal() -> None:
    """Escapes and other characters that do not show become spaces."""
    sample = make().decode("STATUSTEXT", status_text("low\x1b[2J battery\t\u202e!"), 1.0)
    assert sample == TextSample(1.0, 4, "low [2J battery !")
