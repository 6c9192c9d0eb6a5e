"""All checks together, and what follows from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from uasfly.flight.preflight.battery import battery_checks
from uasfly.flight.preflight.gathered import Gathered
from uasfly.flight.preflight.link import link_checks
from uasfly.flight.preflight.parameters import parameter_checks
from uasfly.flight.preflight.place import place_checks, plan_from_here
from uasfly.flight.preflight.solver import solver_check
from uasfly.flight.preflight.vehicle import vehicle_checks
from uasfly.preflight_messages import PreflightCheck, Verdict

SEVERITIES = {Verdict.WARNING: 4, Verdict.STOP: 3}  # MAVLink: warning, error


def judge(gathered: Gathered) -> tuple[PreflightCheck, ...]:
    """Every check, in the order in which a pilot goes through them."""
    plan = plan_from_here(gathered)
    return (
        *vehicle_checks(gathered),
        *battery_checks(gathered, None if isinstance(plan, str) else plan),
        *place_checks(gathered, plan),
        *link_checks(gathered),
        solver_check(gathered),
        *parameter_checks(gathered),
    )


def as_pilot_flies(checks: Sequence[PreflightCheck]) -> tuple[PreflightCheck, ...]:
    """Stops as warnings that say what they were: the pilot flies already, and nothing can be kept on the ground."""
    return tuple(
        replace(check, verdict=Verdict.WARNING, value=f"{check.value} (on the ground this would be a stop)")
        if check.verdict is Verdict.STOP
        else check
        for check in checks
    )


def stop_reason(checks: Sequence[PreflightCheck]) -> str:
    """Why nothing may be armed, "" where it may."""
    stops = [f"{check.name}: {check.value}" for check in checks if check.verdict is Verdict.STOP]
    return "the preflight check says stop: " + "; ".join(stops) if stops else ""


def announcements(checks: Sequence[PreflightCheck]) -> list[tuple[int, str]]:
    """Texts for the pilot, with their MAVLink severity; what is well is not told."""
    return [
        (SEVERITIES[check.verdict], f"preflight {check.verdict.value}: {check.name} {check.value}: {check.remedy}")
        for check in checks
        if check.verdict in SEVERITIES
    ]
