"""Requests to a vehicle on the loopback: commands, refusals, take-off height."""

from __future__ import annotations

import pytest

from tests.link.fake_vehicle import mavlink
from tests.link.waiting import Pair, arrived, results, until
from uasfly.link.commands import Ending, Outcome
from uasfly.link.requests import explain
from uasfly.messages import Request, RequestKind, RequestResult

ARM, SET_MODE = 400, 176


async def ask(pair: Pair, request: Request) -> RequestResult:
    """Make a request and wait for its answer."""
    link, _ = pair
    link.request(request)
    samples = await until(link, lambda got: bool(results(got)))
    (result,) = results(samples)
    assert result.request == request
    return result


async def test_every_request_is_px4s_command(pair: Pair) -> None:
    """Arming is never forced, modes are custom modes; accepted requests bring the state at once."""
    _, vehicle = pair
    expected = {
        RequestKind.ARM: (ARM, (1.0, 0.0, 0.0)),
        RequestKind.DISARM: (ARM, (0.0, 0.0, 0.0)),
        RequestKind.OFFBOARD: (SET_MODE, (1.0, 6.0, 0.0)),
        RequestKind.HOLD: (SET_MODE, (1.0, 4.0, 3.0)),
        RequestKind.LAND: (SET_MODE, (1.0, 4.0, 6.0)),
        RequestKind.RETURN: (SET_MODE, (1.0, 4.0, 5.0)),
    }
    for kind, (number, parameters) in expected.items():
        result = await ask(pair, Request(kind))
        assert result.accepted
        assert result.text == ""
        assert vehicle.commands(number)[-1] == parameters
    await arrived(lambda: (0.0, 0.0, 0.0) in vehicle.commands(512))


@pytest.mark.parametrize(("code", "words"), [(1, "refused for now"), (2, "denied")])
async def test_a_refusal_says_why(pair: Pair, code: int, words: str) -> None:
    """The answer names the request, what happened and what to look at; what the vehicle says replaces the hint."""
    _, vehicle = pair
    vehicle.answers[ARM] = code
    hinted = await ask(pair, Request(RequestKind.ARM))
    assert not hinted.accepted
    assert "arm" in hinted.text
    assert words in hinted.text
    assert "pre-flight" in hinted.text

    def refuse(message: object) -> None:
        vehicle.send(mavlink.MAVLink_statustext_message(2, b"Arming denied: battery empty"))
        vehicle.acknowledge(message, code)

    vehicle.answers[ARM] = refuse
    told = await ask(pair, Request(RequestKind.ARM))
    assert 'the vehicle says "Arming denied: battery empty"' in told.text


async def test_results_beyond_the_known_ones_end_nothing(pair: Pair) -> None:
    """A COMMAND_ACK of 7 or more, which MAVSDK cannot digest, is a refusal like any other; the next request works."""
    _, vehicle = pair
    for code in (7, 9, 11, 200):
        vehicle.answers[ARM] = code
        result = await ask(pair, Request(RequestKind.ARM))
        assert not result.accepted
        assert "refused" in result.text
    vehicle.answers[ARM] = 0
    assert (await ask(pair, Request(RequestKind.ARM))).accepted


async def test_takeoff_sets_the_height_first(pair: Pair) -> None:
    """MIS_TAKEOFF_ALT is set and read back, then the mode is asked for."""
    _, vehicle = pair
    result = await ask(pair, Request(RequestKind.TAKEOFF, 4.1))
    assert result.accepted
    assert vehicle.parameters["MIS_TAKEOFF_ALT"] == pytest.approx(4.1)
    assert vehicle.commands(SET_MODE) == [(1.0, 4.0, 2.0)]
    order = [message.get_type() for message in vehicle.received]
    assert order.index("PARAM_SET") < max(index for index, name in enumerate(order) if name == "COMMAND_LONG")


async def test_takeoff_is_not_begun_with_another_height(pair: Pair) -> None:
    """A vehicle that keeps its own height is not told to take off, and is told why; wrong heights are refused."""
    link, vehicle = pair
    vehicle.frozen_parameters.add("MIS_TAKEOFF_ALT")
    result = await ask(pair, Request(RequestKind.TAKEOFF, 6.0))
    assert not result.accepted
    assert "2.5 m, asked for 6 m" in result.text
    assert vehicle.commands(SET_MODE) == []
    for height_m in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="height"):
            link.request(Request(RequestKind.TAKEOFF, height_m))


async def test_a_newer_mode_replaces_an_older_one_at_once(pair: Pair) -> None:
    """Hold goes out although offboard is still unanswered, and offboard is never repeated after it."""
    link, vehicle = pair
    vehicle.answers[SET_MODE] = lambda message: vehicle.acknowledge(message, 0) if message.param2 == 4.0 else None
    link.request(Request(RequestKind.OFFBOARD))
    await arrived(lambda: bool(vehicle.commands(SET_MODE)))
    link.request(Request(RequestKind.HOLD))
    samples = await until(link, lambda got: len(results(got)) == 2)
    offboard, hold = results(samples)
    assert (offboard.request.kind, offboard.accepted) == (RequestKind.OFFBOARD, False)
    assert "replaced" in offboard.text
    assert (hold.request.kind, hold.accepted) == (RequestKind.HOLD, True)
    sent = vehicle.commands(SET_MODE)
    assert sent[0] == (1.0, 6.0, 0.0)
    assert set(sent[1:]) == {(1.0, 4.0, 3.0)}


async def test_hold_overtakes_a_takeoff_that_waits_for_its_height(pair: Pair) -> None:
    """While the parameter is unconfirmed no take-off is sent, and after a newer request none ever is."""
    link, vehicle = pair
    vehicle.parameters.clear()
    link.request(Request(RequestKind.TAKEOFF, 3.0))
    await arrived(lambda: bool(vehicle.of_type("PARAM_SET")))
    link.request(Request(RequestKind.HOLD))
    samples = await until(link, lambda got: len(results(got)) == 2)
    assert {result.request.kind: result.accepted for result in results(samples)} == {
        RequestKind.TAKEOFF: False,
        RequestKind.HOLD: True,
    }
    assert vehicle.commands(SET_MODE) == [(1.0, 4.0, 3.0)]


def test_explanations_name_the_request_and_a_next_step() -> None:
    """No answer, replacement, an unsupported command and an unknown result each have their words."""
    assert "no answer" in explain(RequestKind.LAND, Outcome(Ending.NO_ANSWER), [])
    assert "newer request" in explain(RequestKind.LAND, Outcome(Ending.REPLACED), [])
    assert explain(RequestKind.RETURN, Outcome(Ending.ANSWERED, 3), []) == "return: not supported by this vehicle"
    assert "failed" in explain(RequestKind.ARM, Outcome(Ending.ANSWERED, 4), [])
    assert "in control" in explain(RequestKind.ARM, Outcome(Ending.ANSWERED, 10), [])
    assert "result 77" in explain(RequestKind.ARM, Outcome(Ending.ANSWERED, 77), [])
    assert "setpoints" in explain(RequestKind.OFFBOARD, Outcome(Ending.ANSWERED, 1), [])
    assert '"a; b"' in explain(RequestKind.ARM, Outcome(Ending.ANSWERED, 1), ["a", "b", "a"])
