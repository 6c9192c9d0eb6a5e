"""A campaign that is flown in some seconds, and one undisturbed run of it that the others are held against."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from uasfly.campaign.flights import FlightList
from uasfly.campaign.run import Where, run_campaign
from uasfly.campaign.table import Row, read_parquet

SHORT = """\
description: A second of hover
airframes: [f550]
missions: [hover]
scenarios: [gusty]
controllers: [nmpc]
seeds: { first: 1, count: 3 }
overrides:
  fixed:
    mission.takeoff.height_m: 1.0
    mission.ending.action: hold
    mission.legs[0].duration_s: 1
  swept:
    scenario.wind.mean.speed_at_10_m_m_s: [4, 8]
  scattered:
    plant.mass_kg: { distribution: normal, mean: 1.0, sigma: 0.05, relative: true }
success: { tracking_rms_m: 0.05 }
"""


class Told:
    """Progress that keeps what it is told."""

    def __init__(self) -> None:
        self.begun: tuple[int, int, int] | None = None
        self.landings: list[bool] = []

    def begin(self, kept: int, total: int, successes: int) -> None:
        """Flying begins."""
        self.begun = (kept, total, successes)

    def landed(self, success: bool) -> None:
        """A flight is there."""
        self.landings.append(success)


def write_campaign(folder: Path, text: str = SHORT) -> Path:
    """A campaign file in a folder."""
    path = folder / "short.yaml"
    path.write_text(text)
    return path


def listed(folder: Path, text: str = SHORT) -> FlightList:
    """The flights of a campaign text."""
    return FlightList(write_campaign(folder, text), lambda said: None)


def run(flights: FlightList, out: Path, where: Where | None = None, said: list[str] | None = None) -> dict[str, Any]:
    """Fly a campaign, in this process when not said otherwise; what is told is kept in `told` of the summary."""
    told = Told()
    say: Callable[[str], None] = (said if said is not None else []).append
    return {**run_campaign(flights, out, where or Where(workers=1), say, told), "told": told}


@pytest.fixture(scope="session")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Row], dict[str, Any]]:
    """Folder, rows and summary of the campaign, flown in one process from beginning to end."""
    folder = tmp_path_factory.mktemp("undisturbed")
    summary = run(listed(folder), folder / "out")
    return folder / "out", read_parquet(folder / "out" / "flights.parquet"), summary
