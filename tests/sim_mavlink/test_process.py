import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.sim_mavlink.client import PATIENCE_S, Client
from tests.sim_mavlink.fakes import FakeVehicle
from uasfly.errors import LinkError
from uasfly.files import find_file, load_file
from uasfly.sim.mavlink.process import SimulatedVehicleProcess, start_process
from uasfly.sim.mavlink.server import Server
from uasfly.sim.plant import Plant
from uasfly.sim.scenario import Scenario

PARENT = """
import os, sys, time
from uasfly.sim.mavlink.process import start_process
from uasfly.sim.plant import Plant
from uasfly.sim.scenario import Scenario
plant, scenario = Plant.model_validate_json(sys.argv[1]), Scenario.model_validate_json(sys.argv[2])
handle = start_process(plant, scenario, 1, remote_port=15999)
{then}
"""
ENDED = """
print(handle.pid, flush=True)
"""
KILLED_BESIDE_A_SIBLING = """
sibling = os.fork()  # a child that has inherited the pipe to the vehicle
if sibling == 0:
    time.sleep(60)
    os._exit(0)
print(handle.pid, sibling, flush=True)
os.kill(os.getpid(), 9)
"""


def f550() -> Plant:
    """The plant that the tests fly."""
    return load_file(find_file("plant", "f550"), Plant)


def calm() -> Scenario:
    """A scenario without wind."""
    return load_file(find_file("scenario", "calm"), Scenario)


def _is_running(pid: int) -> bool:
    """Whether a process exists and is no zombie (a killed parent's children are reaped by somebody else)."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def _ends(pid: int) -> bool:
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        if not _is_running(pid):
            return True
        time.sleep(0.02)
    os.kill(pid, signal.SIGKILL)  # nothing is left running, not even by a failing test
    return False


@pytest.fixture(scope="module")
def served() -> Iterator[tuple[SimulatedVehicleProcess, Client]]:
    """A vehicle of system 3, and the client that it sends to."""
    with Client() as client:
        handle = start_process(f550(), calm(), 1, remote_port=client.port, system_id=3, start_position=(1.0, 2.0, 0.0))
        with handle:
            client.vehicle = ("127.0.0.1", handle.local_port)
            yield handle, client


def test_a_started_vehicle_answers_on_its_port(served: tuple[SimulatedVehicleProcess, Client]) -> None:
    """It is ready when the call returns: ids, place and commands are right without waiting."""
    handle, client = served
    assert handle.alive
    position = client.wait_for("LOCAL_POSITION_NED")
    assert (position.get_srcSystem(), position.get_srcComponent()) == (3, 1)
    assert (position.x, position.y, position.z) == pytest.approx((2.0, 1.0, 0.0), abs=0.3)


def test_a_terminals_interrupt_does_not_reach_the_vehicle(served: tuple[SimulatedVehicleProcess, Client]) -> None:
    """It has a session of its own: whoever started it decides when it goes."""
    handle, _ = served
    assert os.getsid(handle.pid) == handle.pid != os.getsid(0)


def test_a_busy_port_is_told_by_the_starter(served: tuple[SimulatedVehicleProcess, Client]) -> None:
    """One clear message, in the words of the channel."""
    handle, client = served
    with pytest.raises(LinkError, match=rf"did not start: UDP port {handle.local_port} .*in use"):
        start_process(f550(), calm(), 1, remote_port=client.port, local_port=handle.local_port)


def test_stopping_ends_the_process_and_reports(served: tuple[SimulatedVehicleProcess, Client]) -> None:
    """The process is gone, its port is free, the report is there; stopping again changes nothing."""
    handle, _ = served
    report = handle.stop()
    assert not handle.alive
    assert not _is_running(handle.pid)
    assert report is not None
    assert report.vehicle_s > 0.0
    assert report.sent > 0
    assert handle.stop() == report
    assert handle.complaints() == "" or report.slips  # a busy machine may have warned of slippage, nothing else may
    server = Server(FakeVehicle(), ("127.0.0.1", 15999), handle.local_port)
    server.channel.close()


def test_a_vehicle_that_does_not_answer_in_time_is_ended() -> None:
    """The starter gives up, says so, and leaves nothing running."""
    before = _children()
    with pytest.raises(LinkError, match=r"no answer within 0\.01 s"):
        start_process(f550(), calm(), 1, remote_port=15999, ready_timeout_s=0.01)
    assert _children() == before


def _children() -> set[str]:
    return set(Path(f"/proc/self/task/{os.getpid()}/children").read_text().split())


@pytest.mark.parametrize("then", [ENDED, KILLED_BESIDE_A_SIBLING], ids=["ended", "killed"])
def test_the_vehicle_goes_when_its_parent_goes(then: str) -> None:
    """Ended without stopping it, or killed while another process holds the pipe: the vehicle does not stay behind."""
    arguments = [PARENT.format(then=then), f550().model_dump_json(), calm().model_dump_json()]
    with subprocess.Popen([sys.executable, "-c", *arguments], stdout=subprocess.PIPE) as parent:
        assert parent.stdout is not None
        assert select.select((parent.stdout,), (), (), 3 * PATIENCE_S)[0]
        pid, *siblings = map(int, parent.stdout.readline().split())
        assert _ends(pid)
        parent.wait(PATIENCE_S)
    for sibling in siblings:
        os.kill(sibling, signal.SIGKILL)
