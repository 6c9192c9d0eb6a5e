"""What the checks look at, and how they say what they find."""

from __future__ import annotations

import math
from dataclasses import dataclass

from uasfly.airframe import Airframe
from uasfly.flight.choices import Engage
from uasfly.flight.view import VehicleView
from uasfly.messages import Array, FactsSample, StateEstimate
from uasfly.mission import Mission
from uasfly.observer.diagnosis import Diagnosis
from uasfly.preflight_messages import PreflightCheck, Verdict


@dataclass(frozen=True, slots=True)
class Gathered:
    """Everything that is known before a flight.

    Attributes:
        mission, airframe: what is to be flown.
        engage: who brings the vehicle into offboard.
        view: what the vehicle has said.
        estimate, diagnosis: of the observer, None before the first odometry.
        origin: (3,) m, of the mission, in the world; None without an estimate.
        ages_s: ages of the newest odometry sample, one a control cycle.
        facts: what the driver has found out; None where it has not.
    """

    mission: Mission
    airframe: Airframe
    engage: Engage
    view: VehicleView
    estimate: StateEstimate | None
    diagnosis: Diagnosis | None
    origin: Array | None
    ages_s: tuple[float, ...]
    facts: FactsSample | None

    def parameter(self, name: str) -> float | None:
        """A parameter of PX4; None where it was not told."""
        values = {} if self.facts is None else {entry.name: entry.value for entry in self.facts.parameters}
        value = values.get(name, math.nan)
        return value if math.isfinite(value) else None

    def rate_hz(self, name: str) -> float | None:
        """Rate at which a message arrives; None where it was not measured."""
        rates = {} if self.facts is None else {entry.name: entry.value for entry in self.facts.rates_hz}
        return rates.get(name)


@dataclass(frozen=True, slots=True)
class Subject:
    """What a check is about and why it matters; its methods make the check."""

    name: str
    why: str

    def ok(self, value: str) -> PreflightCheck:
        """All is well."""
        return PreflightCheck(self.name, Verdict.OK, value, self.why)

    def warning(self, value: str, remedy: str) -> PreflightCheck:
        """It can be flown, but somebody has to know."""
        return PreflightCheck(self.name, Verdict.WARNING, value, self.why, remedy)

    def stop(self, value: str, remedy: str) -> PreflightCheck:
        """It must not be flown like this."""
        return PreflightCheck(self.name, Verdict.STOP, value, self.why, remedy)
