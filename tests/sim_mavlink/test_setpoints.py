import math
from typing import TypedDict

import numpy as np
import pytest
from pymavlink.dialects.v20 import development as dialect

from tests.sim_mavlink.bench import Bench, only
from uasfly.frames import quaternion_from_euler, swap_quaternion_enu_ned

LEVEL_NORTH = (1.0, 0.0, 0.0, 0.0)
COMMAND_SET_MODE = 176


class _Change(TypedDict, total=False):
    quaternion: tuple[float, ...]
    yaw_rate: float
    thrust: float


def _send(
    bench: Bench,
    mask: int,
    quaternion: tuple[float, ...] = LEVEL_NORTH,
    yaw_rate: float = 0.0,
    thrust: float = 0.4,
    target: tuple[int, int] = (1, 1),
) -> None:
    message = dialect.MAVLink_set_attitude_target_message(0, *target, mask, quaternion, 0.0, 0.0, yaw_rate, thrust)
    assert bench.ask(message) == []


@pytest.fixture
def bench() -> Bench:
    """An endpoint, 2 s after boot."""
    bench = Bench()
    bench.run(2.0)
    return bench


def test_attitude_becomes_enu_and_flu(bench: Bench) -> None:
    """Nose east, rolled left and pitched up, is the same attitude in both conventions."""
    attitude = quaternion_from_euler(-0.1, -0.2, 0.3)
    _send(bench, 7, tuple(swap_quaternion_enu_ned(attitude)))
    received, thrust, yaw_rate = bench.vehicle.targets[0]
    np.testing.assert_allclose(received, attitude, atol=1e-6)
    assert (thrust, yaw_rate) == (pytest.approx(0.4), None)


def test_level_north_in_ned_is_yaw_90_degrees_in_enu(bench: Bench) -> None:
    """The identity of NED looks north."""
    _send(bench, 7)
    np.testing.assert_allclose(bench.vehicle.targets[0][0], quaternion_from_euler(0, 0, math.pi / 2), atol=1e-6)


@pytest.mark.parametrize("mask", [3, 0])
def test_yaw_rate_is_a_feed_forward_with_the_other_sign(bench: Bench, mask: int) -> None:
    """Clockwise from above is positive on the wire and negative in FLU."""
    _send(bench, mask, yaw_rate=0.5)
    assert bench.vehicle.targets[0][2] == pytest.approx(-0.5)


def test_mask_7_ignores_the_yaw_rate_even_if_it_is_no_number(bench: Bench) -> None:
    """An ignored field may hold anything."""
    _send(bench, 7, yaw_rate=math.nan)
    assert bench.vehicle.targets[0][2] is None


def test_quaternions_are_normalised(bench: Bench) -> None:
    """A client's rounding does not scale the attitude."""
    _send(bench, 7, (2.0, 0.0, 0.0, 0.0))
    assert np.linalg.norm(bench.vehicle.targets[0][0]) == pytest.approx(1.0)


def test_thrust_is_not_clipped_here(bench: Bench) -> None:
    """As in PX4, where the mixer saturates."""
    _send(bench, 7, thrust=1.3)
    assert bench.vehicle.targets[0][1] == pytest.approx(1.3)


@pytest.mark.parametrize("target", [(1, 1), (0, 0), (1, 0), (0, 1)])
def test_setpoints_for_this_vehicle_or_everybody_count(bench: Bench, target: tuple[int, int]) -> None:
    """Target 0 is everybody."""
    _send(bench, 7, target=target)
    assert len(bench.vehicle.targets) == 1


@pytest.mark.parametrize("target", [(2, 1), (1, 2), (245, 190)])
def test_setpoints_for_others_do_not_count(bench: Bench, target: tuple[int, int]) -> None:
    """Nothing reaches the vehicle, and offboard sees no stream."""
    _send(bench, 7, target=target)
    assert bench.vehicle.targets == []
    assert not bench.endpoint.view.setpoints_arrive


@pytest.mark.parametrize(
    ("mask", "change"),
    [
        (7, {"thrust": math.nan}),
        (7, {"quaternion": (math.nan, 0.0, 0.0, 0.0)}),
        (7, {"quaternion": (0.0, 0.0, 0.0, 0.0)}),
        (3, {"yaw_rate": math.inf}),
        (128, {}),
        (64, {}),
        (32, {}),
    ],
)
def test_setpoints_that_cannot_be_flown_are_refused_aloud(bench: Bench, mask: int, change: _Change) -> None:
    """No numbers, no direction, rates alone, no thrust: a text once a second says so."""
    for _ in range(10):
        _send(bench, mask, **change)
    assert bench.vehicle.targets == []
    assert (bench.endpoint.setpoints.accepted, bench.endpoint.setpoints.refused) == (0, 10)
    assert len(only(bench.run(0.1), "STATUSTEXT")) == 1


def test_a_stream_of_setpoints_stabilises_offboard(bench: Bench) -> None:
    """HEARTBEAT's flags show whether setpoints arrive within COM_OF_LOSS_T, as recorded."""
    bench.command(COMMAND_SET_MODE, 1, 6)
    assert only(bench.run(1.1), "HEARTBEAT")[-1].base_mode == 1
    for _ in range(11):
        _send(bench, 7)
        messages = bench.run(0.1)
    assert bench.endpoint.view.setpoints_arrive
    assert only(messages + bench.run(0.9), "HEARTBEAT")[-1].base_mode == 17
    assert only(bench.run(1.2), "HEARTBEAT")[-1].base_mode == 1
