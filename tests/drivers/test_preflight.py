"""What the driver finds out before a flight, and the check from end to end over MAVLink."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.drivers.test_live_faults import HoveringLink, _prepare
from tests.link.fake_vehicle import FakeVehicle
from tests.link.wires import UdpWire
from uasfly.drivers import preflight
from uasfly.drivers.flight import Flight, fly_flight
from uasfly.drivers.live import fly
from uasfly.drivers.plan import load_plan
from uasfly.drivers.preflight import WARM_STEPS, gather_facts, time_solver
from uasfly.errors import LinkError
from uasfly.flight.choices import Engage
from uasfly.flight.pilot import Pilot
from uasfly.flight.preflight import PARAMETERS
from uasfly.link.ports import free_udp_port
from uasfly.messages import Array, FactsSample, NamedValue, Status
from uasfly.preflight_messages import PreflightCheck, Verdict
from uasfly.record.reader import LogReader


class InspectedVehicle(HoveringLink):
    """Tells what it is asked; its losses grow."""

    round_trip_s = 0.7e-3

    def __init__(self, missing: str = "") -> None:
        super().__init__("")
        self._missing = missing
        self._lost = 5

    async def read_parameters(self, names: Iterable[str]) -> dict[str, float | None]:
        """All but one."""
        return {name: None if name == self._missing else 4.0 for name in names}

    async def home(self) -> Array | None:
        """A metre east."""
        return np.array((1.0, 0.0, 0.0))

    def message_rates(self) -> dict[str, float]:
        """Good ones."""
        return {"ODOMETRY": 100.0}

    def losses(self) -> dict[str, int]:
        """Two more each time."""
        self._lost += 2
        return {"ODOMETRY overrun": self._lost, "send errors": 1}


@pytest.fixture
def hurried(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rates are not waited for."""
    monkeypatch.setattr(preflight, "POLLED_AFTER_S", 0.01)
    monkeypatch.setattr(preflight, "RATES_AFTER_S", 0.02)


@pytest.mark.usefixtures("hurried")
async def test_facts_are_gathered_from_the_link() -> None:
    """Unknown parameters are NaN, losses those of the time in between."""
    found = await gather_facts(InspectedVehicle("NAV_DLL_ACT"), (0.1, 0.2))
    values = {entry.name: entry.value for entry in found.parameters}
    assert set(values) == set(PARAMETERS)
    assert math.isnan(values.pop("NAV_DLL_ACT"))
    assert set(values.values()) == {4.0}
    assert found.home is not None
    assert found.home.tolist() == [1.0, 0.0, 0.0]
    assert found.rates_hz == (NamedValue("ODOMETRY", 100.0),)
    assert found.losses == (NamedValue("ODOMETRY overrun", 2.0), NamedValue("send errors", 0.0))
    assert (found.round_trip_s, found.solve_ms) == (0.7e-3, (0.1, 0.2))


def test_the_solver_is_timed_warm_and_only_where_there_is_one() -> None:
    """So many steps, each with a time; the PIDs have none."""
    times = time_solver(load_plan("hover", "f550"))
    assert len(times) == WARM_STEPS
    assert all(0.0 < time_ms < math.inf for time_ms in times)
    assert time_solver(load_plan("hover", "f550", controller="pid")) == ()


def _checked(engage: Engage) -> tuple[Any, Pilot, InspectedVehicle]:
    plan, plain, _ = _prepare("")
    parts = (plain.airframe, plain.mission, plain.observer, plain.controller)
    return plan, Pilot(*parts, engage, preflight=True, only_check=True), InspectedVehicle()


@pytest.mark.usefixtures("hurried")
async def test_the_loop_hands_facts_to_the_step_and_checks_to_log_and_summary(tmp_path: Path) -> None:
    """The facts are logged as what they were, so that a replay judges the same."""
    plan, pilot, link = _checked(Engage.PILOT)
    log = tmp_path / "check.mcap"
    summary = await fly(plan, pilot, link, log, gather=lambda: gather_facts(link, (0.1,) * 10))
    names = [check["name"] for check in summary["preflight"]]
    assert "COM_OF_LOSS_T" in names
    logged = [entry.message for entry in LogReader(log).messages()]
    (told,) = [message for message in logged if isinstance(message, FactsSample)]
    assert told.round_trip_s == 0.7e-3
    checks = [message for message in logged if isinstance(message, PreflightCheck)]
    assert [check.name for check in checks] == names
    assert [check.verdict.value for check in checks] == [check["verdict"] for check in summary["preflight"]]
    assert any(isinstance(message, Status) and message.announcements for message in logged)
    assert link.asked == []


async def test_facts_that_cannot_be_gathered_leave_much_unknown() -> None:
    """The error is told, nothing waits for it, and what is not known is a warning."""

    async def gather() -> FactsSample:
        raise LinkError("the link is closed")

    plan, pilot, link = _checked(Engage.PILOT)
    summary = await fly(plan, pilot, link, gather=gather)
    assert "the preflight check knows less: the link is closed" in summary["warnings"]
    by_name = {check["name"]: check for check in summary["preflight"]}
    assert (by_name["COM_OF_LOSS_T"]["verdict"], by_name["COM_OF_LOSS_T"]["value"]) == ("warning", "not told")


@pytest.mark.usefixtures("hurried")
async def test_gathering_does_not_outlive_the_flight() -> None:
    """A flight that ends first leaves no task behind."""

    async def gather() -> FactsSample:
        await asyncio.sleep(100.0)
        raise AssertionError

    plan, pilot, link = _checked(Engage.PILOT)
    pilot.interrupt(0.0, "Ctrl-C")
    await fly(plan, pilot, link, gather=gather)
    await asyncio.sleep(0)
    assert asyncio.all_tasks() == {asyncio.current_task()}


def _ask(**changes: Any) -> Flight:
    fields: dict[str, Any] = {
        "mission": "hover",
        "airframe": "f550",
        "sim": True,
        "url": "",
        "scenario": None,
        "seed": 1,
        "controller": "nmpc",
        "engage": None,
        "system_id": None,
        "only_check": True,
    }
    return Flight(**{**fields, **changes})


def _nobody(*_: object) -> None:
    """Watches nothing."""


def test_the_simulated_vehicle_is_checked_over_mavlink() -> None:
    """What it answers is what PX4's recording has: these warnings and no stop but for this computer's speed."""
    summary = fly_flight(_ask(), _nobody, _nobody)
    by_name = {check["name"]: check for check in summary["preflight"]}
    timing = {"solver", "latency", "odometry rate", "target rate", "round trip", "losses"}  # a busy machine
    warned = {name for name, check in by_name.items() if check["verdict"] == "warning"} - timing
    assert warned == {"COM_RC_IN_MODE", "COM_RCL_EXCEPT", "NAV_RCL_ACT", "COM_LOW_BAT_ACT"}
    assert {name for name, check in by_name.items() if check["verdict"] == "stop"} <= timing
    assert by_name["home"]["value"].endswith("m away")
    assert by_name["COM_OBL_RC_ACT"]["value"] == "5 (hold)"
    assert by_name["MPC_THR_HOVER"]["verdict"] == "ok"
    assert timing <= set(by_name)


def test_a_stop_of_the_simulated_vehicle_ends_the_flight_on_the_ground(tmp_path: Path) -> None:
    """A whole flight is asked for; nothing is armed, and everything that was found is in the summary and the log."""
    log = tmp_path / "flight.mcap"
    settings = ["plant.parameters.MPC_THR_HOVER=0.6"]
    summary = fly_flight(_ask(only_check=False, settings=settings, log=log), _nobody, _nobody)
    assert summary["outcome"] == "aborted"
    assert "MPC_THR_HOVER: 0.600" in summary["reason"]
    assert {check["name"]: check["verdict"] for check in summary["preflight"]}["MPC_THR_HOVER"] == "stop"
    assert any("preflight stop: MPC_THR_HOVER" in warning for warning in summary["warnings"])
    logged = [entry.message for entry in LogReader(log).messages()]
    stops = [m.name for m in logged if isinstance(m, PreflightCheck) and m.verdict is Verdict.STOP]
    assert "MPC_THR_HOVER" in stops
    assert not any(isinstance(message, Status) and message.armed for message in logged)
    assert summary["setpoint_rate_hz"] == 0.0


def test_two_vehicles_on_one_port_are_refused_before_a_flight() -> None:
    """Unless the system id says which: that one is looked at."""
    port = free_udp_port()
    url = f"udpin://127.0.0.1:{port}"
    with FakeVehicle(UdpWire(port), system_id=3) as one, FakeVehicle(UdpWire(port), system_id=4) as two:
        with pytest.raises(LinkError, match=r"heard 2: 3 \(PX4\), 4 \(PX4\).*--system-id"):
            fly_flight(_ask(sim=False, url=url, only_check=False), _nobody, _nobody)
        for vehicle, hover in ((one, 0.9), (two, 0.8)):
            vehicle.parameters["MPC_THR_HOVER"] = hover
        summary = fly_flight(_ask(sim=False, url=url, system_id=4), _nobody, _nobody)
    by_name = {check["name"]: check for check in summary["preflight"]}
    assert by_name["MPC_THR_HOVER"]["value"].startswith("0.800")
    assert summary["outcome"] == "aborted"
