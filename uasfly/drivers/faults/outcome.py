"""One row of the fault table after it was flown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from uasfly.drivers.faults.case import BEGIN_S, FaultCase
from uasfly.drivers.faults.story import Story
from uasfly.messages import Setpoint

OLDEST_S = 0.2  # a setpoint that leaves later than this after it was made is stale
RANGE_TOLERANCE = 1e-6


@dataclass(frozen=True, slots=True)
class Outcome:
    """What happened.

    Attributes:
        case: what was flown.
        observed: the words of the story.
        reaction_s: see `Story.reaction_s`. strayed_m: see `Story.strayed_m`.
        problems: what was not as expected, one text each.
        texts: what uasfly announced.
    """

    case: FaultCase
    observed: tuple[str, ...]
    reaction_s: float | None
    strayed_m: float
    problems: tuple[str, ...]
    texts: tuple[str, ...] = ()

    @property
    def as_expected(self) -> bool:
        """Whether all went as it should."""
        return not self.problems

    def as_dict(self) -> dict[str, Any]:
        """For scripts."""
        return {
            "fault": self.case.name,
            "description": self.case.fault,
            "expected": sentence(self.case.expected),
            "observed": sentence(self.observed),
            "as_expected": self.as_expected,
            "reaction_s": None if self.reaction_s is None else round(self.reaction_s, 3),
            "strayed_m": round(self.strayed_m, 3),
            "over": "MAVLink" if self.case.over_mavlink else "rehearsal",
            "problems": list(self.problems),
            "announced": list(self.texts),
        }


def sentence(words: tuple[str, ...]) -> str:
    """The words of a story as one line."""
    return ", ".join(words) or "nothing"


def judge(
    case: FaultCase, story: Story, fault_s: float, limits: tuple[float, float, float], problems: list[str]
) -> Outcome:
    """Hold a story against its case.

    Args:
        case: what was expected.
        story: of the flight.
        fault_s: when the fault began, on the story's clock; NaN where the legs were not reached.
        limits: largest tilt [rad], smallest and largest thrust.
        problems: already found.
    """
    problems = list(problems)
    observed = story.from_fault(fault_s)
    if observed != case.expected:
        problems.append(f"expected {sentence(case.expected)}; observed {sentence(observed)} ({story.reason})")
    reaction = story.reaction_s(fault_s)
    if case.reaction_s is not None and (reaction is None or reaction > case.reaction_s):
        problems.append(f"reacted after {reaction} s, expected within {case.reaction_s} s")
    strayed = story.strayed_m(fault_s)
    if not strayed <= case.stray_m:
        problems.append(f"strayed {strayed:.2f} m, expected at most {case.stray_m} m")
    problems += bad_setpoints(((time_s - setpoint.time_s, setpoint) for time_s, setpoint in story.setpoints), limits)
    texts = tuple(text for time_s, text in story.texts if not time_s < fault_s)
    return Outcome(case, observed, reaction, strayed, tuple(problems), texts)


def bad_setpoints(sent: Any, limits: tuple[float, float, float]) -> list[str]:
    """What is wrong with setpoints, given as (age [s], Setpoint): not finite, out of range, or old."""
    tilt, thrust_min, thrust_max = limits
    wrong = {"not finite": 0, "out of range": 0, "older than 0.2 s": 0}
    for age_s, setpoint in sent:
        values = _values(setpoint)
        if not all(abs(value) < 1e9 for value in values):  # False for NaN
            wrong["not finite"] += 1
        elif not (
            max(abs(setpoint.roll_rad), abs(setpoint.pitch_rad)) <= tilt + RANGE_TOLERANCE
            and thrust_min - RANGE_TOLERANCE <= setpoint.thrust <= thrust_max + RANGE_TOLERANCE
        ):
            wrong["out of range"] += 1
        if not age_s <= OLDEST_S:
            wrong["older than 0.2 s"] += 1
    return [f"{count} setpoints {what}" for what, count in wrong.items() if count]


def _values(setpoint: Setpoint) -> tuple[float, ...]:
    return (
        setpoint.roll_rad,
        setpoint.pitch_rad,
        setpoint.yaw_rad,
        setpoint.yaw_rate_rad_s,
        setpoint.thrust,
    )


def begins_at(story: Story) -> float:
    """When a scheduled fault begins, on the story's clock: scenarios count from the beginning of offboard."""
    return story.legs_s + BEGIN_S
