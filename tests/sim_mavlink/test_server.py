import math
import random
import threading
import time
from collections.abc import Iterator

import pytest
from pymavlink.dialects.v20 import development as dialect

from tests.sim_mavlink.client import Client, Message
from tests.sim_mavlink.fakes import FakeVehicle
from uasfly.errors import LinkError
from uasfly.sim.mavlink.server import MAX_LAG_S, Server, ServerReport, serve


class Running:
    """A server of a fake vehicle in a thread, and its client."""

    def __init__(self) -> None:
        self.client = Client()
        self.vehicle = FakeVehicle()
        self.stop = threading.Event()
        self.report: ServerReport | None = None
        ready = threading.Event()

        def run() -> None:
            def say_ready(port: int) -> None:
                self.client.vehicle = ("127.0.0.1", port)
                ready.set()

            remote = ("127.0.0.1", self.client.port)
            self.report = serve(self.vehicle, remote, 0, stop=self.stop, ready=say_ready)

        self.thread = threading.Thread(target=run)
        self.thread.start()
        assert ready.wait(20.0)

    def end(self) -> ServerReport:
        """Stop the server and wait for it."""
        self.stop.set()
        self.thread.join(20.0)
        assert not self.thread.is_alive()
        assert self.report is not None
        self.client.socket.close()
        return self.report


@pytest.fixture
def running() -> Iterator[Running]:
    """A server that is stopped in the end."""
    running = Running()
    yield running
    running.end()


def test_telemetry_flows_by_itself(running: Running) -> None:
    """The vehicle's clock goes on without anybody asking."""
    first = running.client.wait_for("ODOMETRY")
    running.client.wait_for("ODOMETRY", lambda m: m.time_usec > first.time_usec + 500_000)


def test_a_command_is_acknowledged_and_carried_out(running: Running) -> None:
    """Over real sockets."""
    running.client.command(400, 1)
    ack = running.client.wait_for("COMMAND_ACK")
    assert (ack.command, ack.result) == (400, 0)
    assert running.vehicle.armed
    assert running.client.wait_for("HEARTBEAT", lambda m: m.base_mode & 128).system_status == 4


def test_the_vehicles_clock_keeps_pace_with_the_hosts(running: Running) -> None:
    """Between two TIMESYNC exchanges the clocks part by no more than round trips, permitted lag and reported loss."""
    offsets_ns = []
    for _ in range(2):
        sent = time.monotonic_ns()
        running.client.send(dialect.MAVLink_timesync_message(0, sent))

        def answers(m: Message, sent: int = sent) -> bool:
            return bool(m.tc1 > 0 and m.ts1 == sent)

        answer = running.client.wait_for("TIMESYNC", answers)
        offsets_ns.append((answer.tc1 - time.monotonic_ns(), answer.tc1 - sent))
        running.client.receive(0.6)
    (low_1, high_1), (low_2, high_2) = offsets_ns
    lost_s = running.end().slipped_s
    assert low_2 <= high_1 + MAX_LAG_S * 1e9
    assert low_1 <= high_2 + (MAX_LAG_S + lost_s) * 1e9


def test_floods_and_garbage_do_not_stop_it(running: Running) -> None:
    """Random bytes, broken frames and thousands of messages; afterwards it answers as before."""
    noise = random.Random(2)
    frame = bytes(dialect.MAVLink_ping_message(1, 1, 0, 0).pack(dialect.MAVLink(None, 9, 9)))
    for _ in range(300):
        junk = noise.randbytes(noise.randint(0, 300))
        for datagram in (junk, b"\xfd" + junk, frame[: noise.randint(1, len(frame))], b"", frame):
            running.client.socket.sendto(datagram, running.client.vehicle)
    running.client.command(400, 1)
    # the kernel may drop part of a flood, so the command is repeated as a client would
    for _ in range(20):
        if running.vehicle.armed:
            break
        running.client.command(400, 1)
        running.client.receive(0.2)
    assert running.vehicle.armed
    assert running.thread.is_alive()


def test_a_stopped_server_reports_and_frees_its_port() -> None:
    """The report counts what has happened; the port can be had again at once."""
    running = Running()
    running.client.wait_for("HEARTBEAT")
    running.client.send(dialect.MAVLink_set_attitude_target_message(0, 1, 1, 7, (1.0, 0, 0, 0), 0, 0, 0, 0.4))
    running.client.command(400, 1)
    running.client.wait_for("COMMAND_ACK")
    port = running.client.vehicle[1]
    report = running.end()
    assert (report.setpoints, report.received, report.damaged) == (1, 2, 0)
    assert report.sent > 20
    assert report.vehicle_s > 0.0
    other = Server(FakeVehicle(), ("127.0.0.1", 15999), port)
    other.channel.close()


def test_a_busy_port_is_told_before_anything_runs(running: Running) -> None:
    """The error comes from `serve` itself."""
    with pytest.raises(LinkError, match="in use"):
        serve(FakeVehicle(), ("127.0.0.1", 15999), running.client.vehicle[1])


class Stepped:
    """A server on a clock that the test moves."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self.vehicle = FakeVehicle()
        self.warnings: list[str] = []
        self.server = Server(self.vehicle, ("127.0.0.1", 15999), 0, clock=lambda: self.now_s, warn=self.warnings.append)

    def turn(self, later_s: float) -> float:
        """Let time pass, let the server have a turn; how far the vehicle has come."""
        before = self.vehicle.time_s
        self.now_s += later_s
        self.server.turn()
        return self.vehicle.time_s - before


@pytest.fixture
def stepped() -> Iterator[Stepped]:
    """Such a server."""
    stepped = Stepped()
    yield stepped
    stepped.server.channel.close()


def test_the_vehicle_follows_the_clock_in_whole_steps(stepped: Stepped) -> None:
    """It is never ahead of the clock, and less than a step behind."""
    for later_s in (0.001, 0.0035, 0.009, 0.0131, 0.004, 0.02):
        stepped.turn(later_s)
        behind = stepped.now_s - 100.0 - stepped.vehicle.time_s
        assert -1e-9 <= behind < stepped.vehicle.step_s
        steps = stepped.vehicle.time_s / stepped.vehicle.step_s
        assert steps == pytest.approx(round(steps), abs=1e-6)


def test_a_short_delay_is_caught_up_in_portions(stepped: Stepped) -> None:
    """A tenth of a second is made good over the next turns, while the link is served in between."""
    assert stepped.turn(0.1) == pytest.approx(0.04)
    assert stepped.turn(0.0) == pytest.approx(0.04)
    assert stepped.turn(0.0) == pytest.approx(0.02)
    assert stepped.warnings == []


def test_a_long_delay_is_dropped_and_reported_once(stepped: Stepped) -> None:
    """The vehicle goes on from where it was, in step with the clock; its own clock stands still meanwhile."""
    stepped.turn(0.01)
    clock_before = stepped.server._now_s()
    for _ in range(2):
        assert stepped.turn(1.0) == 0.0
        assert stepped.turn(0.012) == pytest.approx(0.012, abs=2 * stepped.vehicle.step_s)
    report = stepped.server.report
    assert report.slips == 2
    assert report.slipped_s == pytest.approx(2.0, abs=0.02)
    assert len(stepped.warnings) == 1
    assert "behind real time" in stepped.warnings[0]
    assert 0.0 <= stepped.server._now_s() - clock_before < 0.05


def test_a_vehicle_without_streams_keeps_pace(stepped: Stepped, monkeypatch: pytest.MonkeyPatch) -> None:
    """When nothing is due for long, the server still wakes often enough to simulate all of the time."""
    waits = []

    def wait(_read: object, _write: object, _failed: object, timeout_s: float) -> None:
        waits.append(timeout_s)
        stepped.now_s += timeout_s

    monkeypatch.setattr("uasfly.sim.mavlink.server.select.select", wait)
    for stream in stepped.server.endpoint._scheduler._timers:
        stepped.server.endpoint._scheduler.set_interval(stream, -1.0, 0.0)
    turns = iter(range(200))
    stepped.server.run(lambda: next(turns) == 199)
    assert max(waits) > 0.01
    assert stepped.server.report.slips == 0
    assert stepped.vehicle.time_s == pytest.approx(sum(waits), abs=0.05)


def test_a_machine_that_is_always_too_slow_does_not_spiral(stepped: Stepped) -> None:
    """When every portion takes longer than the time it simulates, each turn still simulates one portion at most."""
    advances = [stepped.turn(0.06) for _ in range(100)]
    assert max(advances) <= 0.04 + 1e-9
    assert stepped.server.report.slips >= 1
    lag_s = stepped.now_s - stepped.server._epoch_s - stepped.vehicle.time_s
    assert lag_s <= MAX_LAG_S + 0.06


def test_the_clock_never_runs_back(stepped: Stepped) -> None:
    """Over slips and catching up, and never further ahead of the vehicle than two steps."""
    random_times = random.Random(3)
    last_s = -math.inf
    for _ in range(500):
        stepped.turn(random_times.choice((0.001, 0.004, 0.01, 0.3)))
        now_s = stepped.server._now_s()
        assert last_s <= now_s <= stepped.vehicle.time_s + 2 * stepped.vehicle.step_s + 1e-9
        last_s = now_s
