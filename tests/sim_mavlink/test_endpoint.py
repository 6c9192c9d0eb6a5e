import pytest
from pymavlink.dialects.v20 import development as dialect

from tests.sim_mavlink.bench import Bench, only
from uasfly.messages import TextSample
from uasfly.sim.mavlink.endpoint import MAX_COMPANIONS
from uasfly.sim.mavlink.identity import Sender


def _heartbeat() -> object:
    return dialect.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3)


def test_companions_are_known_by_their_heartbeats() -> None:
    """Ids and the vehicle time of the last heartbeat; their number is limited."""
    bench = Bench(client=(1, 191))
    bench.run(1.0)
    assert bench.ask(_heartbeat()) == []
    assert bench.endpoint.companions == {Sender(1, 191): pytest.approx(1.0)}
    for component in range(100, 100 + 2 * MAX_COMPANIONS):
        bench.endpoint.receive(Bench(client=(2, component)).received(_heartbeat()))
    assert len(bench.endpoint.companions) == MAX_COMPANIONS


def test_messages_under_the_vehicles_own_ids_are_ignored() -> None:
    """An echo of the vehicle's own frames does nothing."""
    bench = Bench(client=(1, 1))
    assert bench.command(400, 1) == []
    assert not bench.vehicle.armed


def test_messages_of_other_kinds_are_ignored() -> None:
    """Telemetry of others, camera and gimbal messages, and whatever else is on the link."""
    bench = Bench()
    before = len(bench.vehicle.targets)
    for message in (
        dialect.MAVLink_attitude_message(1, 0, 0, 0, 0, 0, 0),
        dialect.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0),
        dialect.MAVLink_command_ack_message(400, 0, 0, 0, 1, 1),
        dialect.MAVLink_statustext_message(6, b"hello", 0, 0),
    ):
        assert bench.ask(message) == []
    assert len(bench.vehicle.targets) == before


def test_it_tells_when_it_has_something_to_send() -> None:
    """The next stream that is due, or the next step while parameters or texts wait."""
    bench = Bench()
    bench.run(1.0)
    now = bench.vehicle.time_s
    assert now < bench.endpoint.next_due_s <= now + 0.01 + 1e-9
    for message_id in (30, 31, 32, 33, 105, 331):
        bench.command(511, message_id, -1.0)
    bench.run(0.004)
    assert bench.endpoint.next_due_s > bench.vehicle.time_s + bench.vehicle.step_s
    bench.ask(dialect.MAVLink_param_request_list_message(1, 1))
    assert bench.endpoint.next_due_s == pytest.approx(bench.vehicle.time_s + bench.vehicle.step_s)


def test_texts_of_the_vehicle_go_out_once() -> None:
    """In the order in which they were said."""
    bench = Bench()
    bench.vehicle.texts = [TextSample(0.0, 6, "Armed by external command"), TextSample(0.0, 6, "Takeoff detected")]
    received = only(bench.run(0.1), "STATUSTEXT")
    assert [m.text for m in received] == ["Armed by external command", "Takeoff detected"]
