"""Flies a case as a rehearsal: deterministic and faster than real time."""

from __future__ import annotations

import tempfile
from pathlib import Path

from uasfly.drivers.faults.case import FaultCase
from uasfly.drivers.faults.outcome import Outcome, begins_at, judge
from uasfly.drivers.faults.story import Story
from uasfly.drivers.plan import load_plan
from uasfly.drivers.rehearse import rehearse
from uasfly.record.reader import LogReader


def fly_rehearsed(case: FaultCase, seed: int) -> Outcome:
    """Fly a case in this process and hold it against what was expected."""
    plan = load_plan("hover", case.airframe, seed=seed, scenario=case.scenario, settings=case.all_settings)
    limits = plan.airframe.limits
    story = Story()
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "flight.mcap"
        rehearse(plan, log)
        story.read((entry.log_time_s, entry.message) for entry in LogReader(log).messages())
    return judge(case, story, begins_at(story), (limits.tilt_rad, limits.thrust_min, limits.thrust_max), [])
